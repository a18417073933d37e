#!/usr/bin/python3
"""Plot the errors of lambda against the number of elements: a panel for each mode, a colour for each ratio of neighbouring
elements, a line style for each solver. The results files must have several meshes and exact values of the same beam
(inputs/accuracy_frequencies.nml, accuracy_large_meshes.nml)."""

import argparse
from pathlib import Path

import impactbeam_plots as plots
import matplotlib.pyplot as plt
import numpy as np

STYLES = {"dsygv": ("--", "x"), "natural": ("-", "o"), "lanczos": (":", "s"), "auto": ("-.", "^")}
ROUNDING = 2.0**-53


def read(path):
    """Solver, elements, ratio and relative errors (modes) of each column of one file; exact values."""
    with plots.open_results(path) as file:
        group = plots.group_of(file, "frequencies", "&frequencies")
        if "lambda_exact" not in group:
            raise plots.missing(file, "has no exact values: &frequencies reference was not 'exact'")
        exact = group["lambda_exact"][:]
        values = group["lambda"][:]
        names = plots.texts_of(group["column_solver"])
        if values.shape != (len(names), len(exact)):
            values = values.T
        # an exact value of 0, of a beam that turns freely, has no relative error
        errors = np.abs(np.divide(values, exact, where=exact > 0.0, out=np.full(values.shape, np.nan)) - 1.0)
        columns = zip(names, group["column_elements"][:], group["column_ratio"][:], errors)
        return list(columns), exact


def main():
    """Read the command line, draw, write the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", type=Path, nargs="+", help="results files, HDF5")
    parser.add_argument("--modes", type=int, nargs="+", default=[1, 3, 6], help="modes, one panel each")
    parser.add_argument("--out", type=Path, help="picture; default: beside the first file, NAME_accuracy.png")
    arguments = parser.parse_args()

    columns = []
    for path in arguments.files:
        found, exact = read(path)
        columns += found
    most = min(len(errors) for *_, errors in columns)
    modes = [mode for mode in arguments.modes if 1 <= mode <= most and exact[mode - 1] > 0.0]
    if not modes:
        raise plots.Unplottable(f"--modes: all files have modes 1 to {most}, none of those asked for")
    elements = sorted({int(n) for _, n, *_ in columns})
    solvers = list(dict.fromkeys(solver for solver, *_ in columns))
    ratios = sorted({ratio for _, _, ratio, _ in columns})

    figure, panels = plt.subplots(1, len(modes), figsize=(3.4 * len(modes) + 1.4, 3.8), sharey=True, squeeze=False)
    for panel, mode in zip(panels[0], modes):
        for number, ratio in enumerate(ratios):
            for solver in solvers:
                points = sorted((n, errors[mode - 1]) for name, n, r, errors in columns if (name, r) == (solver, ratio))
                line, marker = STYLES.get(solver, ("-", "."))
                panel.loglog(
                    [n for n, _ in points],
                    [max(error, ROUNDING) for _, error in points],
                    line,
                    marker=marker,
                    color=plots.COLOURS[number % len(plots.COLOURS)],
                    markersize=9 if solver == "lanczos" else 5,
                    fillstyle="none" if solver == "lanczos" else "full",
                    label=f"{solver}, r = {ratio:g}",
                )
        panel.axhline(ROUNDING, color="0.6", linewidth=0.8)
        panel.set_title(rf"$\lambda_{{{mode}}}$ = {exact[mode - 1]:.6f}")
        panel.set_xlabel("number of elements $n$")
        if len(elements) <= 6:
            panel.set_xticks(elements, [str(n) for n in elements])
            panel.set_xticks([], minor=True)
        panel.grid(True, which="major", color="0.9")
    panels[0][0].set_ylabel(r"relative error of $\lambda$")
    left = panels[0][0].get_xlim()[0]
    panels[0][0].annotate(
        "rounding of a double", (left, ROUNDING), xytext=(4, 4), textcoords="offset points", fontsize=8, color="0.4"
    )
    panels[0][-1].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8)
    figure.tight_layout()
    plots.save(figure, arguments.out or plots.beside(arguments.files[0], "accuracy"))


if __name__ == "__main__":
    plots.run(main)
