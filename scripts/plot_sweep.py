#!/usr/bin/python3
"""Plot a sweep: the map of one measure over two parameters, curves over one, or all parameters side by side (parallel
coordinates), with the best case if the scene has &best. A grid over more than two parameters is cut at the values of
the others in the best case, or, without &best of this measure, in the case with its minimum. Reads a results file of a
scene with &sweep; computes nothing."""

import argparse
import textwrap
from pathlib import Path

import impactbeam_plots as plots
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LogNorm, Normalize
from matplotlib.ticker import FuncFormatter


SYMBOLS = {
    "elements": "elements $n$",
    "mesh_ratio": "ratio of elements",
    "taper": r"taper $\alpha$",
    "tip_mass_ratio": r"tip mass $\mu$",
    "position": r"position of the stop $L_c/L$",
    "duration": r"duration $\tau$",
    "hop_tolerance": "hop tolerance",
    "zeta": r"damping $\zeta$",
    "preload": r"preload $\delta$",
    "restitution": r"restitution $\varepsilon$",
    "stiffness_ratio": r"stiffness of the stop $\kappa$",
    "branch_ratio": r"second spring $\beta$",
    "damper_ratio": r"damper $c^*$",
}
MEASURES = {
    "settling_time": r"settling time $\tau$",
    "spent_time": r"time at which 1 % of the energy is left $\tau$",
    "greatest_force": r"maximum contact force $\bar P$",
    "first_impact_time": r"first impact $\tau$",
    "total_contact": r"time in contact $\tau$",
    "longest_contact": r"longest contact $\tau$",
    "peak_1": r"first rebound $\eta$",
}
COLOURS = "viridis_r"
BEST = "#c81e1e"
MOST_LINES = 3000


def most_common(group, known):
    """The first measure of MEASURES that at least half of the cases have; if none is that common, the most common one."""
    counts = {name: min(np.isfinite(group[name][:].astype(float)).sum(), len(group["status"])/2) for name in MEASURES if name in known}
    return max(counts, key=counts.get)


