#!/usr/bin/python3
"""Plot spectra. Of a run: amplitude over frequency of each signal, its lines marked with the multiple of the load's
frequency that each is (1/2, 3/2: subharmonics and what goes with them), or with --density the power spectral density and
its 95 % interval. Of a sweep or of cases: a map of amplitudes over frequency and parameter. Of a file without &spectrum, or
with --response: amplitude and phase without contacts (&frequency_response), and natural frequencies if the file has them.

Plots what the results files hold and computes nothing.
"""

import argparse
from pathlib import Path

import impactbeam_plots as plots
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.ticker import MultipleLocator


# Lines that have their multiple written beside them, and the share of the greatest below which a map is empty.
MOST_LABELS, LEAST_SHARE = 8, 1e-4
# Multiples of the frequency that a sweep varies, drawn over a map.
GUIDES = (0.5, 1.0, 1.5, 2.0, 3.0)


class Signal:
    """The spectrum of one signal of a run."""

    def __init__(self, group, name):
        self.name = name
        self.amplitude = group[f"amplitude_{name}"][()]
        self.unit = plots.unit_of(group, f"amplitude_{name}")
        self.density = group[f"density_{name}"][()]
        self.density_unit = plots.unit_of(group, f"density_{name}")
        width = f"density_{name}_half_width"
        self.half_width = group[width][()] if width in group else None
        lines = group[f"lines_{name}"]
        self.lines = []
        if "line" in lines:
            columns = [lines[plots.named(lines, column)][()] for column in ("omega", "amplitude", "multiple", "over", "load")]
            self.lines = list(zip(*columns))


class Run:
    """What a picture shows of the spectra of one run."""

    def __init__(self, path, names):
        with plots.open_results(path) as file:
            group = plots.group_of(file, "spectrum", "&spectrum")
            self.title = plots.title_of(file)
            if not plots.has(group, "omega"):
                raise plots.missing(file, "its run has no segments, and so no spectra")
            self.frequency = plots.values_of(group, "omega")
            self.unit = plots.unit_of(group, "omega")
            self.load = plots.values_of(group, "load_omega") if plots.has(group, "load_omega") else np.array([])
            self.signals = [Signal(group, name) for name in chosen(path, group, names)]


class Map:
    """Amplitudes of one signal over frequency, case by case."""

    def __init__(self, path, name):
        with plots.open_results(path) as file:
            self.title = plots.title_of(file)
            if "cases" in file:
                self.read_cases(path, file["cases"], name)
            else:
                self.read_sweep(path, file, name)
        if not np.any(np.isfinite(self.amplitude)):
            raise plots.Unplottable(f"{path}: none of its cases has a spectrum")
        if len(self.values) < 2:
            raise plots.Unplottable(f"{path}: has the spectrum of one case: a map needs two")
        factor, unit = plots.reading(np.max(self.frequency), self.unit)
        if self.value_unit == self.unit:
            self.values, self.value_unit = factor*self.values, unit
        self.frequency, self.unit = factor*self.frequency, unit

    def read_sweep(self, path, file, name):
        """Rows of a sweep of one parameter; of several the others stay at their first values."""
        sweep = plots.group_of(file, "sweep", "&sweep")
        group = plots.group_of(file, "sweep_spectrum", "&spectrum")
        self.name = chosen(path, group, [name] if name else None)[0]
        # parameters that are tied to others have no axis of their own
        names = sweep.attrs["grid_parameters" if "grid_parameters" in sweep.attrs else "parameters"]
        names = [word.strip() for word in plots.text_of(names).split(",")]
        self.parameter = names[-1]
        keep = np.ones(len(sweep[names[0]]), bool)
        for other in names[:-1]:
            keep &= sweep[other][()] == sweep[other][0]
            unit = plots.text_of(sweep[other].attrs["units"])
            self.title += f"\n{other.replace('_', ' ')} = {plots.quantity(sweep[other][0], '' if unit == '1' else unit)}"
        self.values = sweep[self.parameter][keep]
        self.value_unit = plots.text_of(sweep[self.parameter].attrs["units"])
        # each parameter that varies together with this one: its values and unit
        self.partners = {other: (sweep[other][keep], plots.text_of(sweep[other].attrs["units"]))
                         for other in plots.varied_with(file, self.parameter)}
        self.frequency, self.unit = plots.values_of(group, "omega"), plots.unit_of(group, "omega")
        self.amplitude = group[f"amplitude_{self.name}"][keep]
        self.amplitude_unit = plots.unit_of(group, f"amplitude_{self.name}")

    def read_cases(self, path, group, name):
        """Each case has its own group."""
        self.parameter = plots.text_of(group.attrs["parameter"])
        numbers = plots.cases_that_ran(group)
        self.values = group[self.parameter][()][np.array(numbers) - 1]
        self.value_unit = plots.text_of(group[self.parameter].attrs["units"])
        self.partners = {}
        spectra = [plots.group_of(group[f"case_{number}"], "spectrum", "&spectrum") for number in numbers]
        self.name = chosen(path, spectra[0], [name] if name else None)[0]
        self.frequency, self.unit = plots.values_of(spectra[0], "omega"), plots.unit_of(spectra[0], "omega")
        # with units, equal ratios are other frequencies in a case of another beam: beyond its own it has no amplitude
        rows = [np.interp(self.frequency, plots.values_of(one, "omega"), one[f"amplitude_{self.name}"][()], np.nan, np.nan)
                for one in spectra]
        self.amplitude, self.amplitude_unit = np.array(rows), plots.unit_of(spectra[0], f"amplitude_{self.name}")


