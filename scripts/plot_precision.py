#!/usr/bin/python3
"""Plot studies of run time against error (&precision): the error of the motion over the time of a run, one
curve a method, one panel a study; with --beam, its error against the beam itself on every mesh; where a file compares eigen-solvers, the error of lambda_1 over the time
of a solve; with --growth, how cost grows; with --skips, what each skip saves. Computes nothing."""

import argparse
from pathlib import Path

import impactbeam_plots as plots
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import NullFormatter

NAMES = {
    "exact": "exact motion",
    "average_acceleration": "average acceleration",
    "linear_acceleration": "linear acceleration",
    "explicit": "central differences",
}
ERRORS = {
    "history": r"error of the history $\eta(\tau)$",
    "impact_tau": r"error of the first impact, $\Delta\tau$",
    "impact_velocity": "error of the first impact's velocity",
    "energy": "error of the energy",
    "impulse": "error of the contact impulse",
}
ROUNDING = 2.0**-53


def draw_motion(panel, study, error, hop, without_modes, also):
    """The curves of one study, and those of other programs."""
    group = study["motion"]
    methods, varied = (np.array(plots.texts_of(group[name])) for name in ("method", "varied"))
    seconds, errors = group["seconds_motion" if without_modes else "seconds"][:], group[f"error_{error}"][:]
    for number, (method, name) in enumerate(NAMES.items()):
        mine = (methods == method) & ((varied == "step") | (varied == hop)) & (seconds > 0.0)
        if not mine.any():
            continue
        panel.loglog(
            seconds[mine] * 1e3,
            np.maximum(errors[mine], ROUNDING),
            color=plots.COLOURS[number],
            linestyle=plots.DASHES[number],
            marker=plots.MARKERS[number],
            markersize=3.5,
            label=name,
        )
    for number, (name, *numbers) in enumerate(also):
        panel.loglog(
            [float(value) * 1e3 for value in numbers[::2]],
            [float(value) for value in numbers[1::2]],
            color=plots.COLOURS[(len(NAMES) + number) % len(plots.COLOURS)],
            marker="x",
            markersize=4.0,
            label=name,
        )
    panel.set_xlabel("time of a run (ms)")
    panel.set_ylim(1e-17, 1.0)
    panel.axhline(ROUNDING, color="0.6", linewidth=0.6)


def draw_beam(panel, study):
    """Errors against the beam itself: exact motion over the meshes, the steps on every mesh, those on the scene's bold."""
    group, beam = study["motion"], plots.group_of(study, "beam", "against_beam = .true. in &precision")
    methods, varied, masses = (np.array(plots.texts_of(group[name])) for name in ("method", "varied", "mass"))
    seconds, errors, elements = (group[name][:] for name in ("seconds", "error_history", "elements"))
    of_mesh = (varied == "mesh_elements") & (seconds > 0.0)
    for number, mass in enumerate(("consistent", "redistributed")):
        mine = of_mesh & (methods == "exact") & (masses == mass)
        if not mine.any():
            continue
        style = dict(color=plots.COLOURS[number], linestyle=plots.DASHES[number], marker=plots.MARKERS[number])
        panel.loglog(seconds[mine] * 1e3, errors[mine], markersize=3.5, label=f"exact, {mass}", **style)
        for place in zip(seconds[mine] * 1e3, errors[mine], elements[mine]):
            panel.annotate(f"{place[2]}", place[:2], (3, 2), textcoords="offset points", fontsize=6.5, color=style["color"])
    paper = elements[varied == "step"][0] if (varied == "step").any() else 0
    for method in dict.fromkeys(methods[of_mesh & (methods != "exact")]):
        for mesh in sorted(set(elements[of_mesh])):
            mine = of_mesh & (methods == method) & (elements == mesh)
            name = {paper: f"{NAMES[method]}, n = {mesh}", max(elements[of_mesh]): f"{NAMES[method]}, other n"}.get(mesh)
            panel.loglog(
                seconds[mine] * 1e3,
                errors[mine],
                color=plots.COLOURS[2] if mesh == paper else "0.7",
                linewidth=1.4 if mesh == paper else 0.7,
                marker="." if mesh == paper else None,
                label=name,
            )
    panel.axhspan(1e-12, float(beam.attrs["uncertainty"]), color="0.92", zorder=0)
    panel.set_ylim(1e-10, 1.0)
    panel.set_xlabel("time of a run (ms)")


