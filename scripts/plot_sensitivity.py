#!/usr/bin/python3
"""Plot sensitivities of measures: for each measure a bar for each parameter, by how many percent the measure changes if the
parameter changes by one percent, the longest at the top. A pair without a derivative has a bar for each side if both converge.
"""

import argparse
import math
from pathlib import Path

import impactbeam_plots as plots
import matplotlib.pyplot as plt
import numpy as np


# maximum error of a derivative from one side over its value, as in the table of the program; above it the derivative does not converge
MAX_ERROR = 0.05


class Sensitivity:
    """What a picture shows of one file."""

    def __init__(self, path):
        with plots.open_results(path) as file:
            group = plots.group_of(file, "sensitivity", "&sensitivity")
            self.title = plots.title_of(file)
            self.measures = [plots.text_of(name) for name in group["measure"][()]]
            self.parameters = [plots.text_of(name) for name in group["parameter"][()]]
            # one percent of 0 is no change
            value = group["parameter_value"][()].astype(float)
            value[value == 0.0] = math.nan
            self.elasticity = np.where(np.isnan(value), math.nan, group["elasticity"][()])
            self.states = [plots.text_of(name) for name in group["state"][()]]
            with np.errstate(divide="ignore", invalid="ignore"):
                share = value/group["measure_value"][()]
                self.sides = [np.where(group[f"{name}_error"][()] <= MAX_ERROR*np.abs(group[name][()]), share*group[name][()], math.nan)
                              for name in ("from_below", "from_above")]

    def bars_of(self, measure):
        """Name and elasticities of each parameter, the longest last, before them those without."""
        bars = []
        for row, name in enumerate(self.measures):
            if name != measure:
                continue
            values = [self.elasticity[row]]
            if self.states[row] == "none":
                values = [side[row] for side in self.sides]
            bars.append((self.parameters[row], values if all(map(math.isfinite, values)) else []))
        return sorted(bars, key=lambda bar: max(map(abs, bar[1]), default=-1.0))


def draw_measure(axes, sensitivity, measure):
    """The bars of one measure."""
    bars = sensitivity.bars_of(measure)
    for place, (_, values) in enumerate(bars):
        if not values:
            axes.annotate("no derivative, or a value of 0", (0.0, place), xytext=(4, 0), textcoords="offset points",
                          va="center", fontsize=8, color="#606060")
        height = 0.62/max(1, len(values))
        for number, value in enumerate(values):
            axes.barh(place + (number - 0.5*(len(values) - 1))*height, value, height=0.9*height,
                      color=plots.COLOURS[2 if value >= 0 else 1], alpha=0.8 if len(values) == 1 else 0.4 + 0.3*number)
    axes.axvline(0.0, color="#000000", linewidth=0.7)
    axes.set_yticks(range(len(bars)), [name for name, _ in bars])
    axes.tick_params(axis="y", which="both", length=0)
    axes.set_title(measure)
    axes.margins(x=0.08)
    axes.set_ylim(-0.6, len(bars) - 0.4)
    # rounding errors alone would fill the panel
    if max((abs(value) for _, values in bars for value in values), default=0.0) < 1e-9:
        axes.set_xlim(-1.0, 1.0)


def draw(sensitivity):
    """The figure of one file."""
    measures = list(dict.fromkeys(sensitivity.measures))
    rows = math.ceil(len(measures)/2)
    bars = len(set(sensitivity.parameters))
    figure, grid = plt.subplots(rows, min(2, len(measures)), figsize=(plots.WIDTH, rows*(0.75 + 0.24*bars) + 0.7),
                                layout="constrained", squeeze=False)
    for axes, measure in zip(grid.flat, measures):
        draw_measure(axes, sensitivity, measure)
    for axes in list(grid.flat)[len(measures):]:
        axes.set_axis_off()
    figure.suptitle(sensitivity.title, fontsize=10.5, x=0.02, ha="left")
    figure.supxlabel("percent of the measure for one percent of the parameter", fontsize=10.5)
    return figure


def main():
    """Read the command line and draw each file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", metavar="results.h5", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, help="picture; default: beside each file, _sensitivity.png")
    arguments = parser.parse_args()
    plt.rcParams.update(plots.STYLE)
    for path in arguments.files:
        plots.save(draw(Sensitivity(path)), arguments.out or path.with_name(path.stem + "_sensitivity.png"))


if __name__ == "__main__":
    plots.run(main)
