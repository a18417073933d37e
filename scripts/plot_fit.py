#!/usr/bin/python3
"""Plot a fit: the signal and the model above, the residuals below, and for each pair of parameters the 95 % ellipse around
the estimates, with the ends of the starts that ended nearby.
"""

import argparse
import itertools
from pathlib import Path

import impactbeam_plots as plots
import matplotlib.pyplot as plt
import numpy as np

# Half widths of the 95 % region of two parameters in standard errors: sqrt of chi squared with two degrees of freedom
TWO_AT_ONCE = 2.4477
MOST_PAIRS = 15


class Fit:
    """What a picture shows of one file."""

    def __init__(self, path):
        with plots.open_results(path) as file:
            group = plots.group_of(file, "fit", "&fit")
            self.title = plots.title_of(file)
            self.quantity = plots.SIGNALS[plots.text_of(group.attrs["of"])].replace("\n", " ")
            self.is_numbered = plots.text_of(group.attrs["of"]) in ("impact_times", "rebound_peaks")
            self.names = [plots.text_of(name) for name in group["name"][()]]
            self.units = [plots.text_of(unit) for unit in group["unit"][()]]
            self.estimate = group["estimate"][()]
            self.is_told = group["is_told"][()] == 1
            self.covariance = group["joint/covariance"][()]
            signal = group["signal"]
            self.unit = plots.text_of(signal["measured"].attrs["units"])
            self.time_unit = plots.text_of(signal["time"].attrs["units"])
            self.time, self.measured, self.model, self.residual = (
                signal[name][()] for name in ("time", "measured", "model", "residual"))
            self.ended = [group["starts"][name][()] for name in self.names]

    def pairs(self):
        """Numbers of the parameters of each pair that is drawn; of many pairs, those with the closest correlation."""
        told = [number for number in range(len(self.names)) if self.is_told[number]]
        pairs = list(itertools.combinations(told, 2))
        error = np.sqrt(np.diag(self.covariance))
        closest = sorted(pairs, key=lambda pair: -abs(self.covariance[pair])/(error[pair[0]]*error[pair[1]]))
        return [pair for pair in pairs if pair in closest[:MOST_PAIRS]]


def draw_signal(upper, lower, fit):
    """Data and model, and their difference."""
    (time, time_unit), (measured, unit), (residual, residual_unit) = (
        plots.reading_of(values, own) for values, own in ((fit.time, fit.time_unit), (fit.measured, fit.unit), (fit.residual, fit.unit)))
    upper.plot(time*fit.time, measured*fit.measured, linestyle="none", marker=".", markersize=2.2, color=plots.COLOURS[5], label="signal")
    upper.plot(time*fit.time, measured*fit.model, color=plots.COLOURS[1], linewidth=0.9, label="model")
    upper.set_ylabel(plots.with_unit(fit.quantity, unit))
    upper.tick_params(labelbottom=False)
    upper.legend(loc="upper left" if fit.is_numbered else "upper right", ncols=2)
    upper.set_title(fit.title)
    lower.plot(time*fit.time, residual*fit.residual, linestyle="none", marker=".", markersize=2.2, color=plots.COLOURS[0])
    lower.axhline(0.0, color=plots.COLOURS[1], linewidth=0.7)
    lower.set_ylabel(plots.with_unit("residual", residual_unit))
    lower.set_xlabel(plots.with_unit("number" if fit.is_numbered else "time", time_unit))
    lower.figure.align_ylabels([upper, lower])


def draw_pair(axes, fit, first, second):
    """The ellipse of two parameters, and the ends of starts in its neighbourhood."""
    part = fit.covariance[np.ix_([first, second], [first, second])]
    correlation = part[0, 1]/np.sqrt(part[0, 0]*part[1, 1])
    angle = np.linspace(0.0, 2.0*np.pi, 200)
    circle = TWO_AT_ONCE*np.array([np.cos(angle), correlation*np.cos(angle) + np.sqrt(max(1.0 - correlation**2, 0.0))*np.sin(angle)])
    factors, units = zip(*(plots.reading_of(fit.estimate[number], fit.units[number]) for number in (first, second)))
    error = np.sqrt(np.diag(part))*factors
    centre = fit.estimate[[first, second]]*factors
    ended = [fit.ended[number]*factor for number, factor in zip((first, second), factors)]
    axes.plot(centre[0] + error[0]*circle[0], centre[1] + error[1]*circle[1], color=plots.COLOURS[2])
    near = (np.abs(ended[0] - centre[0]) < 6.0*error[0]) & (np.abs(ended[1] - centre[1]) < 6.0*error[1])
    axes.plot(ended[0][near], ended[1][near], linestyle="none", marker="x", markersize=4,
              color=plots.COLOURS[0])
    axes.set_xlabel(plots.with_unit(fit.names[first], units[0]), fontsize=8)
    axes.set_ylabel(plots.with_unit(fit.names[second], units[1]), fontsize=8)
    axes.ticklabel_format(useOffset=False, style="plain")
    axes.locator_params(nbins=4)


def draw(fit):
    """The figure of one file."""
    pairs = fit.pairs()
    rows = -(-len(pairs)//3)
    figure = plt.figure(figsize=(plots.WIDTH, 4.2 + 2.1*rows), layout="constrained")
    parts = figure.subfigures(2 if rows else 1, 1, height_ratios=[4.2, 2.1*rows] if rows else None, squeeze=False)[:, 0]
    upper, lower = parts[0].subplots(2, 1, height_ratios=[2.4, 1.0], sharex=True)
    draw_signal(upper, lower, fit)
    if rows:
        parts[1].suptitle("95 % regions of each two parameters; x: estimates, and ends of other starts nearby", fontsize=9, x=0.02, ha="left")
        grid = parts[1].subplots(rows, min(3, len(pairs)), squeeze=False)
        for axes, (first, second) in zip(grid.flat, pairs):
            draw_pair(axes, fit, first, second)
        for axes in list(grid.flat)[len(pairs):]:
            axes.set_axis_off()
    return figure


def main():
    """Read the command line and draw each file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", metavar="results.h5", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, help="picture; default: beside each file, _fit.png")
    arguments = parser.parse_args()
    plt.rcParams.update(plots.STYLE)
    for path in arguments.files:
        plots.save(draw(Fit(path)), arguments.out or path.with_name(path.stem + "_fit.png"))


if __name__ == "__main__":
    plots.run(main)
