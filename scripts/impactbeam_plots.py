"""What the plotting scripts share: opening results files, the style of the pictures, saving them."""

import contextlib
import importlib.util
import os
import re
import sys
import textwrap
import warnings
from pathlib import Path

# What the scripts need, by its package of Debian. They import this module before any of it.
PACKAGES = {"h5py": "python3-h5py", "matplotlib": "python3-matplotlib", "numpy": "python3-numpy", "PIL": "python3-pil"}

try:
    import h5py
    import matplotlib
    import numpy
    import PIL
except ImportError as error:
    MISSING = [package for name, package in PACKAGES.items() if importlib.util.find_spec(name) is None]
    sys.exit(f"{Path(sys.argv[0]).name}: {' '.join(str(error).split())}; on Debian: apt-get install "
             + " ".join(MISSING or PACKAGES.values()))

matplotlib.use("Agg")

import matplotlib.font_manager as font_manager
import matplotlib.pyplot as plt
import matplotlib.ticker as ticker

# Dark enough and different enough in grey too; the dashes tell the curves apart where colours cannot.
COLOURS = ["#000000", "#b5431c", "#1f5fa8", "#7a9a2f", "#7b4a8f", "#8a8a8a"]
DASHES = ["-", (0, (5, 1.6)), (0, (1.2, 1.2)), (0, (6, 1.5, 1.2, 1.5)), (0, (9, 2)), "-"]
MARKERS = ["o", "s", "^", "D", "v", "P"]
CONTACT = "#d4d4d4"
# A history with more turns than these is drawn as its range in so many parts of the time; a black one is grey then, so that
# lines before it are seen.
MOST_TURNS, ENVELOPE_PARTS = 300, 500
RANGE = {"black": "#9aa5b4"}
WIDTH = 6.3
DOTS = 220
NO_DATE = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
ENDINGS = (".png", ".pdf", ".svg")

STYLE = {
    # The first that has a character draws it.
    "font.family": ["STIXGeneral", "DejaVu Serif", "DejaVu Sans"],
    "mathtext.fontset": "stix",
    "font.size": 10,
    "axes.labelsize": 10.5,
    "axes.titlesize": 10.5,
    "axes.titlelocation": "left",
    "axes.linewidth": 0.7,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "xtick.minor.visible": True,
    "ytick.minor.visible": True,
    "lines.linewidth": 1.0,
    "legend.fontsize": 9,
    "legend.frameon": False,
    "legend.handlelength": 2.6,
    "savefig.dpi": DOTS,
    # Text as paths, because other fonts than those of this machine make labels overlap; each stands in a comment of the file.
    # The same picture gives the same file.
    "svg.fonttype": "path",
    "svg.hashsalt": "impactbeam",
}


