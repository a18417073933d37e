#!/usr/bin/python3
"""Plot tables of frequencies: errors of lambda in percent against the mode, a curve for each mesh and solver.

Plots what the results files hold and computes nothing.
"""

import argparse
from pathlib import Path

import impactbeam_plots as plots
import matplotlib.pyplot as plt
import matplotlib.ticker as ticker



def column_labels(group):
    """What stands beside each curve: n, r, and the solver if there are several."""
    solvers = plots.texts_of(group["column_solver"])
    labels = []
    for solver, elements, ratio in zip(solvers, group["column_elements"][()], group["column_ratio"][()]):
        label = f"$n$ = {elements}, $r$ = {ratio:g}"
        labels.append(label if len(set(solvers)) == 1 else f"{label}, {solver}")
    return labels


def draw(path):
    """The picture of one file."""
    with plots.open_results(path) as file:
        group = plots.group_of(file, "frequencies", "&frequencies")
        if "error" not in group:
            raise plots.Unplottable(f"{path}: has no errors: &frequencies reference was not 'exact'")
        title = plots.title_of(file)
        labels = column_labels(group)
        mode = group["mode"][()]
        errors = abs(group["error"][()])

    figure, axes = plt.subplots(figsize=(plots.WIDTH, 3.9))
    for number, label in enumerate(labels):
        colour = plots.COLOURS[number % len(plots.COLOURS)]
        axes.plot(mode, errors[:, number], label=label, color=colour, linewidth=0.9, markersize=4.5,
                  marker=plots.MARKERS[number % len(plots.MARKERS)], markerfacecolor="white", markeredgecolor=colour,
                  linestyle=plots.DASHES[number % len(plots.DASHES)])
    axes.set_yscale("log")
    axes.set_title(title)
    axes.set_xlabel("mode $i$")
    axes.set_ylabel(r"error of $\lambda_i$ (percent)")
    axes.set_xlim(mode[0] - 0.4, mode[-1] + 0.4)
    axes.xaxis.set_major_locator(ticker.MultipleLocator(1))
    axes.xaxis.set_minor_locator(ticker.NullLocator())
    axes.grid(axis="y", which="major", color="#e0e0e0", linewidth=0.6)
    axes.legend(loc="lower right", ncol=1 + (len(labels) > 8))
    return figure


def main():
    """Read the command line, draw, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE.h5", help="results files")
    parser.add_argument("--out", type=Path, metavar="PICTURE",
                        help="file of the picture, .png, .pdf or .svg (default: beside the results, .png)")
    arguments = parser.parse_args()
    if arguments.out and len(arguments.files) > 1:
        parser.error("--out names one picture: give one file")
    for path in arguments.files:
        plots.save(draw(path), arguments.out or path.with_suffix(".png"))


if __name__ == "__main__":
    plots.run(main)
