#!/usr/bin/python3
"""Recovery and coverage of fits, as figures: fit_studies.py PROGRAM [--scenes N] [--draws N]

Recovery: of random scenes with restitution, damping, preload and tip mass, whose Jacobian with columns of length 1 has a
condition below 1e4 at the truth, in how many does a fit of these four to noise-free displacements of the tip find them to
1e-6? The condition comes from a fit in ranges of a millionth around the truth, before the fit itself; scenes that it rejects
are counted. Starts are a Latin hypercube over the whole ranges.

Coverage: of draws of noise on the signal of one scene, how often does the 95 % interval of each parameter hold its truth?
"""

import argparse
import subprocess
import tempfile
from pathlib import Path

import h5py
import numpy as np

RANGES = {"restitution": (0.3, 0.95, ""), "zeta": (0.001, 0.1, "log_"), "preload": (0.0, 0.5, ""),
          "tip_mass_ratio": (0.5, 8.0, "log_")}
SCENE = """&mesh elements = 6, mass = 'auto' /
&damping zeta = {zeta!r} /
&tip_mass ratio = {tip_mass_ratio!r} /
&stop restitution = {restitution!r}, preload = {preload!r} /
&response duration = {duration!r}, step = 0.1 /
"""


def draw(random):
    """The truth of a scene."""
    truth = {}
    for name, (least, most, spacing) in RANGES.items():
        share = random.uniform()
        truth[name] = least*(most/least)**share if spacing else least + (most - least)*share
    truth["duration"] = 20.0*(1.0 + truth["tip_mass_ratio"])**0.5
    return truth


class Study:
    """Runs of the program in a folder."""

    def __init__(self, program, folder):
        self.program = Path(program).resolve()
        self.folder = Path(folder)

    def run(self, name, text):
        """The results of a scene, or None if it failed."""
        path = self.folder/f"{name}.nml"
        path.write_text(text, encoding="utf-8")
        done = subprocess.run([self.program, path, "--quiet", "--out", self.folder], capture_output=True, check=False)
        return self.folder/f"{name}.h5" if done.returncode == 0 else None

    def signal(self, truth):
        """Time and displacement of the tip."""
        with h5py.File(self.run("truth", SCENE.format(**truth))) as file:
            return file["response/time"][()], file["response/displacement_tip"][()]

    def save(self, time, values):
        """The signal as a file."""
        lines = [f"{instant!r} {value!r}\n" for instant, value in zip(time.tolist(), values.tolist())]
        (self.folder/"signal.txt").write_text("".join(lines), encoding="utf-8")

    def fit(self, truth, starts, within=None):
        """Name, estimate, half width, and the condition."""
        ranges = []
        for name, (least, most, spacing) in RANGES.items():
            if within:
                least, most = (truth[name]*(1.0 + side*within) for side in (-1.0, 1.0))
            ranges.append(f"{name}_{spacing}range = {least!r}, {most!r}")
        text = SCENE.format(**truth) + f"&sweep design = 'latin_hypercube', count = {starts}, " + ", ".join(ranges) \
            + " /\n&fit data = 'signal.txt', of = 'displacement_tip'" + (", evaluations = 10" if within else "") + " /\n"
        path = self.run("fit", text)
        if path is None:
            return None
        with h5py.File(path) as file:
            group = file["fit"]
            names = [name.decode() if isinstance(name, bytes) else name for name in group["name"][()]]
            return (dict(zip(names, group["estimate"][()])), dict(zip(names, group["half_width"][()])),
                    float(np.squeeze(group.attrs["condition"])), int(np.squeeze(group.attrs["agreeing_starts"])))


def recovery(study, scenes):
    """Of how many scenes the truth is found."""
    random = np.random.default_rng(42)
    found = rejected = tried = 0
    worst = []
    while tried < scenes:
        truth = draw(random)
        study.save(*study.signal(truth))
        local = study.fit(truth, 1, within=1.0e-6)
        if local is None or not local[2] < 1.0e4:
            rejected += 1
            continue
        tried += 1
        fitted = study.fit(truth, 24)
        error = max(abs(fitted[0][name]/truth[name] - 1.0) for name in RANGES) if fitted else np.inf
        found += error < 1.0e-6
        worst.append(error)
        if error >= 1.0e-6:
            print(f"  scene {tried}: error {error:.1e}, condition {local[2]:.0f}, {truth}", flush=True)
    print(f"recovery: {found} of {tried} scenes to 1e-6, {rejected} rejected by their condition; median error "
          f"{np.median(worst):.1e}", flush=True)


def coverage(study, draws):
    """How often intervals hold the truth."""
    truth = {"restitution": 0.7, "zeta": 0.01, "preload": 0.1, "tip_mass_ratio": 4.0, "duration": 40.0}
    time, values = study.signal(truth)
    random = np.random.default_rng(7)
    held = dict.fromkeys(RANGES, 0)
    for _ in range(draws):
        study.save(time, values + 0.01*random.standard_normal(len(values)))
        estimate, width, _, _ = study.fit(truth, 8)
        for name in RANGES:
            held[name] += abs(estimate[name] - truth[name]) <= width[name]
    print(f"coverage of {draws} draws: " + ", ".join(f"{name} {100.0*count/draws:.1f} %" for name, count in held.items()))


def main():
    """Both studies."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument("--draws", type=int, default=200)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        study = Study(arguments.program, folder)
        coverage(study, arguments.draws)
        recovery(study, arguments.scenes)


if __name__ == "__main__":
    main()