class Response:
    """What a picture shows of the response without contacts: amplitude and phase of each point over the frequency of the loads."""

    def __init__(self, path):
        with plots.open_results(path) as file:
            group = plots.group_of(file, "frequency_response", "&frequency_response")
            self.title = plots.title_of(file)
            self.frequency, self.unit = plots.values_of(group, "omega"), plots.unit_of(group, "omega")
            self.is_logarithmic = plots.text_of(file["scene/frequency_response"].attrs["logarithmic"]) == ".true."
            self.amplitude_unit = plots.unit_of(group, "amplitude_tip")
            self.natural = plots.values_of(file["frequencies"], "omega")[:, 0] if "frequencies" in file else []
            along = plots.Along(file, self.amplitude_unit)
            curves, surface = {"tip": [group[f"{kind}_tip"][()] for kind in ("amplitude", "phase")]}, 0
            for stop, (position, side, _) in enumerate(plots.stops_of(file["scene"])[0], 1):
                curves[f"stop {stop}, {along.place(position)}"] = [group[f"{kind}_stop"][:, surface] for kind in ("amplitude", "phase")]
                surface += 2 if side == "both" else 1
            for body in range(len(group["body"]) if "body" in group else 0):
                curves[f"body {body + 1}"] = [group[f"{kind}_body"][:, body] for kind in ("amplitude", "phase")]
            # a stop at the tip, or at the place of another one, has the same curve, and a body without a load has none
            self.curves = {label: curve for number, (label, curve) in enumerate(curves.items()) if label == "tip" or not any(
                np.allclose(curve[0], other, rtol=1e-9, atol=0.0) for other in [0.0, *(one[0] for one in list(curves.values())[:number])])}


def chosen(path, group, names):
    """The signals that are asked for, of those that are there."""
    there = [name for name in plots.SPECTRA if f"amplitude_{name}" in group]
    for name in names or []:
        if name not in there:
            raise plots.Unplottable(f"{path}: has no spectrum of {name}, but of {', '.join(there)}")
    return names or there


def words_of(multiple, over, load, loads):
    """A multiple of a load's frequency, and of which where there are several."""
    words = str(multiple) if over == 1 else f"{multiple}/{over}"
    return words if loads == 1 else f"{words}$_{{{load}}}$"


def draw_amplitude(axes, run, signal, factor):
    """Amplitudes, and the strongest lines with their multiples."""
    scale, unit = plots.reading(np.max(signal.amplitude), signal.unit)
    axes.semilogy(factor*run.frequency, scale*signal.amplitude, color=plots.COLOURS[2], linewidth=0.8)
    for number, (frequency, amplitude, multiple, over, load) in enumerate(signal.lines):
        colour = plots.COLOURS[1] if over > 1 else plots.COLOURS[0]
        axes.plot(factor*frequency, scale*amplitude, "o", markersize=2.6, color=colour)
        if load > 0 and number < MOST_LABELS:
            axes.annotate(words_of(multiple, over, load, len(run.load)), (factor*frequency, scale*amplitude), xytext=(0, 3),
                          textcoords="offset points", ha="center", va="bottom", fontsize=7.5, color=colour)
    greatest = scale*np.max(signal.amplitude)
    axes.set_ylim(max(1e-6*greatest, 0.5*scale*np.min(signal.amplitude[signal.amplitude > 0.0])), 4.0*greatest)
    axes.set_ylabel(plots.with_unit(plots.SPECTRA[signal.name], unit))