def whole_decades(panel):
    """Let the logarithmic axis of times begin and end at powers of ten, the only ones with numbers."""
    low, high = np.log10(panel.dataLim.intervalx)
    panel.set_xlim(10.0 ** np.floor(low), 10.0 ** np.ceil(high))
    panel.xaxis.set_minor_formatter(NullFormatter())


def draw_solvers(panel, studies):
    """Errors of lambda_1 over the time of a solve, all files together."""
    columns = []
    for group in studies:
        columns += zip(
            plots.texts_of(group["solver"]), group["ratio"][:], group["elements"][:], group["seconds"][:], group["error_first"][:]
        )
    solvers = list(dict.fromkeys(solver for solver, *_ in columns))
    ratios = sorted({ratio for _, ratio, *_ in columns})
    for number, solver in enumerate(solvers):
        for dashes, ratio in zip(plots.DASHES, ratios):
            points = [(s, e) for name, r, _, s, e in columns if (name, r) == (solver, ratio) and e >= 0.0]
            if not points:
                continue
            panel.loglog(
                [s * 1e3 for s, _ in points],
                [max(e, ROUNDING) for _, e in points],
                color=plots.COLOURS[number],
                linestyle=dashes,
                marker=plots.MARKERS[number],
                markersize=3.5,
                label=f"{solver}, r = {ratio:g}",
            )
    panel.axhline(ROUNDING, color="0.6", linewidth=0.6)
    panel.set_xlabel("time of a solve (ms)")
    panel.set_ylabel(r"relative error of $\lambda_1$")
    panel.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))


def draw_growth(study, title):
    """A panel for each abscissa of the curves of growth."""
    curves = [study[f"growth/curve_{i + 1}"] for i in range(len(study["growth"]))]
    names = [plots.text_of(curve["x"].attrs["long_name"]) for curve in curves]
    times = [curve for curve in curves if plots.text_of(curve["y"].attrs["units"]) == "s"]
    kinds = [name for name in dict.fromkeys(names)]
    figure, panels = plt.subplots(1, len(kinds), figsize=(2.9 * len(kinds), 3.6), squeeze=False)
    for panel, kind in zip(panels[0], kinds):
        mine = [curve for curve, name in zip(curves, names) if name == kind and curve in times]
        for number, curve in enumerate(mine):
            panel.loglog(
                curve["x"][:],
                curve["y"][:],
                color=plots.COLOURS[number],
                linestyle=plots.DASHES[number],
                marker=plots.MARKERS[number],
                markersize=3.5,
                label=f"{plots.text_of(curve.attrs['name'])}: {float(curve.attrs['exponent']):.2f}",
            )
        for axis, limits in ((panel.xaxis, panel.set_xlim), (panel.yaxis, panel.set_ylim)):
            low, high = axis.get_minpos(), axis.get_data_interval()[1]  # a difference of two times can be negative
            if low <= high:
                limits(10.0 ** np.floor(np.log10(low)), 10.0 ** np.ceil(np.log10(high)))
        panel.xaxis.set_minor_formatter(NullFormatter())
        panel.yaxis.set_minor_formatter(NullFormatter())
        panel.set_xlabel({"duration": r"length of the run, $\tau$"}.get(kind, f"number of {kind}"))
        panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), fontsize=7.5, handlelength=2.2)
    panels[0][0].set_ylabel("time (s); fitted exponents below")
    panels[0][0].set_title(title)
    figure.tight_layout()
    return figure


def difference_text(value):
    """A difference of answers, one digit."""
    if value < 0.0:
        return "no answer"
    if value == 0.0:
        return "0"
    digit, exponent = f"{value:.0e}".split("e")
    return rf"${digit}\cdot 10^{{{int(exponent)}}}$"