def line_of(number):
    """Colour and dashes of a curve; those of the seventh differ from those of the first."""
    return {"color": COLOURS[number % len(COLOURS)], "linestyle": DASHES[(number + number // len(COLOURS)) % len(DASHES)]}


class Unplottable(Exception):
    """A file that holds nothing to plot, with the reason."""


OPENED = []


def open_results(path):
    """The open results file; the reason if it is none."""
    if not path.is_file():
        raise Unplottable(f"{path}: " + ("is a folder, no results file" if path.is_dir() else "no such file"))
    OPENED.append(path)
    try:
        return h5py.File(path, "r")
    except OSError:
        raise Unplottable(f"{path}: cannot be read as an HDF5 file") from None


# Each picture, and what a file must hold for it: all of one of these
DATA = {
    "accuracy": ["frequencies/lambda_exact"],
    "bifurcation": ["sweep/section_displacement_tip"],
    "fit": ["fit"],
    "frequencies": ["frequencies"],
    "orbits": ["orbit/branch_1"],
    "paper": ["cases", "statements"],
    "precision": ["precision"],
    "response": [f"response/{name}" for name in ("eta_stop", "eta_tip", "displacement_stop", "displacement_tip", "velocity_stop",
                                                 "contact_force")] + ["stress/moment"],
    "scene": ["mesh scene/stop", "mesh bodies"],
    "sensitivity": ["sensitivity"],
    "spectrum": ["spectrum/omega", "spectrum/frequency", "sweep_spectrum", "cases/case_1/spectrum", "frequency_response"],
    "statistics": ["statistics/surface_1"],
    "sweep": ["sweep"],
    "uncertainty": ["uncertainty"],
}


def missing(file, reason):
    """What a file has no data for, with the pictures that it has data for."""
    there = [kind for kind, choices in DATA.items() if any(all(name in file for name in choice.split()) for choice in choices)]
    return Unplottable(f"{file.filename}: {reason}" + (f"; it has data for impactbeam-plot {', '.join(there)}" if there else ""))


def group_of(file, name, request):
    """A group of the file; if it is not there, what the scene would have had to ask for."""
    if name not in file:
        whole = file.file
        if ("cases" in file or "sweep" in file) and request.lstrip("&") in file.get("scene", ()):
            raise missing(whole, f"holds several cases: there is a picture of {request} for a single run")
        foreign = "" if "scene" in whole else " (no results file of impactbeam?)"
        raise missing(whole, f"has no /{name}: its scene has no {request}{foreign}")
    return file[name]


def cases_that_ran(group):
    """The numbers of the cases of &cases that did not fail."""
    numbers = range(1, len(group[text_of(group.attrs["parameter"])]) + 1)
    return [number for number in numbers if "failure_reason" not in group[f"case_{number}"].attrs]


def text_of(value):
    """A text of the file."""
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)


def texts_of(dataset):
    """A list of texts of the file, without the blanks at their ends."""
    return [text_of(value).strip() for value in dataset[()]]


def as_it_is(text):
    """A text that matplotlib draws letter by letter: a dollar sign would begin a formula."""
    return text.replace("$", r"\$")


def words_of(name):
    """A name of results files in the words of the program's tables."""
    words = {"rms": "RMS", "greatest": "maximum", "least": "minimum"}
    return " ".join(words.get(word, word) for word in name.split("_"))


# What a file in units calls what is tau, eta and omega in others.
NAMES_IN_UNITS = {"tau": "time", "eta": "displacement", "omega": "frequency"}
# Prefixes with which a unit is read; an empty one: as it is.
PREFIXES = {"G": 1e9, "M": 1e6, "k": 1e3, "": 1.0, "m": 1e-3, "\u00b5": 1e-6, "n": 1e-9, "p": 1e-12, "f": 1e-15}
SMALL = ["", "m", "\u00b5", "n", "p"]
READ_WITH = {"s": SMALL, "m": SMALL, "g": ["k", *SMALL], "N": ["G", "M", "k", *SMALL, "f"], "J": ["k", *SMALL, "f"],
             "W": ["k", *SMALL, "f"], "Pa": ["M"], "Hz": ["M", "k", ""]}
# Signals of spectra, in two lines if they are long.
SPECTRA = {"displacement_tip": "displacement\nof the tip", "displacement_stop": "displacement\nat the stop",
           "velocity_tip": "velocity\nof the tip", "velocity_stop": "velocity\nat the stop",
           "acceleration_tip": "acceleration\nof the tip", "acceleration_stop": "acceleration\nat the stop",
           "contact_force": "contact force", "moment": "bending moment",
           "displacement_body": "displacement\nof the body", "velocity_body": "velocity\nof the body",
           "acceleration_body": "acceleration\nof the body", "force_body": "contact force\non the body"}
# Signals of fits
SIGNALS = {**SPECTRA, "impact_times": "instant\nof the impact", "rebound_peaks": "peak\nof the rebound"}
OF_SCENE = "scene"


def named(group, name):
    """The name that a dataset has in a file with or without units, given that without."""
    return name if name in group else "_".join(NAMES_IN_UNITS.get(word, word) for word in name.split("_"))


def has(group, name):
    """Is there a dataset, by its name without units?"""
    return named(group, name) in group


def values_of(group, name, wanted="file"):
    """The numbers of a dataset, given by its name without units, as the file has them, in units or dimensionless."""
    dataset = group[named(group, name)]
    factor = dataset.attrs.get("in_scene_units")
    is_in_units = "units" in group.file.attrs
    if wanted == "file" or is_in_units == (wanted == "scene"):
        return dataset[()]
    if factor is None:
        if text_of(dataset.attrs["units"]) == "1" and is_in_units:
            return dataset[()]
        raise Unplottable(f"{group.file.filename}: units of {dataset.name} are not known: the scene gives only ratios")
    return dataset[()] * factor if wanted == "scene" else dataset[()] / factor


def unit_of(group, name, wanted="file"):
    """The unit of these numbers; nothing where they are dimensionless, OF_SCENE where the scene does not say."""
    attributes = group[named(group, name)].attrs
    is_in_units = "units" in group.file.attrs
    if wanted == "dimensionless" or (wanted == "file" and not is_in_units):
        return ""
    unit = text_of(attributes["units"] if is_in_units else attributes.get("scene_units", OF_SCENE))
    if unit == "1":
        return ""
    return OF_SCENE if is_in_units and text_of(group.file.attrs["units"]) == OF_SCENE else unit


def reading(greatest, unit):
    """The factor and the unit with which numbers up to a size are read: ms, mm, \u00b5m, MPa."""
    head, tail = re.match(r"([^ /^]*)(.*)", unit).groups()
    head, factor = ("g", 1e6) if head == "t" else (head, 1.0)
    if head not in READ_WITH and head[:1] in PREFIXES and head[1:] in READ_WITH:
        head, factor = head[1:], PREFIXES[head[:1]]
    if head not in READ_WITH or not greatest > 0.0:
        return 1.0, unit
    for prefix in READ_WITH[head]:
        found = factor / PREFIXES[prefix], prefix + head + tail
        if greatest * found[0] >= (0.1 if PREFIXES[prefix] <= 1.0 else 10.0 if head == "Hz" else 1.0):
            break
    return found


def reading_of(values, unit):
    """The same of numbers in any unit: where they stay far from 1 to 1000, a power of ten stands before the unit."""
    size = float(numpy.max(numpy.abs(values)))
    factor, unit = reading(size, "" if unit == "1" else unit)
    power = 0 if 0.01 <= size * factor < 1e6 or size == 0.0 else 3 * int(numpy.floor(numpy.log10(size * factor) / 3.0))
    return factor / 10.0**power, " ".join(filter(None, [f"$10^{{{power}}}$" if power else "", unit]))


def with_unit(words, unit):
    """The label of an axis."""
    return words if unit in ("", OF_SCENE) else f"{words} ({unit.replace(' ', chr(0xa0))})"


def take_fonts_for(text):
    """Let other fonts of the machine draw what those of the style lack. A line names those that none has."""
    lacking = {ord(letter) for letter in text if not letter.isspace()}
    known = [font.fname for font in font_manager.fontManager.ttflist]
    style = [font_manager.findfont(font_manager.FontProperties(family=[name])) for name in plt.rcParams["font.family"]]
    for path in [*style, *known, *font_manager.findSystemFonts()]:
        if not lacking:
            return
        try:
            font = font_manager.get_font(path)
        except (OSError, RuntimeError):
            continue
        # it has every character, drawn as a box
        if font.family_name.startswith("Last Resort"):
            continue
        if lacking & font.get_charmap().keys() and font.family_name not in plt.rcParams["font.family"]:
            if path not in known:
                font_manager.fontManager.addfont(path)
            plt.rcParams["font.family"] = [*plt.rcParams["font.family"], font.family_name]
        lacking -= font.get_charmap().keys()
    warnings.filterwarnings("ignore", "Glyph .* missing from")
    print(f"{Path(sys.argv[0]).name}: characters of the title are not drawn, as no font of this machine has them: "
          + "".join(map(chr, sorted(lacking))), file=sys.stderr)


def title_of(file):
    """The heading of a scene, in lines that a picture has room for."""
    title = text_of(file.attrs.get("title", "")) or Path(file.filename).stem
    take_fonts_for(title)
    return textwrap.fill(as_it_is(title), 84)


def legend_of_titles(axes, handles, titles, **options):
    """A legend of curves; matplotlib would leave out titles that begin with an underscore."""
    legend = axes.legend(handles, [str(number) for number in range(len(titles))], **options)
    for shown, title in zip(legend.get_texts(), titles):
        shown.set_text(title)


def stops_of(scene):
    """Position, side and preload of each stop, in their order, and the index of the one from which the beam is released. It is chosen
    as the program does."""
    names = sorted((name for name in scene if name.split("_")[0] == "stop"), key=lambda name: int(name.partition("_")[2] or 1))
    groups = [scene[name].attrs for name in names]
    stops = [(float(group["position"]), text_of(group["side"]),
              -float(group["clearance_ratio"]) if "clearance_ratio" in group else float(group["preload"])) for group in groups]
    keys = [("pulled" not in group, -position, ("below", "above", "both").index(side), -preload)
            for group, (position, side, preload) in zip(groups, stops)]
    return stops, min(range(len(stops)), key=keys.__getitem__, default=None)


def surface_of_release(scene):
    """Index of the surface of this stop, the lower one of a stop on both sides, in the order of /surfaces."""
    stops, release = stops_of(scene)
    return sum(2 if side == "both" else 1 for _, side, _ in stops[:release or 0])


def height_of_release(file, wanted="file"):
    """Height above the unstressed beam from which the displacements of shapes count: that of this surface; 0 without a stop."""
    scene = file["scene"]
    if "stop" not in scene:
        return 0.0
    if "surfaces" in file:
        return values_of(file["surfaces"], "height", wanted)[surface_of_release(scene)]
    is_in_units = "units" in file.attrs and wanted != "dimensionless"
    return float(scene["stop"].attrs["preload"]) * (float(scene["scales"].attrs["displacement"]) if is_in_units else 1.0)


def varied_with(file, name):
    """Parameters of a sweep that vary together with one, value by value, because they are tied or their lists are paired."""
    sweep = file["sweep"].attrs
    together = sweep["parameters"] if text_of(sweep["design"]) == "paired" else file["scene/sweep"].attrs.get("tied", "")
    together = [other.strip() for other in text_of(together).split(",")]
    return [other for other in together if other != name] if name in together else []


def numbered_if_repeated(values):
    """The values of an axis; their numbers 1, 2, ... if a value stands there twice, so that each has a place of its own."""
    return values if len(numpy.unique(values)) == len(values) else numpy.arange(1.0, len(values) + 1.0)


def set_ticks_together(panel, axis, columns, places=None):
    """Ticks at values of the first of several columns that vary together, or at other places of them, each with the values of
    all; one column alone keeps its ticks, unless it has other places."""
    is_placed = places is not None and not numpy.array_equal(places, columns[0])
    if len(columns) < 2 and not is_placed:
        return
    places, cases = numpy.unique(places if is_placed else columns[0], return_index=True)
    chosen = numpy.unique(numpy.linspace(0, len(cases) - 1, min(len(cases), 8)).round().astype(int))
    # labels have room only at some distance from each other
    scaled = numpy.log(places) if getattr(panel, f"get_{axis}scale")() == "log" else places
    kept = []
    for place in chosen:
        if not kept or scaled[place] - scaled[kept[-1]] >= 0.08 * (scaled[-1] - scaled[0]):
            kept.append(place)
    chosen = numpy.array(kept)
    labels = [("\n" if axis == "x" else ", ").join(f"{column[case]:.4g}" for column in columns) for case in cases[chosen]]
    getattr(panel, f"set_{axis}ticks")(places[chosen], labels)
    getattr(panel, f"set_{axis}ticks")([], minor=True)


def set_decades(axis):
    """Plain numbers at a logarithmic axis of few decades, of less than two also at 2 and 5."""
    low, high = axis.get_view_interval()
    if high < min(1e4 * low, 1e8):
        axis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:.10g}"))
        axis.set_minor_formatter(ticker.FuncFormatter(
            lambda value, _: f"{value:.10g}" if high < 100.0 * low and f"{value:e}"[0] in "25" else ""))


def time_of(words, unit):
    """A time of the command line, such as 0.02 or 20ms, in the unit of a file; a number alone has that unit already."""
    found = re.fullmatch(r"([-+.\deE]+)([m\u00b5unp]?)(s?)", words)
    try:
        if found is None or (found[3] and unit != "s") or (found[2] and not found[3]):
            raise ValueError
        return float(found[1]) * PREFIXES[found[2].replace("u", "\u00b5")]
    except ValueError:
        raise Unplottable(f"{words}: must be a time such as 0.02" + (" (s) or 20ms" if unit == "s" else "")) from None


def draw_history(axes, time, values, label="", **options):
    """A history as a curve; one that turns too often to be read, as its range in each of many parts of the time."""
    steps = numpy.diff(values)
    steps = steps[abs(steps) > 1e-5 * numpy.ptp(values)]
    if numpy.count_nonzero(steps[1:] * steps[:-1] < 0.0) <= MOST_TURNS:
        return axes.plot(time, values, label=label, **options)
    edges = numpy.linspace(0, len(values) - 1, ENVELOPE_PARTS + 1).astype(int)
    # each part holds the first sample of the next, so that neighbours meet
    parts = [values[first:last + 1] for first, last in zip(edges, edges[1:])]
    return [axes.fill_between(0.5 * (time[edges[1:]] + time[edges[:-1]]), [part.min() for part in parts],
                              [part.max() for part in parts], label=f"{label}, range".lstrip(", "), zorder=0.8,
                              color=RANGE.get(options.get("color"), options.get("color")), linewidth=0.3)]


def beside(path, kind):
    """The picture of a kind beside a results file; only that of the response has the name of the file alone."""
    return path.with_name(f"{path.stem}_{kind}.png")


def round_number(value):
    """A number as it reads in a text."""
    return f"{value:.4g}".replace("-", "\u2212")


def quantity(value, unit):
    """A value with its unit."""
    return round_number(value) + ("" if unit in ("", OF_SCENE) else f"\u00a0{unit}")


class Along:
    """Positions along the beam, given over its length, as they are read: $x$ in units, $x/L$ where lengths have no unit."""

    def __init__(self, file, unit):
        factor, self.unit = reading(float(file["scene/scales"].attrs["length"]), unit)
        self.length = factor * float(file["scene/scales"].attrs["length"]) if unit else 1.0

    def label(self):
        """Of an axis."""
        return with_unit("$x$", self.unit) if self.unit else "$x/L$"

    def place(self, position):
        """A position in words."""
        return f"$x$ = {quantity(position * self.length, self.unit)}" if self.unit else f"$x/L$ = {position:g}"


WRITTEN = set()


@contextlib.contextmanager
def complete_file(path):
    """A path beside that of a file, for writing: the file gets its name when it is complete. No file is written twice."""
    if path in WRITTEN:
        raise Unplottable(f"{path} is there from another file of this command already: give one file")
    WRITTEN.add(path)
    partial = path.with_name(f".{path.stem}.part-{os.getpid()}{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield partial
        partial.replace(path)
    except (OSError, ValueError) as error:
        raise Unplottable(f"cannot write {path}: {getattr(error, 'strerror', None) or error}") from None
    finally:
        with contextlib.suppress(OSError):
            partial.unlink()
    print(path)


def save(figure, path, bbox_inches="tight"):
    """Write the picture, by default without blank edges, and say where it is."""
    if path.suffix not in ENDINGS:
        raise Unplottable(f"--out {path}: a picture ends in {', '.join(ENDINGS)}" + (
            "; plot_scene --film makes a .gif" if path.suffix == ".gif" else ""))
    with complete_file(path) as partial:
        figure.savefig(partial, bbox_inches=bbox_inches, metadata=NO_DATE.get(path.suffix))
    plt.close(figure)


def run(main):
    """Run a script's main program; what cannot be plotted ends it with one line and status 2, as bad input does."""
    try:
        with matplotlib.rc_context(STYLE):
            main()
        return
    except Unplottable as reason:
        problem = str(reason)
    except Exception as error:
        files = ", ".join(dict.fromkeys(map(str, OPENED)))
        cause = str(error).strip("\"'") or type(error).__name__
        problem = f"{files}: cannot be drawn: damaged, or no results file of impactbeam ({cause})" if files else cause
    print(f"{Path(sys.argv[0]).name}: {' '.join(problem.split())}", file=sys.stderr)
    sys.exit(2)
