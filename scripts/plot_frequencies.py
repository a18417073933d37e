#!/usr/bin/python3
"""Plot frequencies: natural frequencies against the mode, mode shapes if the file has them (&output mode_shapes), and the
errors of lambda if it has exact values, a curve for each mesh and solver.

Plots what the results files hold and computes nothing; between nodes a shape is the cubic of its elements.
"""

import argparse
from pathlib import Path

import impactbeam_plots as plots
import matplotlib.pyplot as plt
import matplotlib.ticker as ticker
import numpy
import plot_scene


def column_labels(group):
    """What stands beside each curve: n, r, and the solver if there are several."""
    solvers = plots.texts_of(group["column_solver"])
    labels = []
    for solver, elements, ratio in zip(solvers, group["column_elements"][()], group["column_ratio"][()]):
        label = f"$n$ = {elements}, $r$ = {ratio:g}"
        labels.append(label if len(set(solvers)) == 1 else f"{label}, {solver}")
    return labels


class Table:
    """What a picture shows of one file."""

    def __init__(self, path):
        with plots.open_results(path) as file:
            group = plots.group_of(file, "frequencies", "&frequencies")
            self.title = plots.title_of(file)
            self.labels = column_labels(group)
            self.mode = group["mode"][()]
            name = plots.named(group, "omega")
            self.frequency, self.unit = group[name][()], plots.unit_of(group, name)
            self.error = abs(group["error"][()]) if "error" in group else None
            self.shape = None
            if "shapes" in group:
                node, value, slope = (plots.values_of(group["shapes"], name, "dimensionless") for name in ("x", "displacement", "slope"))
                self.x = plot_scene.within_elements(node)
                self.shape = plot_scene.cubics(node, self.x, value, slope)
                self.along = plots.Along(file, plots.unit_of(group["shapes"], "x"))


def draw_columns(axes, table, values):
    """A curve for each mesh and solver over the modes."""
    for number, label in enumerate(table.labels):
        line = plots.line_of(number)
        axes.plot(table.mode, numpy.where(values[:, number] > 0.0, values[:, number], numpy.nan), label=label, linewidth=0.9, markersize=4.5,
                  marker=plots.MARKERS[number % len(plots.MARKERS)], markerfacecolor="white", markeredgecolor=line["color"], **line)
    axes.set_yscale("log")
    axes.set_xlabel("mode $i$")
    axes.set_xlim(table.mode[0] - 0.4, table.mode[-1] + 0.4)
    axes.xaxis.set_major_locator(ticker.MaxNLocator(10, integer=True))
    axes.xaxis.set_minor_locator(ticker.NullLocator())
    axes.grid(axis="y", which="major", color="#e0e0e0", linewidth=0.6)


def draw_shapes(axes, table):
    """The shapes of the modes of the first mesh, one over the other, each named by its frequency."""
    for number, shape in enumerate(table.shape):
        axes.plot(table.along.length * table.x, 0.42 * shape / abs(shape).max() - number, color="black", linewidth=0.9)
        axes.axhline(-number, color="#c0c0c0", linewidth=0.5, zorder=0)
        factor, unit = plots.reading(table.frequency[number, 0], table.unit)
        words = plots.quantity(factor * table.frequency[number, 0], unit)
        axes.annotate(words, (1.0, -number), xytext=(4, 0), xycoords=("axes fraction", "data"), textcoords="offset points",
                      va="center", fontsize=8.5)
    axes.set_yticks(range(0, -len(table.shape), -1), [str(mode) for mode in table.mode[:len(table.shape)]])
    axes.tick_params(axis="y", which="both", length=0)
    axes.yaxis.set_minor_locator(ticker.NullLocator())
    axes.set_xlim(0.0, table.along.length)
    axes.set_xlabel(table.along.label())
    axes.set_ylabel("mode shape")


def draw(path):
    """The picture of one file: shapes or frequencies, and errors beside them."""
    table = Table(path)
    count = 2 if table.error is not None else 1
    # a long legend stands beside the panels
    columns = -(-len(table.labels) // 20) if len(table.labels) > 16 else 0
    figure, panels = plt.subplots(1, count, figsize=(plots.WIDTH * (1.0 if count == 1 else 1.3) + 1.6 * columns, 3.9),
                                  layout="constrained", squeeze=False)
    first, last = panels[0][0], panels[0][-1]
    if table.shape is not None:
        draw_shapes(first, table)
    else:
        draw_columns(first, table, table.frequency)
        plots.set_decades(first.yaxis)
        first.set_ylabel(plots.with_unit("natural frequency", table.unit) if table.unit else r"natural frequency $\omega_i/\omega_1$")
    if table.error is not None:
        draw_columns(last, table, table.error)
        last.set_ylabel(r"error of $\lambda_i$ (percent)")
    first.set_title(table.title)
    if columns:
        last.legend(loc="upper left", bbox_to_anchor=(1.0, 1.02), ncol=columns, fontsize=8)
    elif len(table.labels) > 1 or table.error is not None:
        last.legend(loc="best", ncol=1 + (len(table.labels) > 8), fontsize=8)
    return figure


def main():
    """Read the command line, draw, write."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE.h5", help="results files")
    parser.add_argument("--out", type=Path, metavar="PICTURE",
                        help="file of the picture, .png, .pdf or .svg (default: beside the results, NAME_frequencies.png)")
    arguments = parser.parse_args()
    if arguments.out and len(arguments.files) > 1:
        parser.error("--out names one picture: give one file")
    for path in arguments.files:
        plots.save(draw(path), arguments.out or plots.beside(path, "frequencies"))


if __name__ == "__main__":
    plots.run(main)
