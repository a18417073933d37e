#!/usr/bin/python3
"""Plot the statistics of a run, surface by surface: mean and RMS force with their 95 % intervals, the share of time in
contact, impacts over time, and below them the histogram of the impacts of each surface.

Plots what the results files hold and computes nothing.
"""

import argparse
from pathlib import Path

import impactbeam_plots as plots
import matplotlib.pyplot as plt
import numpy as np


# Dataset and label
BARS = {"mean_force": "mean force", "rms_force": "RMS force", "contact_share": "share of time in contact",
        "impact_rate": "impacts over time"}


class Statistics:
    """What a picture shows of one file."""

    def __init__(self, path):
        with plots.open_results(path) as file:
            group = plots.group_of(file, "statistics", "&statistics")
            self.path = path
            self.title = plots.title_of(file)
            names = plots.text_of(group["surface"].attrs["flag_meanings"]).split()[1:]
            if not names:
                raise plots.Unplottable(f"{path}: has no stops of which it could tell")
            self.names = [name.replace("stop_", "").replace("_", "\n") for name in names]
            # the first is of all together
            self.bars = {name: (group[name][1:], group[f"{name}_half_width"][1:]) for name in BARS}
            self.units = {name: plots.text_of(group[name].attrs["units"]) for name in BARS}
            parts = [group[f"surface_{number}"] for number in range(1, len(names) + 1)]
            self.classes = [(part["class"][()], part["impacts"][()]) for part in parts]
            self.class_units = [plots.text_of(part["class"].attrs["units"]) for part in parts]


def draw_bars(axes, statistics, name):
    """One number of each surface, with its interval where there is one."""
    values, widths = statistics.bars[name]
    unit = statistics.units[name]
    places = np.arange(len(values))
    axes.bar(places, values, width=0.62, color=plots.COLOURS[2], alpha=0.75)
    known = np.isfinite(widths)
    axes.errorbar(places[known], values[known], yerr=widths[known], fmt="none", ecolor="#000000", elinewidth=0.9, capsize=2.5)
    axes.set_xticks(places, statistics.names, fontsize=8)
    axes.tick_params(axis="x", which="both", length=0)
    axes.set_ylabel(BARS[name] + (f", {unit}" if unit != "1" else ""))


def draw_classes(axes, statistics):
    """Histograms of impacts as steps."""
    for number, (edges, impacts) in enumerate(statistics.classes):
        if not len(edges) or not impacts.any() or not np.all(np.isfinite(edges)):
            continue
        label = statistics.names[number].replace("\n", " ")
        axes.stairs(impacts, np.concatenate(([0.0], edges)), label=label, color=plots.COLOURS[number % len(plots.COLOURS)],
                    linestyle=plots.DASHES[number % len(plots.DASHES)], linewidth=1.1)
    unit = statistics.class_units[0]
    axes.set_xlabel(f"force or impulse of an impact, {unit}" if len(set(statistics.class_units)) == 1 else
                    "force or impulse of an impact")
    axes.set_ylabel("impacts")
    axes.set_xlim(left=0.0)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="upper right", ncols=2)


def draw(statistics):
    """The figure of one file."""
    figure = plt.figure(figsize=(plots.WIDTH, 7.2), layout="constrained")
    grid = figure.add_gridspec(3, 2, height_ratios=[1.0, 1.0, 1.15])
    for number, name in enumerate(BARS):
        draw_bars(figure.add_subplot(grid[number//2, number % 2]), statistics, name)
    draw_classes(figure.add_subplot(grid[2, :]), statistics)
    figure.axes[0].set_title(statistics.title)
    return figure


def main():
    """Read the command line and draw each file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", metavar="results.h5", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, help="picture; default: beside each file, _statistics.png")
    arguments = parser.parse_args()
    plt.rcParams.update(plots.STYLE)
    for path in arguments.files:
        plots.save(draw(Statistics(path)), arguments.out or path.with_name(path.stem + "_statistics.png"))


if __name__ == "__main__":
    plots.run(main)
