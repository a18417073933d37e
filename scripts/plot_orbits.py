#!/usr/bin/python3
"""Plot branches of periodic motions: the displacement of the tip in sections of phase 0 against the amplitude or the
frequency of the load, stable motions solid, others dashed, with marks where branches turn back, double their period or
an impact comes or goes. Behind them, on request, the sections of a sweep over the same.

Plots what the results files hold and computes nothing.
"""

import argparse
import re
from pathlib import Path

import impactbeam_plots as plots
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D


STABLE, UNSTABLE = "-", (0, (4, 2))
MARKS = {"fold": ("o", "fold"), "period_doubling": ("s", "period doubling"), "neimark_sacker": ("D", "torus"),
         "grazing": ("x", "grazing"), "lost": ("|", "lost")}


def sections_of(path, parameter, unit, unit_of_tip):
    """Parameter and sections of the tip of all cases of a sweep over the parameter of the branches, in the units of these."""
    with plots.open_results(path) as file:
        group = plots.group_of(file, "sweep", "&sweep")
        if "section_displacement_tip" not in group:
            raise plots.missing(file, "has no sections: its scene has no &poincare")
        names = [word.strip() for word in plots.text_of(group.attrs["parameters"]).split(",")]
        name = next((each for each in names if re.fullmatch(rf"(force|base)_\d+_{parameter}(_ratio)?", each)), None)
        if name is None:
            raise plots.Unplottable(f"{path}: its sweep does not vary the {parameter} of a load, as the branches do")
        if [plots.unit_of(group, each) for each in (name, "section_displacement_tip")] != [unit, unit_of_tip]:
            raise plots.Unplottable(f"{path}: is in other units than the branches")
        if float(file["scene/poincare"].attrs["phase"]) % 360.0 != 0.0:
            raise plots.Unplottable(f"{path}: has its sections at another phase of the load than 0, that of the branches")
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
            raise plots.missing(file, "has no branches: its &orbit has no parameter")
        shown = set()
        branches = [group[f"branch_{k}"] for k in range(1, int(np.ravel(group.attrs["branches"])[0]) + 1)]
        greatest = max(abs(plots.values_of(branch, "displacement_tip")).max() for branch in branches)
        factor, unit = plots.reading(greatest, plots.unit_of(branches[0], "displacement_tip"))
        for number, branch in enumerate(branches):
            draw_branch(axes, branch, plots.COLOURS[number % len(plots.COLOURS)], factor, shown)
        axes.set_ylabel(plots.with_unit("displacement of the tip at phase 0 of the load,\nup from the unstressed beam", unit))
        unit_of_tip = plots.unit_of(branches[0], "displacement_tip")
        unit = plots.unit_of(branches[0], "parameter")
        parameter = plots.text_of(file["scene/orbit"].attrs["parameter"])
        axes.set_xlabel(plots.with_unit(f"{parameter} of the load", unit))
        axes.set_title(plots.title_of(file))
        values = np.concatenate([branch["parameter"][()] for branch in branches])
        stable = np.concatenate([branch["is_stable"][()] for branch in branches]) > 0
    if sweep:
        value, sections = sections_of(sweep, parameter, unit, unit_of_tip)
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
