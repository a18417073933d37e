#!/usr/bin/python3
"""Draw the paper's tables and figures, an animation of the first impact, and a contact sheet of them all.

    impactbeam inputs/fig*.nml inputs/table*.nml
    impactbeam-paper inputs/statements.nml
    scripts/plot_paper.py results/fig*.h5 results/table*.h5 results/statements.h5 --out results/paper

Files with several cases give a panel a case; files with shapes give the beam before, at and after the impact, and its
animation; tables give their errors, statements their verdicts; all cases together give the peaks of their rebounds
(figure 10). Plots what the results files hold; between nodes the beam is the cubic of its elements.
"""

import argparse
import textwrap
from pathlib import Path

import impactbeam_plots as plots
import matplotlib.patches as patches
import matplotlib.pyplot as plt
import matplotlib.ticker as ticker
import numpy
from PIL import Image
import plot_frequencies
import plot_scene
from plot_response import set_ticks, shade_contacts

SYMBOLS = {
    "preload": r"\delta", "restitution": r"\varepsilon", "position": r"L_c/L", "zeta": r"\zeta",
    "tip_mass_ratio": r"\mu", "taper": r"\alpha", "stiffness_ratio": r"\kappa", "branch_ratio": r"\beta",
    "damper_ratio": r"c^*",
}
CURVE_COLOURS = plots.COLOURS + ["#c9a227"]
CURVE_MARKERS = plots.MARKERS + ["X"]
PEAKS = "fig10"


def plain(group, name):
    """The numbers of a dataset without units."""
    return plots.values_of(group, name, "dimensionless")


class Case:
    """What a panel shows of one case."""

    def __init__(self, group, parameter, unit):
        self.value = float(group.attrs["value"])
        factor, unit = plots.reading(abs(self.value), unit)
        self.label = f"${SYMBOLS[parameter]} = {self.number()}$" if parameter in SYMBOLS else \
            f"{parameter.replace('_', ' ')} {plots.quantity(factor * self.value, unit)}"
        response, measures = group["response"], group["measures"]
        self.tau, self.eta = plots.values_of(response, "tau"), plots.values_of(response, "eta_stop")
        self.units = [plots.unit_of(response, name) for name in ("tau", "eta_stop")]
        self.contacts = numpy.column_stack([plots.values_of(measures, name) for name in ("contact_start", "contact_end")])
        events = group["events"]
        names = plots.text_of(events["kind"].attrs["flag_meanings"]).split()
        is_shown = events["kind"][()] == names.index("impact") + 1
        if "surface" in events:
            is_shown &= events["surface"][()] == plots.surface_of_release(group.file["scene"]) + 1
        self.impacts = plots.values_of(events, "tau")[is_shown]
        # those of several files share axes, so they are without units
        self.peaks = (plain(measures, "peak_tau"), plain(measures, "peak")) if "peak" in measures else ([], [])

    def number(self):
        """The value as TeX."""
        if abs(self.value) < 1e4:
            return f"{self.value:g}"
        exponent = int(numpy.floor(numpy.log10(self.value)))
        mantissa = self.value / 10**exponent
        return f"10^{{{exponent}}}" if mantissa == 1.0 else rf"{mantissa:g}\times 10^{{{exponent}}}"


class Cases:
    """One file with several cases."""

    def __init__(self, path):
        with plots.open_results(path) as file:
            group = file["cases"]
            self.name = path.stem
            self.title = plots.title_of(file)
            self.parameter = plots.text_of(group.attrs["parameter"])
            unit = plots.text_of(group[self.parameter].attrs["units"])
            self.cases = [Case(group[f"case_{number}"], self.parameter, unit if unit != "1" else "") for number in plots.cases_that_ran(group)]
        greatest = [max(abs(values).max() for values in column) for column in zip(*((case.tau, case.eta) for case in self.cases))]
        (time, self.time_unit), (length, self.unit) = map(plots.reading, greatest, self.cases[0].units)
        for case in self.cases:
            case.tau, case.eta, case.contacts, case.impacts = time * case.tau, length * case.eta, time * case.contacts, time * case.impacts
        # what stands for the displacement at the start, which is 1 without units
        self.start = length * greatest[1] if self.unit else 1.0