def draw_density(axes, run, signal, factor):
    """The density, in its interval where there is one."""
    axes.semilogy(factor*run.frequency, signal.density, color=plots.COLOURS[2], linewidth=0.8)
    greatest = np.max(signal.density)
    least = max(1e-12*greatest, 0.5*np.min(signal.density[signal.density > 0.0]))
    if signal.half_width is not None:
        axes.fill_between(factor*run.frequency, np.maximum(signal.density - signal.half_width, least),
                          signal.density + signal.half_width, color=plots.COLOURS[2], alpha=0.3, linewidth=0.0)
    axes.set_ylim(least, 4.0*greatest)
    axes.set_ylabel(plots.with_unit("density of\n" + plots.SPECTRA[signal.name].replace("\n", " "),
                                   signal.density_unit.replace("^2", "\u00b2")))


def say_zero(axes):
    """Words in place of curves."""
    axes.set_yticks([])
    axes.text(0.5, 0.5, "zero at all frequencies", ha="center", va="center", transform=axes.transAxes)


def label_frequency(axes, found):
    """The axis of frequencies; returns the factor by which they are multiplied."""
    factor, unit = plots.reading(np.max(found.frequency), found.unit)
    axes.set_xlabel(plots.with_unit("frequency" if unit else r"frequency $\omega/\omega_1$", unit))
    axes.set_xlim(factor*found.frequency[0], factor*found.frequency[-1])
    return factor


def draw_response(response):
    """Amplitudes, and below them phases; dotted lines at natural frequencies, with the number of the mode."""
    figure, (upper, lower) = plt.subplots(2, 1, sharex=True, layout="constrained", figsize=(plots.WIDTH, 4.8),
                                          height_ratios=[2.0, 1.0])
    upper.set_title(response.title, pad=14)
    lower.set_xscale("log" if response.is_logarithmic else "linear")
    factor = label_frequency(lower, response)
    if response.is_logarithmic:
        plots.set_decades(lower.xaxis)
    scale, unit = plots.reading(max(np.max(amplitude) for amplitude, _ in response.curves.values()), response.amplitude_unit)
    for number, (label, (amplitude, phase)) in enumerate(response.curves.items()):
        # an amplitude of 0 has no place on a logarithmic axis, and no phase
        there = np.where(amplitude > 0.0, 1.0, np.nan)
        upper.plot(factor*response.frequency, there*scale*amplitude, label=label, **plots.line_of(number))
        lower.plot(factor*response.frequency, there*np.unwrap(phase, period=360.0), **plots.line_of(number))
    inside = [mode for mode, frequency in enumerate(response.natural) if response.frequency[0] <= frequency <= response.frequency[-1]]
    for number, mode in enumerate(inside):
        for axes in (upper, lower):
            axes.axvline(factor*response.natural[mode], color=plots.COLOURS[5], linewidth=0.8, linestyle=(0, (1, 1.5)), zorder=0,
                         label="" if number else "natural frequencies")
        upper.annotate(str(mode + 1), (factor*response.natural[mode], 1.0), xycoords=("data", "axes fraction"), xytext=(0, 2),
                       textcoords="offset points", ha="center", va="bottom", fontsize=7.5)
    if any(np.any(amplitude > 0.0) for amplitude, _ in response.curves.values()):
        upper.set_yscale("log")
        plots.set_decades(upper.yaxis)
        upper.legend(loc="best")
    else:
        say_zero(upper)
    upper.set_ylabel(plots.with_unit("amplitude without contacts", unit))
    lower.set_ylabel("phase (degrees)")
    lower.yaxis.set_major_locator(MultipleLocator(45.0*2.0**max(0.0, np.ceil(np.log2(np.ptp(lower.get_ylim())/270.0)))))
    return figure


