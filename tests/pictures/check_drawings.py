"""What stands in pictures, beside what files hold: check_drawings.py PROGRAM SCRIPTS FOLDER

Scenes with few contacts, none, or none of rigid stops with a limit; long titles; numbers far from 1. No picture is written.
"""

import contextlib
import importlib
import io
import os
import subprocess
import sys
import warnings
from pathlib import Path
from types import SimpleNamespace

PROGRAM, SCRIPTS, FOLDER = sys.argv[1], sys.argv[2], Path(sys.argv[3])
sys.dont_write_bytecode = True
sys.path.insert(0, SCRIPTS)

# pylint: disable=wrong-import-position
import impactbeam_plots as plots
import matplotlib.pyplot as plt
import numpy as np
import plot_bifurcation
import plot_frequencies
import plot_paper
import plot_response
import plot_scene
import plot_spectrum
import plot_statistics
import plot_sweep

BEAM = """&scene units = 'SI', title = '{title}' /
&beam length = 0.1, width = 0.01, height_root = 1e-3, youngs_modulus = 2e11, density = 7800 /
&mesh elements = 8 /
&damping zeta = 0.02 /
"""
SHAKEN = """&force position = 1, amplitude = {force}, frequency = 60 /
&start kind = 'rest' /
&response duration_time = 0.2 /
&statistics start_time = 0.1 /
"""
NARROW, WIDE = ("&stop position = {}, side = 'both', clearance = {}, law = 'spring_damper', stiffness_ratio = 20 /\n".format(*place)
                for place in ((0.3, 0.09), (1, 1e-3)))


def run(name, text, **values):
    """The results of a scene."""
    scene = FOLDER/f"{name}.nml"
    scene.write_text(BEAM.format(title=values.get("title", name)) + text.format(**values), encoding="utf-8")
    subprocess.run([PROGRAM, "--quiet", "--out", FOLDER, scene], check=True, stdin=subprocess.DEVNULL)
    return FOLDER/f"{name}.h5"


def box_of(artist):
    """What an artist covers of its figure, in pixels."""
    return artist.get_window_extent(artist.figure.canvas.get_renderer())


def title_in(axes):
    """The title of a panel, wherever it stands above it."""
    return max((axes.title, axes._left_title, axes._right_title), key=lambda text: len(text.get_text()))  # pylint: disable=protected-access


def reason_of(path, panels=("displacement",), draw=None):
    """Why a file has no picture of its response, or another picture."""
    try:
        (draw or (lambda path: plot_response.draw_one(plot_response.Response(path, "file"), list(panels))))(path)
    except plots.Unplottable as reason:
        return str(reason).replace(f"{path}: ", "")
    return "drawn"


def words_of(figure):
    """All texts of a figure that are not empty."""
    return [text.get_text() for text in figure.findobj(plt.Text) if text.get_text()]


def check_statistics():
    """A first stop without impacts does not fix the scale of the others; each owner is named once; rigid contacts
    have no RMS force."""
    statistics = plot_statistics.Statistics(run("narrow", NARROW + WIDE + SHAKEN, force=2))
    figure = plot_statistics.draw(statistics)
    last = figure.axes[-1]
    assert last.get_xlim()[0] == 0.0 and last.get_xlim()[1] >= statistics.classes[-1][0][-1] > 1.0, last.get_xlim()
    assert [text.get_text() for text in figure.axes[0].get_xticklabels()] == ["stop 1", "stop 2"], words_of(figure)
    path = run("rigid", "&stop side = 'both', clearance = 1e-3 /\n" + SHAKEN, force=2)
    figure = plot_statistics.draw(plot_statistics.Statistics(path))
    assert words_of(figure).count("not defined for rigid contacts") == 1, words_of(figure)


def check_rest():
    """A beam at rest has its stops in the picture, and panels of forces name their stops."""
    response = plot_response.Response(run("rest", NARROW + WIDE + SHAKEN, force=0), "file")
    plot_response.read_alike([response])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = plot_response.draw_one(response, ["displacement", "force"])
    assert figure.axes[0].get_ylim()[1] > 1.0 and "no force: 1 below, 1 above, 2 below, 2 above" in words_of(figure)


def check_records():
    """A file without data of a picture says what would record it, and which pictures it has data for."""
    kinds = {path.stem.removeprefix("plot_") for path in Path(SCRIPTS).glob("plot_*.py")}
    assert kinds - set(plots.DATA) == {"paraview"} and not set(plots.DATA) - kinds, kinds
    recorded = WIDE + SHAKEN + "&frequency_response frequency_range = 1, 100, points = 5 /\n&output histories = '{kept}' /\n"
    for kept in ("none", "acceleration_tip"):
        assert reason_of(run("none", recorded, force=2, kept=kept)) == "no history that has a picture was recorded: see &output " \
            "histories; it has data for impactbeam-plot scene, spectrum, statistics"
    path = run("speed", recorded, force=2, kept="velocity_stop")
    assert reason_of(path) == "no displacement was recorded (see &output histories); there is --panels velocity", reason_of(path)
    assert reason_of(path, ["stress"]) == "no stress was recorded (see &stress); there is --panels velocity"
    assert reason_of(path, draw=lambda path: plot_sweep.Sweep(path, None)) == \
        "has no /sweep: its scene has no &sweep; it has data for impactbeam-plot response, scene, spectrum, statistics"
    # with several surfaces too, the tip alone
    response = plot_response.Response(run("tip", recorded, force=2, kept="displacement_tip"), "file")
    plot_response.read_alike([response])
    assert {"tip", "displacement $y - d$ (mm)"} <= set(words_of(plot_response.draw_one(response, ["displacement"])))