def draw_cases(cases):
    """Displacement at the stop, a panel each."""
    count = len(cases.cases)
    figure, grid = plt.subplots(count, 1, sharex=True, squeeze=False, gridspec_kw={"hspace": 0.0},
                                figsize=(plots.WIDTH, 1.12 * count + 0.7))
    lowest = min(case.eta.min() for case in cases.cases)
    highest = max(case.eta.max() for case in cases.cases)
    for axes, case in zip(grid[:, 0], cases.cases):
        shade_contacts(axes, case)
        axes.axhline(0.0, color="black", linewidth=0.5, zorder=1)
        axes.plot(case.tau, case.eta, color="black", linewidth=0.9)
        axes.vlines(case.impacts, -0.105 * cases.start, -0.03 * cases.start, color=plots.COLOURS[1], linewidth=0.8, zorder=3)
        axes.set_ylim(min(-0.15 * cases.start, 1.25 * lowest), max(1.15 * cases.start, 1.1 * highest))
        set_ticks(axes.yaxis, 3)
        axes.set_ylabel(plots.with_unit("$y - d$", cases.unit) if cases.unit else r"$\eta$")
        axes.text(0.985, 0.9, case.label, transform=axes.transAxes, ha="right", va="top", zorder=5,
                  bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.2})
    grid[0, 0].set_title(cases.title)
    handles = [patches.Patch(facecolor=plots.CONTACT, label="contact")]
    if any(len(case.impacts) for case in cases.cases):
        handles.insert(0, plt.Line2D([], [], linestyle="none", marker="|", markersize=6, color=plots.COLOURS[1], label="impact"))
    grid[0, 0].legend(handles=handles, loc="lower right", bbox_to_anchor=(1.01, 0.97), borderaxespad=0.0, ncol=len(handles),
                      columnspacing=1.4, handletextpad=0.4)
    grid[-1, 0].set_xlabel(plots.with_unit("time $t$", cases.time_unit) if cases.time_unit else r"time $\tau = \omega_1 t$")
    grid[-1, 0].set_xlim(0.0, max(case.tau[-1] for case in cases.cases))
    set_ticks(grid[-1, 0].xaxis, 10)
    figure.align_ylabels(grid[:, 0])
    return figure


def draw_peaks(files):
    """Peaks of the rebounds over time, a panel for each parameter (figure 10)."""
    rows = (len(files) + 1) // 2
    figure, grid = plt.subplots(rows, 2, squeeze=False, sharey=True, figsize=(plots.WIDTH, 2.5 * rows + 0.4),
                                gridspec_kw={"hspace": 0.42, "wspace": 0.07})
    for axes in grid.flat[len(files):]:
        axes.set_visible(False)
    for axes, cases in zip(grid.flat, files):
        for number, case in enumerate(cases.cases):
            colour = CURVE_COLOURS[number % len(CURVE_COLOURS)]
            axes.plot(*case.peaks, color=colour, linewidth=0.7, label=case.label, markersize=3.6,
                      linestyle=plots.DASHES[number % len(plots.DASHES)],
                      marker=CURVE_MARKERS[number % len(CURVE_MARKERS)], markerfacecolor="white", markeredgecolor=colour,
                      markeredgewidth=0.8)
        axes.set_yscale("log")
        axes.set_ylim(0.018, 1.3)
        axes.yaxis.set_major_locator(ticker.FixedLocator([0.02, 0.05, 0.1, 0.2, 0.5, 1.0]))
        axes.yaxis.set_major_formatter(ticker.FormatStrFormatter("%g"))
        axes.yaxis.set_minor_formatter(ticker.NullFormatter())
        axes.set_xlim(0.0, None)
        set_ticks(axes.xaxis, 6)
        axes.set_title(textwrap.fill(cases.title.split(",")[0], 44), fontsize=9.5, pad=4)
        axes.legend(fontsize=6.8, handlelength=2.0, labelspacing=0.25, borderpad=0.2, loc="upper right", frameon=True,
                    facecolor="white", edgecolor="none", framealpha=0.75, ncol=1 + (len(cases.cases) > 4),
                    columnspacing=0.9)
    for axes in grid[:, 0]:
        axes.set_ylabel(r"peak of rebound $\eta$")
    for axes in grid.flat[max(len(files) - 2, 0):len(files)]:
        axes.set_xlabel(r"time $\tau$")
    return figure


class Shapes:
    """Shapes of one file, as smooth curves."""

    def __init__(self, path):
        with plots.open_results(path) as file:
            group = plots.group_of(file, "shapes", "&output shape_times or shape_step")
            self.name = path.stem
            self.title = plots.title_of(file)
            self.tau = plain(group, "tau")
            self.impact = float(plain(file["measures"], "first_impact_tau"))
            self.stop = float(file["scene/stop"].attrs["position"])
            node = plain(group, "x")
            self.x = plot_scene.within_elements(node)
            self.displacement = plot_scene.cubics(node, self.x, plain(group, "displacement"), plain(group, "slope"))
            self.velocity = plot_scene.cubics(node, self.x, plain(group, "velocity"), plain(group, "slope_velocity"))
            listed = file["scene/output"].attrs["shape_times"]
            self.listed = [int(numpy.argmin(abs(self.tau - instant))) for instant in numpy.atleast_1d(listed)]


