#!/usr/bin/python3
"""Plot a bifurcation diagram: the states once per period (&poincare) of the cases of a sweep against the carried parameter,
increasing and decreasing in two colours, with the surface of the stop. Below it: the maximum Lyapunov exponent and, if
&frequency_response is in the scene, the amplitude without contacts beside the maximum displacement.
"""

import argparse
import re
from pathlib import Path

import impactbeam_plots as plots
import matplotlib.pyplot as plt
import numpy as np


INCREASING, DECREASING, LINEAR = plots.COLOURS[2], plots.COLOURS[1], plots.COLOURS[5]
LABELS = {"displacement": "displacement in sections", "velocity": "velocity in sections"}
POINTS = {"tip": "of the tip", "stop": "of the stop point"}
# Parameters of contacts alone: the linear beam does not depend on them.
OF_CONTACTS = re.compile(r"((stop|body)_\d+_)?(floor_)?(restitution|((branch_)?stiffness|damper|branch)(_ratio)?)")


def chains_of(group, others):
    """The places of the cases of each chain; without a carried parameter, of each combination of the other parameters of a grid."""
    count = len(group["case"])
    if "chain" in group.attrs:
        return np.arange(count).reshape(-1, int(np.ravel(group.attrs["chain"])[0]))
    if not others or plots.text_of(group.attrs["design"]) != "grid":
        return [np.arange(count)]
    _, first, member = np.unique(np.array([group[each][()] for each in others]), axis=1, return_index=True, return_inverse=True)
    return [np.flatnonzero(np.ravel(member) == each) for each in np.argsort(first)]


class Diagram:
    """What a picture shows of one file."""

    def __init__(self, path, quantity, point, chain):
        with plots.open_results(path) as file:
            group = plots.group_of(file, "sweep", "&sweep")
            name = f"section_{quantity}_{point}"
            if name not in group:
                raise plots.missing(file, "has no sections: its scene has no &poincare")
            names = [word.strip() for word in plots.text_of(group.attrs["parameters"]).split(",")]
            self.path = path
            self.title = plots.title_of(file)
            self.parameter = plots.text_of(group.attrs["carry"]) if "carry" in group.attrs else names[-1]
            together = [self.parameter, *plots.varied_with(file, self.parameter)]
            others = [each for each in names if each not in together]
            chains = chains_of(group, others)
            if not 1 <= chain <= len(chains):
                raise plots.Unplottable(f"{path}: has chains 1 to {len(chains)}: --chain {chain} is none of them")
            cases = chains[chain - 1]
            self.is_carried = "carry" in group.attrs
            if not self.is_carried:
                # curves join neighbours, and the lists of a scene have any order
                cases = cases[np.argsort(group[self.parameter][()][cases], kind="stable")]
            self.given = ""
            if plots.text_of(group.attrs["design"]) != "grid":
                self.given = "".join(f"; {each} varies too" for each in others)
            elif len(chains) > 1:
                self.given = "; " + ", ".join(f"{each} = {group[each][()][cases][0]:g}" for each in others)
            factor, unit = plots.reading(np.max(np.abs(group[self.parameter][()])), plots.unit_of(group, self.parameter))
            self.values = factor*group[self.parameter][()][cases]
            self.labels = [plots.with_unit(plots.words_of(each), unit if each == self.parameter else plots.unit_of(group, each))
                           for each in together]
            self.sections = group[name][()][cases]
            self.section_unit = plots.unit_of(group, name)
            self.of_point = POINTS[point] if point == "tip" or "stop" in file["scene"] else "relative to body 1"
            is_fixed = quantity == "displacement" and not any(word in each for each in names for word in ("preload", "height", "clearance"))
            self.levels = self.read_levels(file, point) if is_fixed else []
            self.is_back = group["direction"][()][cases] < 0 if "direction" in group else np.zeros(len(cases), bool)
            self.exponent, self.exponent_unit = None, ""
            if "lyapunov_exponent" in group:
                self.exponent = group["lyapunov_exponent"][()][cases]
                self.exponent_unit = plots.unit_of(group, "lyapunov_exponent")
            self.linear = self.read_linear(file, point, factor) if "frequency" in self.parameter else None
            # the linear beam was computed with the values of the scene
            self.of_scene = [each for each in names if each != self.parameter and not OF_CONTACTS.fullmatch(each)]
            self.greatest = None
            if self.linear is not None:
                extremes = [f"{end}imum_{'tip' if point == 'tip' else 'displacement'}" for end in ("min", "max")]
                if all(extreme in group for extreme in extremes):
                    least, most = (group[extreme][()][cases] for extreme in extremes)
                    self.greatest = 0.5*(most - least)

    @staticmethod
    def read_levels(file, point):
        """Displacements at which the beam touches stops at the point shown."""
        scene = file["scene"]
        unit = float(scene["scales"].attrs["displacement"]) if "units" in file.attrs else 1.0
        stops, release = plots.stops_of(scene)
        place, levels = 1.0 if point == "tip" or release is None else stops[release][0], []
        for position, side, preload in stops:
            if abs(position - place) < 1e-9:
                heights = [preload, -preload] if side == "both" else [-preload if side == "above" else preload]
                levels += [unit*height for height in heights]
        return levels

    @staticmethod
    def read_linear(file, point, factor):
        """Frequencies, multiplied by a factor, amplitudes and their unit of the linear beam, if the file has them."""
        if "frequency_response" not in file:
            return None
        group = file["frequency_response"]
        scale = "frequency" if "frequency" in group else "omega"
        amplitude = group[f"amplitude_{point}"][()]
        if amplitude.ndim > 1:
            amplitude = amplitude[:, plots.surface_of_release(file["scene"])]
        return factor*group[scale][()], amplitude, plots.unit_of(group, f"amplitude_{point}")

    @staticmethod
    def prefix(values, unit):
        """A factor and the unit with a prefix in which values are written."""
        return plots.reading(np.nanmax(np.abs(values)), unit) if np.any(np.isfinite(values)) else (1.0, unit)

    def panels(self):
        """Names of the panels, from top to bottom, and their heights."""
        wanted = [("sections", 3.0)]
        if self.linear is not None:
            wanted.append(("amplitude", 1.7))
        if self.exponent is not None and np.any(np.isfinite(self.exponent)):
            wanted.append(("exponent", 1.2))
        return wanted


