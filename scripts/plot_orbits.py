#!/usr/bin/python3
"""Plot branches of periodic motions: the displacement of the tip in sections of phase 0 against the amplitude or the
frequency of the load, stable motions solid, others dashed, with marks where branches turn back, double their period or
an impact comes or goes. Behind them, on request, the sections of a sweep over the same.

Plots what the results files hold and computes nothing.
"""

import argparse
from pathlib import Path

import impactbeam_plots as plots
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D


STABLE, UNSTABLE = "-", (0, (4, 2))
MARKS = {"fold": ("o", "fold"), "period_doubling": ("s", "period doubling"), "neimark_sacker": ("D", "torus"),
         "grazing": ("x", "grazing"), "lost": ("|", "lost")}


def sections_of(path):
    """Parameter and sections of the tip of all cases of a sweep."""
    with plots.open_results(path) as file:
        group = plots.group_of(file, "sweep", "&sweep")
        if "section_displacement_tip" not in group:
            raise plots.Unplottable(f"{path}: has no sections: its scene has no &poincare")
        name = [word.strip() for word in plots.text_of(group.attrs["parameters"]).split(",")][-1]
        sections = group["section_displacement_tip"][()]
        return np.repeat(group[name][()], sections.shape[1]), sections.ravel()


def draw_branch(axes, group, colour, factor, shown):
    """Runs of stable and of other points, and what is marked."""
    value = group["parameter"][()]
    tip = factor * plots.values_of(group, "displacement_tip")
    stable = group["is_stable"][()] > 0
    edges = [0, *(np.flatnonzero(np.diff(stable)) + 1), len(value)]
    for first, last in zip(edges, edges[1:]):
        # up to the first point of the next run, so that no gap is left
        run = slice(first, min(last + 1, len(value)))
        axes.plot(value[run], tip[run], color=colour, linewidth=1.1 if stable[first] else 0.8,
                  linestyle=STABLE if stable[first] else UNSTABLE)
    mark = group["mark"]
    words = plots.text_of(mark.attrs["flag_meanings"]).split()
    for number, word in enumerate(words):
        here = mark[()] == number
        if word not in MARKS or not here.any():
            continue
        symbol, label = MARKS[word]
        axes.plot(value[here], tip[here, 0], linestyle="none", marker=symbol, markersize=5, color="black", clip_on=False,
                  markerfacecolor="white", label=None if word in shown else label, zorder=4)
        shown.add(word)


def draw(path, sweep):
    """The picture of one file."""
    figure, axes = plt.subplots(figsize=(plots.WIDTH, 4.2), layout="constrained")
    with plots.open_results(path) as file:
        group = plots.group_of(file, "orbit", "&orbit")
        if "branches" not in group.attrs:
            raise plots.Unplottable(f"{path}: has no branches: its &orbit has no parameter")
        shown = set()
        branches = [group[f"branch_{k}"] for k in range(1, int(np.ravel(group.attrs["branches"])[0]) + 1)]
        greatest = max(abs(plots.values_of(branch, "displacement_tip")).max() for branch in branches)
        factor, unit = plots.reading(greatest, plots.unit_of(branches[0], "displacement_tip"))
        for number, branch in enumerate(branches):
            draw_branch(axes, branch, plots.COLOURS[number % len(plots.COLOURS)], factor, shown)
        axes.set_ylabel(plots.with_unit("displacement of the tip at phase 0 of the load,\nup from the unstressed beam", unit))
        unit = plots.text_of(branches[0]["parameter"].attrs["units"])
        parameter = plots.text_of(file["scene/orbit"].attrs["parameter"])
        axes.set_xlabel(plots.with_unit(f"{parameter} of the load", "" if unit == "1" else unit))
        axes.set_title(plots.title_of(file))
        values = np.concatenate([branch["parameter"][()] for branch in branches])
        stable = np.concatenate([branch["is_stable"][()] for branch in branches]) > 0
    if sweep:
        value, sections = sections_of(sweep)
        axes.plot(value, factor * sections, linestyle="none", marker=".", markersize=2.5, color="#b8b8b8",
                  label="sections of the sweep", zorder=0)
    margin = 0.01 * np.ptp(values)
    axes.set_xlim(values.min() - margin, values.max() + margin)
    handles = [Line2D([], [], color="black", linestyle=style, label=label)
               for style, label, is_there in ((STABLE, "stable", stable), (UNSTABLE, "unstable", ~stable)) if is_there.any()]
    axes.legend(handles=[*handles, *axes.get_legend_handles_labels()[0]], fontsize="small")
    return figure


def main():
    """Read the command line, draw, write."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("file", type=Path, metavar="FILE.h5", help="results file of a scene with &orbit")
    parser.add_argument("--sweep", type=Path, metavar="SWEEP.h5", help="sections of its cases stand behind the branches")
    parser.add_argument("--out", type=Path, metavar="PICTURE",
                        help="file of the picture, .png, .pdf or .svg (default: beside the results, NAME_orbits.png)")
    arguments = parser.parse_args()
    plots.save(draw(arguments.file, arguments.sweep), arguments.out or plots.beside(arguments.file, "orbits"))


if __name__ == "__main__":
    plots.run(main)
