#!/usr/bin/python3
"""Plot the scatter of measures that uncertain parameters cause: for each measure the histogram of the cases, with the mean,
the median, and the lowest and the highest quantile.
"""

import argparse
import math
from pathlib import Path

import impactbeam_plots as plots
import matplotlib.pyplot as plt
import numpy as np


class Uncertainty:
    """What a picture shows of one file."""

    def __init__(self, path):
        with plots.open_results(path) as file:
            group = plots.group_of(file, "uncertainty", "&uncertainty")
            self.title = plots.title_of(file)
            self.names = [plots.text_of(name) for name in group["name"][()]]
            self.units = [plots.text_of(unit) for unit in group["unit"][()]]
            self.means = group["mean"][()]
            self.probabilities = group["quantiles/probability"][()]
            self.quantiles = [group["quantiles"][name][()] for name in self.names]
            parts = [group["histograms"][name] for name in self.names]
            self.edges = [np.concatenate(([float(part.attrs["least"])], part["class"][()])) for part in parts]
            self.cases = [part["cases"][()] for part in parts]
            if not self.names:
                raise plots.Unplottable(f"{path}: has no measure that any case came to")


def draw_measure(axes, uncertainty, number):
    """The histogram of one measure."""
    edges = uncertainty.edges[number]
    factor, unit = plots.reading_of(edges, uncertainty.units[number])
    if edges[-1] > edges[0]:
        axes.stairs(uncertainty.cases[number], factor*edges, fill=True, color=plots.COLOURS[2], alpha=0.55)
    axes.axvline(factor*uncertainty.means[number], color=plots.COLOURS[0], label="mean")
    quantiles = factor*uncertainty.quantiles[number]
    chances = uncertainty.probabilities
    for place in sorted({int(np.argmin(chances)), int(np.argmin(np.abs(chances - 0.5))), int(np.argmax(chances))}):
        axes.axvline(quantiles[place], color=plots.COLOURS[1], linestyle=plots.DASHES[1 + place % 4],
                     label=f"{100.0*chances[place]:g} % below")
    axes.set_xlabel(plots.with_unit(uncertainty.names[number], unit))
    axes.set_ylabel("cases")
    axes.ticklabel_format(axis="x", useOffset=False, style="plain")
    axes.locator_params(axis="x", nbins=4)


def draw(uncertainty):
    """The figure of one file."""
    count = len(uncertainty.names)
    columns = min(2, count)
    rows = math.ceil(count/columns)
    figure, grid = plt.subplots(rows, columns, figsize=(plots.WIDTH, 2.0*rows + 0.6), layout="constrained", squeeze=False)
    for number, axes in enumerate(grid.flat):
        if number < count:
            draw_measure(axes, uncertainty, number)
        else:
            axes.set_axis_off()
    handles, labels = grid.flat[0].get_legend_handles_labels()
    if count < grid.size:
        grid.flat[-1].legend(handles, labels, loc="center")
    else:
        figure.legend(handles, labels, loc="upper right", ncols=len(labels), fontsize=8)
    figure.suptitle(uncertainty.title, fontsize=10.5, x=0.02, ha="left")
    return figure


def main():
    """Read the command line and draw each file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", metavar="results.h5", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, help="picture; default: beside each file, _uncertainty.png")
    arguments = parser.parse_args()
    plt.rcParams.update(plots.STYLE)
    for path in arguments.files:
        plots.save(draw(Uncertainty(path)), arguments.out or path.with_name(path.stem + "_uncertainty.png"))


if __name__ == "__main__":
    plots.run(main)