class Sweep:
    """Parameters, measure and best cases of one file."""

    def __init__(self, path, measure):
        with plots.open_results(path) as file:
            group = plots.group_of(file, "sweep", "&sweep")
            self.title = plots.title_of(file)
            # Parameters that are tied to others have no axis of their own.
            names = group.attrs["grid_parameters" if "grid_parameters" in group.attrs else "parameters"]
            self.names = [name.strip() for name in plots.text_of(names).split(",")]
            parameters = [name.strip() for name in plots.text_of(group.attrs["parameters"]).split(",")]
            self.partners = {name: plots.varied_with(file, name) for name in parameters}
            self.is_in_units = "units" in file.attrs
            best = file.get("best")
            known = [name.strip() for name in plots.text_of(group.attrs["measures"]).split(",")]
            chosen = plots.text_of(best.attrs["measure"]) if best else most_common(group, known)
            self.measure = plots.named(group, measure or chosen)
            if self.measure not in known:
                raise plots.Unplottable(f"{path}: no measure {self.measure}; there are {', '.join(known)}")
            shown = [*parameters, self.measure]
            self.units, factors = {}, {}
            for name in shown:
                factors[name], self.units[name] = plots.reading(
                    np.nanmax(abs(group[name][:].astype(float)), initial=0.0), plots.unit_of(group, name))
            self.is_paired = plots.text_of(group.attrs["design"]) == "paired"
            grid = file.get("grid", group.get("axes"))
            self.axes = {name: factors[name] * grid[name][:] for name in self.names} if grid else None
            self.values = {name: factors[name] * group[name][:] for name in parameters}
            self.column = factors[self.measure] * group[self.measure][:].astype(float)
            self.failed = group["status"][:] > 0
            self.column[self.failed] = np.nan
            if not np.isfinite(self.column).any():
                others = ", ".join(name for name in known if np.isfinite(group[name][:].astype(float)).any()) or "no measure, as none has values"
                raise plots.Unplottable(f"{path}: {self.measure} has no value in any case; --measure takes another of {others}")
            spacings = plots.text_of(group.attrs["spacings"]).split(",")
            self.logarithmic = {name: spacing.strip() == "logarithmic" for name, spacing in zip(parameters, spacings)}
            cases = self.put_in_order()
            # places of the cases along each axis; those along an axis that has a value twice are numbers
            self.places, self.case_places = {}, dict(self.values)
            for k, name in enumerate(self.names if self.axes is not None else []):
                self.places[name] = plots.numbered_if_repeated(self.axes[name])
                rows = np.indices([len(self.axes[other]) for other in self.names])[k].ravel()
                self.case_places[name] = self.places[name][rows]
            # the first of these is the best case of the sweep, the last the best of all
            self.path = None
            self.best = None
            self.cut_case = int(np.nanargmin(self.column))
            if best and chosen == self.measure and len(best["case"]):
                self.best = int(np.flatnonzero(cases == best["case"][0] - 1)[0])
                source = best["refinement"] if "refinement" in best else None
                self.cut_case = self.best
                if source is not None:
                    self.path = {name: factors[name] * source[name][:] for name in shown}

    def put_in_order(self):
        """Put the values of each axis of a grid, and the cases, in ascending order, because the lists of a scene have any order
        and cells and curves join neighbours. Return the former places of the cases."""
        cases = np.arange(len(self.column))
        if self.axes is not None:
            orders = [np.argsort(self.axes[name], kind="stable") for name in self.names]
            cases = cases.reshape([len(order) for order in orders])[np.ix_(*orders)].ravel()
            self.axes = {name: self.axes[name][order] for name, order in zip(self.names, orders)}
        self.values = {name: values[cases] for name, values in self.values.items()}
        self.column, self.failed = self.column[cases], self.failed[cases]
        return cases

    def is_numbered(self, name):
        """Whether the places of an axis are numbers instead of the values."""
        return name in self.places and self.places[name] is not self.axes[name]

    def has_log_axis(self, name):
        """Whether the axis of a parameter is logarithmic."""
        return self.logarithmic[name] and not self.is_numbered(name)

    def path_on(self, *names):
        """The refinement along some axes, or nothing if one of them has no place for values in between."""
        return [self.path[name] if not any(map(self.is_numbered, names)) else [] for name in names]

    def set_ticks(self, panel, axis, name):
        """Ticks with the values of a parameter and of those that vary together with it."""
        plots.set_ticks_together(panel, axis, [self.values[each] for each in [name, *self.partners[name]]], self.case_places[name])

    def label_alone(self, name):
        """The name of a parameter on an axis."""
        return plots.with_unit(SYMBOLS.get(name, plots.words_of(name)), self.units[name])

    def label(self, name):
        """The same with the names of the parameters that vary together with it."""
        return "\n".join(map(self.label_alone, [name, *self.partners[name]]))

    def measure_label(self):
        """The name of the measure on an axis."""
        words = MEASURES.get(self.measure, plots.words_of(self.measure))
        return plots.with_unit(words.split(" $")[0] if self.is_in_units else words, self.units[self.measure])

    def case_in_words(self, words, source, index):
        """A case with the value of the measure and those of the parameters, with their units."""
        value = plots.quantity(source[self.measure][index], self.units[self.measure])
        given = [f"{self.short(name)} = {plots.quantity(source[name][index], self.units[name])}" for name in self.partners]
        # no line ends within a value
        given = ", ".join(text.replace(" ", "\u00a0") for text in given)
        return textwrap.fill(f"{words}: {value} at {given}", 64)

    def short(self, name):
        """The symbol of a parameter, or its name if it has none."""
        found = SYMBOLS.get(name, "").rsplit(" ", 1)[-1]
        return found if found.startswith("$") and not self.units[name] else plots.words_of(name)

    def best_in_words(self):
        """The best case of the sweep."""
        return self.case_in_words("best of the sweep", {**self.values, self.measure: self.column}, self.best)

    def cut(self, names, column=None):
        """The measure, or another column, over some axes of a grid, and the values at which the others are held."""
        shape = [len(self.axes[name]) for name in self.names]
        grid = (self.column if column is None else column).reshape(shape)
        place = np.unravel_index(self.cut_case, shape)
        index = tuple(slice(None) if name in names else place[k] for k, name in enumerate(self.names))
        held = {name: self.axes[name][place[k]] for k, name in enumerate(self.names) if name not in names}
        left = [name for name in self.names if name in names]
        return np.moveaxis(grid[index], [left.index(name) for name in names], range(len(names))), held