def draw_sections(axes, diagram, quantity):
    """A point for each section kept."""
    factor, unit = diagram.prefix(diagram.sections, diagram.section_unit)
    for level in diagram.levels:
        axes.axhline(factor*level, color="#000000", linewidth=0.8, linestyle=(0, (6, 2)), label="surface of the stop" if level ==
                     diagram.levels[0] else None, zorder=0)
    for label, colour, chosen in ways(diagram):
        there = np.repeat(diagram.values[chosen], diagram.sections.shape[1])
        axes.plot(there, factor*diagram.sections[chosen].ravel(), ".", color=colour, markersize=6.0 if chosen[0] else 3.5,
                  markeredgewidth=0, label=label, rasterized=True)
    axes.set_ylabel(plots.with_unit(f"{LABELS[quantity]}\n{diagram.of_point}", unit))
    if diagram.is_back.any() or diagram.levels:
        axes.legend(loc="best")


def ways(diagram):
    """Label, colour and cases of the increasing parameter, and of the decreasing one if there is one; all cases, if none is carried."""
    forth, back = ("increasing", "decreasing") if diagram.values[0] <= diagram.values[~diagram.is_back][-1] else \
        ("decreasing", "increasing")
    forth = forth if diagram.is_carried else "independent cases"
    yield forth, INCREASING, ~diagram.is_back
    if diagram.is_back.any():
        yield back, DECREASING, diagram.is_back


def draw_amplitude(axes, diagram):
    """The linear beam's amplitude, and half the range of the motion where the sweep has it."""
    factor, unit = diagram.prefix(*diagram.linear[1:])
    axes.plot(diagram.linear[0], factor*diagram.linear[1], color=LINEAR, label=", ".join(["linear, stops open", *(
        f"{each} of the scene" for each in diagram.of_scene)]))
    if diagram.greatest is not None:
        for label, colour, chosen in ways(diagram):
            axes.plot(diagram.values[chosen], factor*diagram.greatest[chosen], color=colour, label=label)
    axes.set_yscale("log")
    axes.set_ylabel(plots.with_unit("amplitude", unit))
    axes.legend(loc="best")


def draw_exponent(axes, diagram):
    """Above 0 the motion is chaotic."""
    for _, colour, chosen in ways(diagram):
        axes.plot(diagram.values[chosen], diagram.exponent[chosen], ".-", color=colour, markersize=2.5, linewidth=0.7)
    axes.axhline(0.0, color="#000000", linewidth=0.6)
    axes.set_ylabel(plots.with_unit("Lyapunov\nexponent", diagram.exponent_unit))


def draw(diagram, quantity):
    """The figure of one file."""
    panels = diagram.panels()
    figure, rows = plt.subplots(len(panels), 1, sharex=True, squeeze=False, layout="constrained",
                                figsize=(plots.WIDTH, 1.1 + sum(height for _, height in panels)),
                                gridspec_kw={"height_ratios": [height for _, height in panels]})
    for axes, (name, _) in zip(rows[:, 0], panels):
        if name == "sections":
            draw_sections(axes, diagram, quantity)
        elif name == "amplitude":
            draw_amplitude(axes, diagram)
        else:
            draw_exponent(axes, diagram)
    rows[0, 0].set_title(diagram.title + diagram.given)
    rows[-1, 0].set_xlabel("\n".join(diagram.labels))
    # points at the ends are seen whole
    space = 0.02*(np.ptp(diagram.values) or 1.0)
    rows[-1, 0].set_xlim(diagram.values.min() - space, diagram.values.max() + space)
    return figure


def main():
    """Read the command line and draw each file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", metavar="results.h5", nargs="+", type=Path)
    parser.add_argument("--quantity", choices=list(LABELS), default="displacement")
    parser.add_argument("--point", choices=list(POINTS), default="tip")
    parser.add_argument("--chain", type=int, default=1, help="which chain, or which values of the other parameters, of several (default 1)")
    parser.add_argument("--out", type=Path, help="picture; default: beside each file, NAME_bifurcation.png")
    arguments = parser.parse_args()
    for path in arguments.files:
        figure = draw(Diagram(path, arguments.quantity, arguments.point, arguments.chain), arguments.quantity)
        plots.save(figure, arguments.out or plots.beside(path, "bifurcation"))


if __name__ == "__main__":
    plots.run(main)
