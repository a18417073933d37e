"""Spectra beside numpy's fast Fourier transform of samples: check_spectra.py PROGRAM FOLDER

A beam that is shaken against a stop which is a spring alone: its force has kinks, so the transform of samples comes nearer
with the square of their distance, that of displacements faster, and both come to what the program computes without samples.
"""

import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

SEGMENT, SEGMENTS = 20.48, 3
STEPS = (0.02, 0.01, 0.005, 0.0025)
# Frequencies of the transform of a segment that are compared
BINS = 24
SCENE = """&mesh elements = 4 /
&damping zeta = 0.01 /
&stop preload = -0.05, law = 'spring_damper', stiffness_ratio = 30, damper_ratio = 0 /
&force position = 1.0, amplitude_ratio = 0.8, frequency_ratio = 0.8 /
&start kind = 'rest' /
&response duration = {duration}, step = {step} /
&spectrum
   of = 'displacement_tip', 'contact_force', segments = {segments}, frequency_ratio_range = {least}, {most}, points = {points} /
"""


def of_samples(values, step):
    """Mean over the segments of the power of windowed samples, as amplitudes and as a density."""
    length = round(SEGMENT/step)
    window = 0.5*(1.0 - np.cos(2.0*np.pi*np.arange(length)/length))
    power = []
    for number in range(SEGMENTS):
        part = values[number*length//2:][:length]
        part = part - np.sum(window*part)/np.sum(window)
        power.append(np.abs(np.fft.rfft(window*part)[1:BINS + 1]*step)**2)
    power = np.mean(power, axis=0)
    return 2.0*np.sqrt(power)/(0.5*SEGMENT), power/(np.pi*0.375*SEGMENT)


def errors_of(program, folder, step):
    """Greatest errors of amplitudes and densities of displacement and force, as shares of the greatest."""
    resolution = 2.0*np.pi/SEGMENT
    scene = folder/"samples.nml"
    scene.write_text(SCENE.format(duration=0.5*SEGMENT*(SEGMENTS + 1), step=step, segments=SEGMENTS, least=repr(resolution),
                                  most=repr(BINS*resolution), points=BINS), encoding="utf-8")
    subprocess.run([program, "--quiet", "--out", folder, scene], check=True, stdin=subprocess.DEVNULL)
    errors = []
    with h5py.File(folder/"samples.h5") as file:
        for history, name in (("displacement_tip", "displacement_tip"), ("contact_force", "contact_force")):
            found = of_samples(file["response"][history][()], step)
            for kind, values in zip(("amplitude", "density"), found):
                ours = file["spectrum"][f"{kind}_{name}"][()]
                errors.append(np.max(np.abs(values - ours))/np.max(ours))
    return errors


def check_sweep(program, folder):
    """The rows of a sweep are the spectra of single runs, in units."""
    scene = """&scene units = 'SI' /
&beam length = 0.06, width = 0.008, height_root = 3e-4, youngs_modulus = 200e9, density = 7850 /
&damping zeta = {zeta} /
&stop surface_height = -1e-4, initial_height = 5e-4 /
&response duration_time = 0.3 /
&spectrum of = 'displacement_tip', 'contact_force', frequency_range = 0, 300, segments = 2 /
{more}
"""
    path = folder/"rows.nml"
    rows, single = [], []
    for zeta, more in ((0.01, "&sweep zeta = 0.02, 0.01 /"), (0.01, "")):
        path.write_text(scene.format(zeta=zeta, more=more), encoding="utf-8")
        subprocess.run([program, "--quiet", "--out", folder, path], check=True, stdin=subprocess.DEVNULL)
        with h5py.File(folder/"rows.h5") as file:
            group = file["sweep_spectrum" if more else "spectrum"]
            for name in ("frequency", "amplitude_displacement_tip", "amplitude_contact_force"):
                values = group[name][()]
                (rows if more else single).append(values[1] if values.ndim == 2 else values)
    if not all(np.allclose(row, one, rtol=1e-9, atol=1e-12*np.max(one)) for row, one in zip(rows, single)):
        sys.exit("rows of a sweep are not the spectra of single runs")


def main(program, folder):
    """Compare orders, and rows of a sweep."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    check_sweep(program, folder)
    errors = np.array([errors_of(program, folder, step) for step in STEPS])
    orders = np.log2(errors[0]/errors[-1])/(len(STEPS) - 1)
    print(errors, orders, sep="\n")
    if not (np.all(orders[:2] > 2.5) and np.all(np.abs(orders[2:] - 2.0) < 0.6) and np.all(errors[-1] < 1e-4)):
        sys.exit("spectra are not those of samples")


if __name__ == "__main__":
    main(*sys.argv[1:])