def colour_scale(values):
    """Colours for a measure: by its logarithm if it spans more than a decade."""
    finite = values[np.isfinite(values)]
    least, most = finite.min(), finite.max()
    if least > 0.0 and most > 10.0 * least:
        return LogNorm(least, most)
    return Normalize(least, most if most > least else least + 1.0)


def edges_of(values, logarithmic):
    """Edges of the cells around values, half way to their neighbours on a linear or a logarithmic axis."""
    places = np.log(values) if logarithmic else values
    middle = 0.5 * (places[1:] + places[:-1])
    edges = np.concatenate([[2.0 * places[0] - middle[0]], middle, [2.0 * places[-1] - middle[-1]]])
    return np.exp(edges) if logarithmic else edges


def set_plain_numbers(panel, axis):
    """Numbers without an offset at a linear axis, with enough digits that no two ticks are alike."""
    def words(value, _):
        low, high = getattr(panel, f"get_{axis}lim")()
        span = abs(high - low)
        digits = 6 if span == 0.0 else max(6, 2 + int(np.ceil(np.log10(max(abs(low), abs(high))/span))))
        return f"{value if abs(value) > 1e-9*span else 0.0:.{digits}g}"

    getattr(panel, f"{axis}axis").set_major_formatter(FuncFormatter(words))


def set_scale(panel, axis, logarithmic):
    """A linear or logarithmic axis, with plain numbers."""
    if not logarithmic:
        set_plain_numbers(panel, axis)
        return
    getattr(panel, f"set_{axis}scale")("log")
    plots.set_decades(getattr(panel, f"{axis}axis"))


def held_in_words(sweep, held):
    """Such as 'preload = 0.1, at the best case'."""
    if not held:
        return ""
    case = "best" if sweep.best is not None else "lowest"
    return ", ".join(f"{sweep.short(name)} = {plots.quantity(value, sweep.units[name])}" for name, value in held.items()) \
        + f" (as in the {case} case)"


def without_value_in_words(sweep, values, failed):
    """How many of the cases shown have no value of the measure, and how many of them failed."""
    left, failures = int((~np.isfinite(values)).sum()), int(failed.sum())
    words = f"{left} of {np.size(values)} cases have no {plots.words_of(sweep.measure)} within the run" if left else ""
    return words + (f", {failures} of them failed" if failures else "")


