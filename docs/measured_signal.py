"""Make the measured signal of inputs/relay_measured.nml: measured_signal.py PROGRAM OUTPUT

A laser vibrometer on the contact of a relay, as a run of the reed whose parameters stand here gives its velocity: noise of
2 mm/s, a trigger that is 37 us late, a zero that is 4 mm/s off, and a file as such instruments write it.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np

SCENE = """&scene units = 'SI' /
&beam length = 20.0e-3, width = 4.0e-3, height_root = 0.3e-3, youngs_modulus = 205.0e9, density = 7850.0 /
&mesh elements = 8, mass = 'auto' /
&damping stiffness_coefficient = 2.7e-6 /
&tip_mass mass = 400.0e-6 /
&stop surface_height = 0.143e-3, initial_height = 0.5e-3, restitution = 0.62 /
&response duration_time = 6.0e-3, step_time = 1.0e-5 /
&output shape_step = 0.0389 /
"""
DELAY, ZERO, NOISE = 37.0e-6, 4.0e-3, 2.0e-3


def main(program, output):
    """Run the scene and write its signal."""
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder, "truth.nml")
        scene.write_text(SCENE, encoding="utf-8")
        subprocess.run([Path(program).resolve(), scene, "--quiet", "--out", folder], check=True)
        with h5py.File(Path(folder, "truth.h5")) as file:
            shapes = file["shapes"]
            time = shapes["time"][()]
            velocity = shapes["velocity"][()][:, -1]
    noise = NOISE*np.random.default_rng(1977).standard_normal(len(time))
    lines = ["Laser vibrometer, contact of a relay", "Time;Velocity", "ms;mm/s"]
    lines += [f"{1.0e3*(instant + DELAY):.5f};{1.0e3*(value + ZERO):.3f}".replace(".", ",")
              for instant, value in zip(time, velocity + noise)]
    Path(output).write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\r\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
