#!/usr/bin/python3
"""Plot the statistics of a run for each side of each stop or body: mean and RMS force, share of time in contact and impact rate
with their 95 % intervals, and below them a histogram of the impacts.
"""

import argparse
from pathlib import Path

import impactbeam_plots as plots
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import MaxNLocator, NullLocator


# Dataset and label
BARS = {"mean_force": "mean force", "rms_force": "RMS force", "contact_share": "share of time in contact",
        "impact_rate": "impact rate"}

# Faces of a stop or body, and what bounds the way of a body
FACES = {name: {"color": plots.COLOURS[colour], "linestyle": plots.DASHES[dash]}
         for name, colour, dash in (("below", 2, 0), ("above", 1, 1), ("floor", 3, 2), ("ceiling", 4, 3))}
STOPS_A_ROW = 4


class Statistics:
    """What a picture shows of one file."""

    def __init__(self, path):
        with plots.open_results(path) as file:
            group = plots.group_of(file, "statistics", "&statistics")
            self.path = path
            self.title = plots.title_of(file)
            names = plots.text_of(group["surface"].attrs["flag_meanings"]).split()[1:]
            if not names:
                raise plots.missing(file, "has no stops and no bodies, so there are no statistics to draw")
            # such as "stop 1" with the face "below", "body 1" with "floor"; one that is met from one side may name no face
            words = [name.split("_") for name in names]
            self.owners = [" ".join(word for word in name if word not in FACES) for name in words]
            self.faces = [name[-1] if name[-1] in FACES else "below" for name in words]
            # the first is of all together
            self.bars = {name: (group[name][1:], group[f"{name}_half_width"][1:]) for name in BARS}
            self.units = {name: plots.unit_of(group, name) for name in BARS}
            parts = [group[f"surface_{number}"] for number in range(1, len(names) + 1)]
            self.classes = [(part["class"][()], part["impacts"][()]) for part in parts]
            words = [plots.text_of(part["class"].attrs["long_name"]) for part in parts]
            self.kinds = ["impulse" if "impulse" in word else "force" for word in words]
            self.class_units = {}
            for kind in set(self.kinds):
                own = [number for number, other in enumerate(self.kinds) if other == kind]
                greatest = max((np.nanmax(self.classes[number][0], initial=0.0) for number in own), default=0.0)
                factor, self.class_units[kind] = plots.reading(greatest, plots.unit_of(parts[own[0]], "class"))
                for number in own:
                    self.classes[number] = factor*self.classes[number][0], self.classes[number][1]


def draw_bars(axes, statistics, name):
    """One number of each surface, with its interval where there is one."""
    values, widths = statistics.bars[name]
    unit = statistics.units[name]
    places = np.arange(len(values))
    axes.bar(places, values, width=0.62, color=[FACES[face]["color"] for face in statistics.faces], alpha=0.75)
    known = np.isfinite(widths)
    if not np.isfinite(values).any():
        axes.text(0.5, 0.5, "not defined for rigid contacts", ha="center", va="center", transform=axes.transAxes, fontsize=8)
    axes.errorbar(places[known], values[known], yerr=widths[known], fmt="none", ecolor="#000000", elinewidth=0.9, capsize=2.5)
    # bars without a value would leave the range of the axis out
    axes.set_xlim(-0.6, len(values) - 0.4)
    axes.set_ylim(bottom=0.0)
    owners = list(dict.fromkeys(statistics.owners))
    axes.set_xticks([places[[owner == each for each in statistics.owners]].mean() for owner in owners],
                    [owner if len(owners) < 7 else owner.replace("stop ", "") for owner in owners], fontsize=8)
    axes.tick_params(axis="x", which="both", length=0)
    axes.set_ylabel(plots.with_unit(BARS[name], unit))


def draw_classes(axes, statistics, owner, kind):
    """Histogram of the impacts on the faces of a stop or body."""
    for number, (edges, impacts) in enumerate(statistics.classes):
        if (statistics.kinds[number], statistics.owners[number]) != (kind, owner) or not impacts.any() \
                or not np.all(np.isfinite(edges)):
            continue
        axes.stairs(impacts, np.concatenate(([0.0], edges)), linewidth=1.1, **FACES[statistics.faces[number]])
    axes.set_title(owner, fontsize=9)
    axes.yaxis.set_major_locator(MaxNLocator(4, integer=True))
    axes.yaxis.set_minor_locator(NullLocator())


def draw(statistics):
    """The figure of one file: bars of each side of each stop or body, below them histograms, of forces and impulses apart."""
    rows = []
    for kind in ("force", "impulse"):
        stops = list(dict.fromkeys(owner for owner, own in zip(statistics.owners, statistics.kinds) if own == kind))
        rows += [(kind, stops[first:first + STOPS_A_ROW]) for first in range(0, len(stops), STOPS_A_ROW)]
    heights = [2.0, 2.0] + [1.9] * len(rows)
    figure = plt.figure(figsize=(plots.WIDTH, sum(heights) + 0.3), layout="constrained")
    parts = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
    for part, names in zip(parts, (list(BARS)[:2], list(BARS)[2:])):
        for axes, name in zip(part.subplots(1, 2), names):
            draw_bars(axes, statistics, name)
    for part, (kind, stops) in zip(parts[2:], rows):
        panels = part.subplots(1, len(stops), sharex=True, sharey=True, squeeze=False)[0]
        for axes, stop in zip(panels, stops):
            draw_classes(axes, statistics, stop, kind)
        panels[0].set_xlim(left=0.0)
        panels[0].set_ylabel("impacts")
        handles = [plt.Line2D([], [], label=face, **line) for face, line in FACES.items()
                   if (kind, face) in zip(statistics.kinds, statistics.faces)]
        part.supxlabel(plots.with_unit(f"{kind} of an impact", statistics.class_units[kind]), fontsize=10.5,
                       x=0.5 if len(handles) < 3 else 0.3)
        if handles:
            part.legend(handles=handles, loc="lower right", ncols=len(handles), fontsize=8, borderpad=0.0, borderaxespad=0.2)
    figure.suptitle(statistics.title, x=0.02, ha="left", fontsize=10.5)
    return figure


def main():
    """Read the command line and draw each file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", metavar="results.h5", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, help="picture; default: beside each file, _statistics.png")
    arguments = parser.parse_args()
    for path in arguments.files:
        plots.save(draw(Statistics(path)), arguments.out or path.with_name(path.stem + "_statistics.png"))


if __name__ == "__main__":
    plots.run(main)