def draw_shapes(shapes):
    """Displacement and velocity along the beam before, at and after the first impact (figure 11)."""
    before = [int(numpy.argmin(abs(shapes.tau - tau))) for tau in (0.0, 0.4, 0.8, 1.2)]
    at = [index for index in shapes.listed if abs(shapes.tau[index] - shapes.impact) < 0.01]
    after = [index for index in shapes.listed if index not in at]
    columns = [("before the impact", before + at[:1]), ("at and after the impact", at + after)]
    figure, grid = plt.subplots(2, 2, sharex=True, figsize=(plots.WIDTH, 5.2), gridspec_kw={"hspace": 0.07, "wspace": 0.09})
    for column, (heading, indices) in enumerate(columns):
        for row, values in enumerate((shapes.displacement, shapes.velocity)):
            axes = grid[row, column]
            axes.axhline(0.0, color="black", linewidth=0.5, zorder=1)
            for number, index in enumerate(indices):
                shade = number / max(len(indices) - 1, 1)
                axes.plot(shapes.x, values[index], color=plt.get_cmap("cividis")(0.85 * shade), linewidth=1.0,
                          linestyle=plots.DASHES[number % 5], label=rf"$\tau = {shapes.tau[index]:.4g}$")
            axes.plot([shapes.stop], [0.0], marker=6, markersize=6, color="black", clip_on=False, zorder=4)
            if column == 1:
                axes.yaxis.tick_right()
                axes.yaxis.set_ticks_position("both")
                axes.tick_params(axis="y", which="both", labelleft=False, labelright=True)
            low, high = axes.get_ylim()
            axes.set_ylim(low, high + (0.42 if column == 1 and row == 0 else 0.0) * (high - low))
            set_ticks(axes.yaxis, 6)
        grid[0, column].set_title(heading)
        grid[0, column].legend(fontsize=7.5, loc="upper left", ncol=1 + (len(indices) > 5), columnspacing=1.0,
                               labelspacing=0.3)
        grid[1, column].set_xlabel(r"$x/L$")
        grid[1, column].set_xlim(0.0, 1.0)
        grid[1, column].xaxis.set_major_formatter(ticker.FormatStrFormatter("%g"))
    grid[0, 0].set_ylabel(r"displacement $\eta$")
    grid[1, 0].set_ylabel(r"velocity $\mathrm{d}\eta/\mathrm{d}\tau$")
    return figure


class Verdicts:
    """The statements of one file, the condition on each by way of computing."""

    def __init__(self, path):
        with plots.open_results(path) as file:
            group = file["statements"]
            self.title = plots.title_of(file)
            self.ways = plots.texts_of(group["way_name"])
            self.labels = plots.texts_of(group["label"])
            self.texts = [plots.as_it_is(text) for text in plots.texts_of(group["text"])]
            self.verdicts = [plots.as_it_is(verdict) for verdict in plots.texts_of(group["verdict"])]
            self.holds = [group[f"holds_{number + 1}"][()] for number in range(len(self.ways))]
            self.definitions = [group[f"definitions_{number + 1}"][()] for number in range(len(self.ways))]
            self.has_end = group["has_end"][()]
            self.definition_count = int(group["has_end"].attrs["definitions_of_the_end"])


def draw_verdicts(verdicts):
    """A square for each statement and way: filled where it holds; with the definitions of the end that affirm."""
    rows = len(verdicts.labels)
    figure, axes = plt.subplots(figsize=(plots.WIDTH * 1.45, 0.235 * rows + 1.3))
    for row in range(rows):
        for way in range(len(verdicts.ways)):
            holds = bool(verdicts.holds[way][row])
            axes.add_patch(patches.Rectangle((way - 0.42, row - 0.38), 0.84, 0.76, edgecolor="#555555", linewidth=0.5,
                                             facecolor="#1f5fa8" if holds else "white"))
            if verdicts.has_end[row]:
                axes.text(way, row, f"{verdicts.definitions[way][row]}/{verdicts.definition_count}", ha="center",
                          va="center_baseline", fontsize=6.5, color="white" if holds else "black")
        axes.text(-0.75, row, f"{verdicts.labels[row]}  {clipped(verdicts.texts[row], 84)}", ha="right",
                  va="center_baseline", fontsize=9)
        axes.text(len(verdicts.ways) - 0.35, row, clipped(verdicts.verdicts[row].split(" (")[0], 76), ha="left",
                  va="center_baseline", fontsize=9)
    for way, name in enumerate(verdicts.ways):
        axes.text(way - 0.1, -0.75, name, rotation=50, ha="left", va="bottom", fontsize=8)
    axes.set(xlim=(-0.5, len(verdicts.ways) - 0.5), ylim=(rows - 0.4, -0.6))
    axes.set_axis_off()
    axes.text(-0.75, rows + 0.25, "filled: holds; numbers: number of definitions of the end of the motion", ha="right",
              va="center", fontsize=7.5, style="italic")
    figure.subplots_adjust(left=0.56, right=0.8)
    return figure