def draw_run(run, with_density):
    """A panel for each signal."""
    figure, rows = plt.subplots(len(run.signals), 1, sharex=True, squeeze=False, layout="constrained",
                                figsize=(plots.WIDTH, 1.0 + 2.2*len(run.signals)))
    factor = label_frequency(rows[-1, 0], run)
    for axes, signal in zip(rows[:, 0], run.signals):
        if not np.any(signal.amplitude > 0.0):
            axes.set_ylabel(plots.SPECTRA[signal.name])
            say_zero(axes)
            continue
        (draw_density if with_density else draw_amplitude)(axes, run, signal, factor)
    rows[0, 0].set_title(run.title)
    return figure


def draw_map(found):
    """Amplitudes as colours; where a frequency is varied, its multiples."""
    scale, unit = plots.reading(np.nanmax(found.amplitude), found.amplitude_unit)
    greatest = scale*np.nanmax(found.amplitude)
    figure, axes = plt.subplots(layout="constrained", figsize=(plots.WIDTH, 4.6))
    order = np.argsort(found.values)
    values = plots.numbered_if_repeated(found.values[order])
    drawn = axes.pcolormesh(found.frequency, values, np.maximum(scale*found.amplitude[order], LEAST_SHARE*greatest),
                            norm=LogNorm(LEAST_SHARE*greatest, greatest), cmap="magma", shading="nearest", rasterized=True)
    figure.colorbar(drawn, ax=axes, label=plots.with_unit("amplitude, " + plots.SPECTRA[found.name].replace("\n", " "), unit))
    # where they would lie close together the lines speak for themselves
    are_apart = found.frequency[-1] < 6.0*values[-1]
    if "frequency" in found.parameter and found.value_unit == (found.unit or "1") and are_apart and \
            np.array_equal(values, found.values[order]):
        for guide in GUIDES:
            axes.plot(guide*values, values, color="#ffffff", linewidth=0.6, linestyle=plots.DASHES[1 if guide >= 1.0 else 2],
                      alpha=0.7)
            if found.frequency[0] < guide*values[-1] < 0.96*found.frequency[-1]:
                axes.annotate(f"{guide:g}", (guide*values[-1], values[-1]), xytext=(0, 2), textcoords="offset points",
                              ha="center", va="bottom", fontsize=7.5)
    axes.set_xlim(found.frequency[0], found.frequency[-1])
    axes.set_ylim(values[0], values[-1])
    axes.tick_params(which="both", color="#ffffff")
    axes.set_xlabel(plots.with_unit("frequency" if found.unit else r"frequency $\omega/\omega_1$", found.unit))
    shown = {found.parameter: (found.values, found.value_unit), **found.partners}
    axes.set_ylabel("\n".join(plots.with_unit(plots.words_of(name), "" if unit == "1" else unit)
                              for name, (_, unit) in shown.items()))
    plots.set_ticks_together(axes, "y", [column[order] for column, _ in shown.values()], values)
    axes.set_title(found.title, pad=14)
    return figure


def main():
    """Read the command line and draw each file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", metavar="results.h5", nargs="+", type=Path)
    parser.add_argument("--signals", nargs="+", choices=list(plots.SPECTRA), metavar="SIGNAL",
                        help=f"which of {', '.join(plots.SPECTRA)} (default all; of a map the first)")
    parser.add_argument("--density", action="store_true", help="the power spectral density instead of amplitudes")
    parser.add_argument("--response", action="store_true", help="amplitude and phase without contacts, beside spectra in the file")
    parser.add_argument("--out", type=Path, help="picture; default: beside each file, _spectrum.png")
    arguments = parser.parse_args()
    plt.rcParams.update(plots.STYLE)
    for path in arguments.files:
        with plots.open_results(path) as file:
            kinds = set(file)
        if arguments.response or ("frequency_response" in kinds and not kinds & {"spectrum", "sweep_spectrum"}):
            figure = draw_response(Response(path))
        elif kinds & {"sweep", "cases"}:
            figure = draw_map(Map(path, arguments.signals[0] if arguments.signals else None))
        else:
            figure = draw_run(Run(path, arguments.signals), arguments.density)
        plots.save(figure, arguments.out or path.with_name(path.stem + "_spectrum.png"))


if __name__ == "__main__":
    plots.run(main)