def draw_map(sweep, names):
    """One measure over two parameters."""
    across, up = names
    figure, panel = plt.subplots(figsize=(plots.WIDTH, 4.6), constrained_layout=True)
    norm = colour_scale(sweep.column)
    values, failed = sweep.column, sweep.failed
    if sweep.axes is not None:
        values, held = sweep.cut([up, across])
        failed = sweep.cut([up, across], sweep.failed)[0]
        x, y = sweep.places[across], sweep.places[up]
        if min(values.shape) < 2:
            raise plots.Unplottable("a map needs at least two values of each of its parameters")
        panel.set_facecolor("0.8")
        mesh = panel.pcolormesh(edges_of(x, sweep.has_log_axis(across)), edges_of(y, sweep.has_log_axis(up)),
                                np.ma.masked_invalid(values), cmap=COLOURS, norm=norm, rasterized=True)
    else:
        held = {name: 0.0 for name in sweep.names if name not in names}
        known = np.isfinite(sweep.column)
        x, y = sweep.values[across], sweep.values[up]
        panel.scatter(x[~known], y[~known], s=5, color="0.7", zorder=1)
        mesh = panel.scatter(x[known], y[known], s=9, c=sweep.column[known], cmap=COLOURS, norm=norm, zorder=2)
    if sweep.best is not None:
        panel.plot(sweep.case_places[across][sweep.best], sweep.case_places[up][sweep.best], "o", mfc="none", mec=BEST, mew=1.4, ms=8,
                   clip_on=False, zorder=5, label=sweep.best_in_words())
    if sweep.path is not None:
        x, y = sweep.path_on(across, up)
        panel.plot(x, y, "-", color=BEST, linewidth=0.8)
        panel.plot(x[-1:], y[-1:], "*", color=BEST, mec="white", mew=0.6, ms=14, clip_on=False, zorder=5,
                   label=sweep.case_in_words("refined", sweep.path, -1))
    never = ~np.isfinite(values) & ~failed
    words = " or ".join(text for text, cases in (("not reached in the run", never), ("failed", failed)) if cases.any())
    if words:
        panel.plot([], [], "s", color="0.75" if sweep.axes is None else "0.8", mec="0.5", mew=0.5, label=words)
    panel.set_xlabel(sweep.label(across))
    panel.set_ylabel(sweep.label(up))
    panel.margins(0.0 if sweep.axes is not None else 0.02)
    set_scale(panel, "x", sweep.has_log_axis(across))
    set_scale(panel, "y", sweep.has_log_axis(up))
    sweep.set_ticks(panel, "x", across)
    sweep.set_ticks(panel, "y", up)
    bar = figure.colorbar(mesh, ax=panel, pad=0.02, label=sweep.measure_label())
    if isinstance(norm, LogNorm):
        plots.set_decades(bar.ax.yaxis)
    else:
        set_plain_numbers(bar.ax, "y")
    figure.suptitle(sweep.title, fontsize=10.5, x=0.02, ha="left")
    if sweep.axes is not None and held:
        panel.set_title(held_in_words(sweep, held), fontsize=9)
    handles, labels = panel.get_legend_handles_labels()
    if handles:
        # below the axis, where each parameter that varies with that across has its own line of ticks and of labels
        panel.legend(handles, labels, loc="upper left", bbox_to_anchor=(-0.02, -0.14 - 0.09*len(sweep.partners[across])), ncols=1)
    return figure


def in_family(sweep, family, words, source, index):
    """A label for the best case: the value of the parameter that distinguishes the curves."""
    return sweep.case_in_words(words, source, index) if family is None else f"{source[family][index]:.3g} ({words})"