def check_stack():
    """The legend of a stack has the signs of all panels and stands above the lines of the first title."""
    stop = "&stop surface_height = 0, initial_height = 1e-3 /\n&response duration_time = {end} /\n"
    paths = [run(f"stack_{end}", stop, title="Long " + 17*"and longer ", end=end) for end in (1e-4, 0.05)]
    responses = [plot_response.Response(path, "file") for path in paths]
    plot_response.read_alike(responses)
    figure = plot_response.draw_stack(responses)
    figure.canvas.draw()
    legend = figure.axes[0].get_legend().get_texts()
    assert [text.get_text() for text in legend] == ["stop = tip", "impact", "contact"], words_of(figure)
    titles = [box_of(title_in(axes)) for axes in figure.axes]
    assert min(box_of(text).y0 for text in legend) >= titles[0].y1 and titles[1].y1 <= box_of(figure.axes[0]).y0


def check_frequencies():
    """The legend covers no point of curves that fall, as of errors that become smaller."""
    table = SimpleNamespace(title="", unit="Hz", shape=None, labels=["n = 4", "n = 8"], mode=np.arange(1, 9),
                            frequency=np.ones((8, 2)), error=10.0**-np.arange(8)[:, None]*[1.0, 0.5])
    plot_frequencies.Table, kept = lambda path: table, plot_frequencies.Table
    figure = plot_frequencies.draw(None)
    plot_frequencies.Table = kept
    figure.canvas.draw()
    panel = figure.axes[-1]
    legend = box_of(panel.get_legend())
    points = np.concatenate([panel.transData.transform(line.get_xydata()) for line in panel.lines])
    assert not legend.count_contains(points), "a legend on points"


def check_peaks():
    """Titles of several lines are as wide as their panels, and cover no labels of panels above them."""
    path = run("peaks", "&stop surface_height = 0, initial_height = 1e-3 /\n&response duration_time = 0.05 /\n"
               "&cases parameter = 'initial_height', values = 1e-3, 2e-3 /\n", title="Long " + 5*"and longer ")
    figure = plot_paper.draw_peaks(3*[plot_paper.Cases(path)])
    figure.canvas.draw()
    for axes in figure.axes[:3]:
        assert box_of(title_in(axes)).width <= box_of(axes).width, "a title wider than its panel"
    labels = [box_of(label).y0 for label in figure.axes[0].get_xticklabels() if label.get_text()]
    assert box_of(title_in(figure.axes[2])).y1 <= min(labels), "a title on labels"


def check_fonts():
    """Characters that the first font lacks are drawn by another one; those that none has are named in one line."""
    with warnings.catch_warnings(), contextlib.redirect_stderr(io.StringIO()) as said:
        warnings.simplefilter("error")
        for title, line in (("\u10e5\u10d0\u10e0\u10d7", ""), ("\U0010fffda", "machine has them: \U0010fffd\n")):
            with plots.open_results(run("font", WIDE + SHAKEN, force=1, title=title)) as file:
                figure = plt.figure()
                figure.suptitle(plots.title_of(file))
            figure.canvas.draw()
            assert said.getvalue().endswith(line) and said.getvalue().count("\n") == len(line[:1]), said.getvalue()


def check_sweep():
    """The measure that most cases have; words above a legend."""
    sweep = plot_sweep.Sweep(run("driven", WIDE + SHAKEN + "&sweep force_1_amplitude = 1, 2, 3 /\n", force=2), None)
    assert sweep.measure == "greatest_force", sweep.measure
    labels = [plot_sweep.Sweep(FOLDER/"driven.h5", name).measure_label() for name in ("rms_force", "greatest_impulse")]
    assert labels[0].startswith("RMS force (") and labels[1].startswith("maximum impulse ("), labels
    released = "&stop surface_height = 0, initial_height = 1e-3 /\n&response duration_time = 0.019 /\n"
    sweep = plot_sweep.Sweep(run("best", released + "&sweep zeta = 0.001, 0.05, 0.2 /\n&best /\n"), None)
    assert sweep.measure == "settling_time" and np.isnan(sweep.column).any(), sweep.column
    figure = plot_sweep.draw_curves(sweep, "zeta", None)
    figure.canvas.draw()
    panel = figure.axes[0]
    title = next(text for text in panel.findobj(plt.Text) if "within the run" in text.get_text()).get_window_extent()
    assert title.y0 >= panel.get_legend().get_texts()[0].get_window_extent().y1, "words on the legend"
    several = "&sweep zeta = 0.01, 0.02, restitution = 0.4, 0.5, tip_mass_ratio = 0.1, 0.2, position = 0.9, 1 /\n"
    best = plot_sweep.Sweep(run("several", released + several + "&best /\n"), None).best_in_words()
    assert best.count("\u00a0=\u00a0") == 4 and " =" not in best, best