def draw_skips(files, studies):
    """A panel a study: the time without each skip (hollow) and with it (full), and the difference of the answers."""
    groups = [plots.group_of(study, "skips", "skips = .true. in &precision") for study in studies]
    heights = [0.26 * len(group["name"]) for group in groups]
    figure, panels = plt.subplots(
        len(groups),
        1,
        figsize=(plots.WIDTH, sum(heights) + 0.6 * len(groups)),
        height_ratios=heights,
        sharex=True,
        squeeze=False,
    )
    for panel, file, group in zip(panels[:, 0], files, groups):
        places = np.arange(len(group["name"]))
        without, used = group["seconds_without"][:] * 1e3, group["seconds_with"][:] * 1e3
        panel.hlines(places, used, without, color="0.75", linewidth=4.0)
        panel.semilogx(without, places, "o", color=plots.COLOURS[1], markerfacecolor="white")
        panel.semilogx(used, places, "o", color=plots.COLOURS[2])
        panel.set_ylim(len(places) - 0.4, -0.6)
        panel.set_yticks(places, plots.texts_of(group["name"]))
        panel.tick_params(axis="y", which="both", length=0)
        panel.set_title(plots.title_of(file))
        panel.annotate("difference", (1.03, 1.0), (0, 6), xycoords="axes fraction", textcoords="offset points")
        for place, difference in zip(places, group["difference"][:]):
            place = (1.03, place)
            panel.annotate(difference_text(difference), place, xycoords=("axes fraction", "data"), va="center", fontsize=9)
    panels[-1, 0].set_xlabel("time without the skip (hollow) and with it (filled) (ms)")
    figure.tight_layout()
    return figure


def main():
    """Read the command line, draw, write the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", type=Path, nargs="+", help="results files of scenes with &precision")
    parser.add_argument("--error", choices=list(ERRORS), default="history", metavar="ERROR",
                        help=f"which error of the motion: {', '.join(ERRORS)} (default: history)")
    parser.add_argument("--without-modes", action="store_true", help="times without that of the eigen-solve")
    parser.add_argument("--also", nargs="+", action="append", default=[], metavar=("NAME", "SECONDS ERROR"),
                        help="times and errors of another program, in pairs")
    parser.add_argument("--growth", action="store_true", help="growth of cost, of the first file")
    parser.add_argument("--beam", action="store_true", help="the error against the beam itself")
    parser.add_argument("--skips", action="store_true", help="what each skip saves")
    parser.add_argument("--out", type=Path, help="picture; default: beside the first file, NAME_precision.png")
    arguments = parser.parse_args()

    files = [plots.open_results(path) for path in arguments.files]
    studies = [plots.group_of(file, "precision", "&precision") for file in files]
    motions = [(file, study) for file, study in zip(files, studies) if "motion" in study]
    if arguments.growth:
        if "growth" not in studies[0] or len(studies[0]["growth"]) == 0:
            raise plots.Unplottable(f"{files[0].filename}: has no growth: &precision has no scaling_elements")
        figure = draw_growth(studies[0], plots.title_of(files[0]))
    elif arguments.skips:
        figure = draw_skips(files, studies)
    elif motions:
        figure, panels = plt.subplots(
            1, len(motions), figsize=(max(plots.WIDTH, 3.2 * len(motions)), 3.9), sharey=True, squeeze=False
        )
        for panel, (file, study) in zip(panels[0], motions):
            varied = np.array(plots.texts_of(study["motion/varied"]))
            modes = (varied == "hop_tolerance").sum() <= 1 and (varied == "mode_tolerance").any()
            if arguments.beam:
                draw_beam(panel, study)
            else:
                draw_motion(panel, study, arguments.error, "mode_tolerance" if modes else "hop_tolerance", arguments.without_modes,
                            arguments.also)
            if np.ptp(np.log10(panel.xaxis.get_data_interval())) < 1.0:
                whole_decades(panel)
            panel.set_title(plots.title_of(file))
        panels[0][0].set_ylabel(ERRORS["history" if arguments.beam else arguments.error])
        panels[0][0 if arguments.beam else -1].legend(loc="best")
        figure.tight_layout()
    else:
        figure, panel = plt.subplots(figsize=(plots.WIDTH, 3.9))
        draw_solvers(panel, [plots.group_of(study, "solvers", "&frequencies") for study in studies])
        panel.set_title(plots.title_of(files[0]))
    plots.save(figure, arguments.out or plots.beside(arguments.files[0], "precision"))


if __name__ == "__main__":
    plots.run(main)