def draw_curves(sweep, name, family):
    """One measure over one parameter, a curve for some values of another."""
    figure, panel = plt.subplots(figsize=(plots.WIDTH, 3.8), constrained_layout=True)
    held, values, failed = {}, sweep.column, sweep.failed
    if sweep.axes is None:
        order = np.argsort(sweep.values[name])
        panel.plot(sweep.values[name][order], sweep.column[order], ".-" if sweep.is_paired else ".", color=plots.COLOURS[0],
                   markersize=5 if sweep.is_paired else 3, linewidth=0.6)
    elif family is None:
        values, held = sweep.cut([name])
        failed = sweep.cut([name], sweep.failed)[0]
        panel.plot(sweep.places[name], values, color=plots.COLOURS[0], marker=".", markersize=3)
    else:
        values, held = sweep.cut([family, name])
        failed = sweep.cut([family, name], sweep.failed)[0]
        chosen = np.unique(np.linspace(0, len(sweep.axes[family]) - 1, len(plots.COLOURS)).round().astype(int))
        values, failed = values[chosen], failed[chosen]
        for k, row in enumerate(chosen):
            # without a mark, a value between cases without one would not be seen
            known = np.isfinite(values[k])
            panel.plot(sweep.places[name], values[k], color=plots.COLOURS[k], linestyle=plots.DASHES[k],
                       marker="" if known.all() else ".", markersize=3,
                       label=f"{sweep.axes[family][row]:.3g}" + ("" if known.any() else " (no value)"))
    if sweep.best is not None and (sweep.axes is not None or sweep.is_paired):
        panel.plot(sweep.case_places[name][sweep.best], sweep.column[sweep.best], "o", mfc="none", mec=BEST, mew=1.4, ms=8,
                   label=in_family(sweep, family, "best", {**sweep.values, sweep.measure: sweep.column}, sweep.best))
    if sweep.path is not None:
        x, y = sweep.path_on(name)[0][-1:], sweep.path[sweep.measure][-1:]
        panel.plot(x, y[:len(x)], "*", color=BEST, mec="white", mew=0.5, ms=13,
                   clip_on=False, zorder=5, label=in_family(sweep, family, "refined", sweep.path, -1))
    if family is not None and sweep.axes is not None:
        panel.legend(title=sweep.label(family), loc="upper left", bbox_to_anchor=(1.01, 1.0))
    elif panel.get_legend_handles_labels()[0]:
        panel.legend(loc="lower left", bbox_to_anchor=(-0.008, 0.99), borderaxespad=0.0, fontsize=8)
    panel.set_xlabel(sweep.label(name))
    panel.set_ylabel(sweep.measure_label())
    set_scale(panel, "x", sweep.has_log_axis(name) and not sweep.is_paired)
    sweep.set_ticks(panel, "x", name)
    finite = sweep.column[np.isfinite(sweep.column)]
    set_scale(panel, "y", finite.size and finite.min() > 0.0 and finite.max() > 20.0 * finite.min())
    figure.suptitle(sweep.title, fontsize=10.5, x=0.02, ha="left")
    words = [text for text in (held_in_words(sweep, held), without_value_in_words(sweep, values, failed)) if text]
    if words:
        # above a legend that stands above the panel
        lines = sum(text.get_text().count("\n") + 1 for text in panel.get_legend().get_texts()) if panel.get_legend() and family is None else 0
        panel.set_title("\n".join(words), fontsize=9, pad=6 + 11.5*lines)
    return figure