def clipped(text, length):
    """A text of at most this length."""
    return text if len(text) <= length else text[:length - 1].rsplit(" ", 1)[0] + " \u2026"


def draw_sheet(pictures):
    """All pictures on one page, each made small once; a wide one, such as that of the statements, has a row of its own."""
    columns, width, gap, heading = 4, 640, 40, 60
    images, wide = [], []
    for picture in pictures:
        with Image.open(picture) as image:
            is_wide = image.width > 1.5 * plots.DOTS * plots.WIDTH
            shown = min(image.width, columns * (width + gap) - gap) if is_wide else width
            small = image.convert("RGB").resize((shown, round(shown * image.height / image.width)), Image.Resampling.LANCZOS,
                                                reducing_gap=3.0)
        (wide if is_wide else images).append((picture, small))
    rows = [images[first:first + columns] for first in range(0, len(images), columns)] + [[image] for image in wide]
    heights = [heading + max(image.height for _, image in row) for row in rows]
    size = columns * (width + gap) + gap, sum(heights) + gap
    figure = plt.figure(figsize=(size[0] / plots.DOTS, size[1] / plots.DOTS), dpi=plots.DOTS)
    top = size[1]
    for row, height in zip(rows, heights):
        left = gap
        for picture, image in row:
            figure.figimage(numpy.asarray(image), left, top - heading - image.height)
            figure.text((left + image.width / 2) / size[0], (top - heading + 12) / size[1], plots.as_it_is(picture.stem),
                        ha="center", fontsize=9)
            left += image.width + gap
        top -= height
    return figure


def draw_file(path, folder, pictures, films):
    """The picture of one file, and its film; the cases of the file, if it has some."""
    with plots.open_results(path) as file:
        kinds = set(file)
        # every single run has the shape at the start, which is no film and none of the paper's figures
        has_motion = "shapes" in kinds and len(plain(file["shapes"], "tau")) > 1
        # before, at and after the first impact of the paper's stop; else the scene itself
        has_listed_shapes = "surfaces" not in kinds and "measures" in file and plots.has(file["measures"], "first_impact_tau") and "scene/output" in file and \
            len(numpy.atleast_1d(file["scene/output"].attrs["shape_times"])) > 0
    picture = folder / f"{path.stem}.png"
    if "cases" in kinds:
        cases = Cases(path)
        plots.save(draw_cases(cases), picture)
        pictures.append(picture)
        return cases
    if has_motion:
        scene = plot_scene.Scene(path)
        plots.save(draw_shapes(Shapes(path)) if has_listed_shapes else plot_scene.draw(scene), picture)
        pictures.append(picture)
        if films:
            plot_scene.animate(scene, picture.with_suffix(".gif"))
    elif "statements" in kinds:
        plots.save(draw_verdicts(Verdicts(path)), picture)
        pictures.append(picture)
    elif "frequencies" in kinds and "response" not in kinds:
        plots.save(plot_frequencies.draw(path), picture)
        pictures.append(picture)
    return None


def main():
    """Read the command line, draw, write."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE.h5", help="results files; those with other contents are left out")
    parser.add_argument("--out", type=Path, default=Path("results/paper"), metavar="FOLDER",
                        help="folder of the pictures (default: results/paper)")
    parser.add_argument("--no-film", action="store_true", help="no animation")
    arguments = parser.parse_args()

    pictures = []
    cases = []
    for path in sorted(arguments.files, key=lambda path: path.stem):
        found = draw_file(path, arguments.out, pictures, not arguments.no_film)
        if found:
            cases.append(found)
    if not pictures:
        raise plots.Unplottable("none of the files holds cases (&cases), shapes over time (&output shape_step) or frequencies (&frequencies)")
    if len(cases) > 1:
        peaks = arguments.out / f"{PEAKS}.png"
        plots.save(draw_peaks([found for found in cases if found.parameter != "stiffness_ratio"] or cases), peaks)
        pictures.append(peaks)
    plots.save(draw_sheet(sorted(pictures)), arguments.out / "contact_sheet.png", bbox_inches=None)


if __name__ == "__main__":
    plots.run(main)