def check_cases():
    """Cases of a scene in units are drawn in them."""
    figure = plot_paper.draw_cases(plot_paper.Cases(run("cases", "&stop surface_height = 0, initial_height = 1e-3 /\n"
        "&response duration_time = 0.05 /\n&cases parameter = 'initial_height', values = 1e-3, 2e-3 /\n")))
    found = words_of(figure)
    assert {"time $t$ (ms)", "$y - d$ (mm)", "initial height 2\u00a0mm"} <= set(found), found


def check_bifurcation():
    """Displacements below velocities have their own unit; a map and a diagram have one unit of frequencies."""
    shaken = SHAKEN.replace("60 /", "5e4 /").replace("0.2 /", "0.02 /").replace("0.1 /", "0.01 /")
    path = run("fast", WIDE + shaken + "&frequency_response frequency_range = 1e4, 1e5, points = 20 /\n"
               "&poincare skip = 2, keep = 2 /\n&spectrum of = 'displacement_tip', segments = 1, frequency_range = 0, 1e5 /\n"
               "&sweep force_1_frequency = 2e4, 4e4 /\n", force=2)
    figure = plot_bifurcation.draw(plot_bifurcation.Diagram(path, "velocity", "tip", 1), "velocity")
    found = words_of(figure)
    assert any(word.startswith("amplitude (") and word.endswith("m)") for word in found), found
    assert "force 1 frequency (kHz)" in found, found
    found = words_of(plot_spectrum.draw_map(plot_spectrum.Map(path, None)))
    assert {"frequency (kHz)", "force 1 frequency (kHz)"} <= set(found), found


def check_help():
    """The options of all scripts fit on a terminal."""
    os.environ["COLUMNS"] = "80"
    for path in Path(SCRIPTS).glob("plot_*.py"):
        sys.argv = [path.name, "--help"]
        with contextlib.redirect_stdout(io.StringIO()) as said, contextlib.suppress(SystemExit):
            importlib.import_module(path.stem).main()
        assert "usage" in said.getvalue() and all(len(line) <= 80 for line in said.getvalue().split("\n")), said.getvalue()


def check_film():
    """The legend of seven points stays below the label of the axis above it."""
    places = []

    def measure(figure, *rest):
        # the figure is closed after this, and Matplotlib 3.11 draws no closed figure
        figure.canvas.draw()
        places.append(([text.get_window_extent().y1 for text in figure.axes[1].get_legend().get_texts()],
                       figure.axes[0].xaxis.label.get_window_extent().y0))
        rest[-1].touch()

    plot_scene.save_film = measure
    stops = "".join(f"&stop position = {place/10}, side = 'both', clearance = 1e-3 /\n" for place in range(3, 10))
    path = run("film", stops + SHAKEN.replace("0.2 /", "0.02 /").replace("0.1 /", "0.01 /") + "&output shape_step = 1 /\n", force=1)
    plot_scene.animate(plot_scene.Scene(path), FOLDER/"film.gif")
    [(legend, label)] = places
    assert len(legend) == 7 and max(legend) <= label, places


def check_words():
    """Long titles have several lines, the seventh curve is not the first, an error of 0 has no place, megahertz are read in kHz."""
    title = "Long " + 10*"and longer "
    with plots.open_results(run("long", WIDE + SHAKEN, force=1, title=title)) as file:
        assert len(plots.title_of(file).split("\n")) == 2, plots.title_of(file)
    assert plots.line_of(0) != plots.line_of(6) and plots.reading(1e6, "Hz") == (1e-3, "kHz")
    assert plots.reading_of([1.4e-4], "m") == (1e3, "mm")
    assert [plots.reading(*size)[1] for size in ((1.9e-13, "N s"), (2e-14, "W"), (7e-9, "mm"))] == ["pN s", "fW", "pm"]
    assert plots.reading_of([2e-5], "1") == (1e6, "$10^{-6}$"), plots.reading_of([2e-5], "1")
    axes = plt.figure().subplots()
    table = SimpleNamespace(labels=["n"], mode=np.array([1, 2]))
    plot_frequencies.draw_columns(axes, table, np.array([[1e-3], [0.0]]))
    assert np.isnan(axes.lines[0].get_ydata()[1])
    axes.set_ylim(3.0, 60.0)
    plots.set_decades(axes.yaxis)
    assert axes.yaxis.get_minor_formatter()(20.0) == "20" and axes.yaxis.get_minor_formatter()(30.0) == ""


if __name__ == "__main__":
    FOLDER.mkdir(parents=True, exist_ok=True)
    plt.rcParams.update(plots.STYLE)
    for check in (check_statistics, check_rest, check_records, check_stack, check_frequencies, check_peaks, check_fonts, check_sweep,
                  check_cases, check_bifurcation, check_help, check_film, check_words):
        check()