def draw_parallel(sweep):
    """All parameters and the measure as upright axes, a line for each case; the better, the darker and the more in front."""
    columns = [*sweep.partners, sweep.measure]
    data = np.array([sweep.values[name] for name in sweep.partners] + [sweep.column])
    known = np.isfinite(sweep.column)
    norm = colour_scale(sweep.column)
    logarithmic = [sweep.logarithmic[name] for name in sweep.partners] + [isinstance(norm, LogNorm)]
    limits = [(row[known].min(), row[known].max()) for row in data]
    if sweep.path is not None:
        limits = [(min(low, sweep.path[name].min()), max(high, sweep.path[name].max())) for name, (low, high) in zip(columns, limits)]

    def height(k, value):
        low, high = limits[k]
        if high <= low:
            return np.full_like(np.asarray(value, dtype=float), 0.5)
        if logarithmic[k]:
            return np.log(np.asarray(value) / low) / np.log(high / low)
        return (np.asarray(value) - low) / (high - low)

    figure, panel = plt.subplots(figsize=(1.25 * plots.WIDTH, 4.4), constrained_layout=True)
    order = np.flatnonzero(known)
    order = order[np.argsort(-sweep.column[order])]
    if len(order) > MOST_LINES:
        # all of the best tenth, and every so many of the rest
        tenth = MOST_LINES // 10
        order = np.concatenate([order[: -tenth : max(1, len(order) // MOST_LINES)], order[-tenth:]])
    colours = plt.get_cmap(COLOURS)
    heights = np.array([height(k, data[k, order]) for k in range(len(columns))]).T
    places = np.arange(len(columns))
    share = np.linspace(0.0, 1.0, len(order))
    # few lines are seen alone, many only where they are dense
    faint = min(0.6, max(0.08, 20.0 / len(order)))
    for line, value, front in zip(heights, sweep.column[order], share):
        panel.plot(places, line, color=colours(norm(value)), linewidth=0.5, alpha=faint + (0.83 - faint) * front**12, zorder=1 + front)
    if sweep.best is not None:
        panel.plot(places, [height(k, data[k, sweep.best]) for k in range(len(columns))], color=BEST, linewidth=1.4,
                   linestyle=plots.DASHES[1], zorder=3, label=sweep.best_in_words())
    if sweep.path is not None:
        panel.plot(places, [height(k, sweep.path[name][-1]) for k, name in enumerate(columns)], color=BEST, linewidth=2.0,
                   marker="*", markersize=10, mec="white", mew=0.5, zorder=4, clip_on=False,
                   label=sweep.case_in_words("refined", sweep.path, -1))
    for k, (low, high) in enumerate(limits):
        panel.axvline(k, color="0.25", linewidth=0.8, zorder=2.5)
        for share_of_axis in (0.0, 0.25, 0.5, 0.75, 1.0):
            value = low * (high / low) ** share_of_axis if logarithmic[k] else low + (high - low) * share_of_axis
            if not logarithmic[k] and abs(value) < 1e-3 * (high - low):
                value = 0.0
            panel.annotate(f"{value:.3g}", (k, share_of_axis), xytext=(4, 0), textcoords="offset points", fontsize=7.5,
                           va="center", zorder=5, bbox={"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 0.6})
    names = [sweep.label_alone(name) for name in sweep.partners] + [sweep.measure_label()]
    panel.set_xticks(places, [name.replace(" $", "\n$", 1) for name in names])
    panel.tick_params(axis="both", which="both", length=0, left=False, labelleft=False)
    panel.set_ylim(-0.03, 1.03)
    panel.set_xlim(-0.1, len(columns) - 0.75)
    for side in panel.spines.values():
        side.set_visible(False)
    figure.suptitle(sweep.title, fontsize=10.5, x=0.02, ha="left")
    panel.set_title(without_value_in_words(sweep, sweep.column, sweep.failed), fontsize=9)
    if sweep.best is not None:
        panel.legend(loc="upper left", bbox_to_anchor=(0.0, -0.13), ncols=1, fontsize=8)
    return figure


def main():
    """Read the command line, draw, write the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path, help="results file, HDF5")
    parser.add_argument("--measure", help="column of /sweep; default: that of &best, or settling_time if half of the cases have it")
    parser.add_argument("--kind", choices=["map", "curves", "parallel"], help="default: by the number of parameters")
    parser.add_argument("--parameters", nargs="+", help="across and up (map), across and one a curve (curves)")
    parser.add_argument("--out", type=Path, help="picture; default: the file with the ending .png")
    arguments = parser.parse_args()

    sweep = Sweep(arguments.file, arguments.measure)
    varied = [name for name in sweep.names if np.ptp(sweep.case_places[name]) > 0.0] or sweep.names
    count = len(arguments.parameters or varied)
    kind = arguments.kind or ("curves" if sweep.is_paired else {1: "curves", 2: "map"}.get(count, "parallel"))
    names = arguments.parameters or (varied if sweep.is_paired else varied[::-1])
    for name in names:
        if name not in sweep.names:
            raise plots.Unplottable(f"{arguments.file}: {name} is not swept; swept are {', '.join(sweep.names)}")
        if names.count(name) > 1:
            raise plots.Unplottable(f"--parameters: {name} is given twice")
    if kind == "map":
        if len(names) < 2:
            raise plots.Unplottable(f"{arguments.file}: a map needs two parameters; swept are {', '.join(sweep.names)}")
        figure = draw_map(sweep, names[:2])
    elif kind == "curves":
        figure = draw_curves(sweep, names[0], names[1] if len(names) > 1 and not sweep.is_paired else None)
    else:
        figure = draw_parallel(sweep)
    plots.save(figure, arguments.out or arguments.file.with_suffix(".png"))


if __name__ == "__main__":
    plots.run(main)
