"""Compare published values and closed forms with what the programs compute now: checks.py FOLDER_OF_PROGRAMS PLACE PAGE.md

Runs the scenes inputs/check_*.nml, the paper's tables and its statements, and writes a page. What is out of its bound is
red, and then the status is 1. Every command can be given by hand.
"""

import json
import math
import re
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
INPUTS = ROOT / "inputs"

# Scene, source, published values (lambda, or its power times a factor), power, factor, allowed relative error
FREQUENCIES = [
    ("wedge", "handbook", [5.3151, 15.2072, 30.0198, 49.763], 2, 0.5, 1e-5),
    ("half_height", "handbook", [3.82378, 18.3173, 47.2648], 2, 0.75, 3e-6),
    ("tip_mass", "handbook, as heavy as the beam", [1.24792, 4.03114, 7.13413], 1, 1.0, 5e-6),
    ("root_spring", "the same equation", [1.24792, 4.03114, 7.13413], 1, 1.0, 5e-6),
    ("pinned", "tan = tanh", [0.0, 3.926602, 7.068583, 10.210176], 1, 1.0, 2e-7),
    ("cone", "J2 I3 + I2 J3 = 0", [8.71925885507989, 21.145662387869, 38.453771227733, 60.680138775097], 2, 0.5, 5e-6),
    ("stepped", "determinant in 50 digits", [4.18114506674444, 14.8679456451703, 44.0955186798335, 81.7707784984949], 2, 0.75,
     2e-6),
    ("intermediate_mass", "determinant in 50 digits", [1.6854653633821, 3.74435858361445, 6.06488626494863, 9.75699306143877], 1,
     1.0, 5e-7),
    ("double_taper", "Mabie and Rogers 1972", [23.289, 73.9, 165.23, 299.7, 478.1], 2, 2.5, 3.5e-4),
    ("double_taper", "determinant", [23.292263488, 73.9188190862, 165.28537027, 299.779884523, 478.18008908], 2, 2.5, 3e-6),
]
SWING = [-2.66, -4.33, -4.92, -4.78, -3.82, -2.87, -2.71, -3.09, -3.41, -3.36, -2.64, -0.742]


class Page:
    """Rows, and whether all are good."""

    def __init__(self, programs, place):
        self.programs, self.place, self.lines, self.is_good = Path(programs), Path(place), [], True
        self.place.mkdir(parents=True, exist_ok=True)

    def run(self, scene, program="impactbeam", folder=INPUTS):
        """The results file of a scene."""
        subprocess.run([self.programs / program, "--quiet", "--out", self.place, folder / f"{scene}.nml"], check=True,
                       stdin=subprocess.DEVNULL)
        return h5py.File(self.place / f"{scene}.h5")

    def head(self, title, columns):
        """A table begins."""
        self.lines += ["", f"## {title}", "", "| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]

    def row(self, is_good, *cells):
        """A row of it, red where it fails."""
        self.is_good = self.is_good and bool(is_good)
        verdict = "good" if is_good else '<span style="color:red"><b>fails</b></span>'
        self.lines.append("| " + " | ".join([*map(str, cells), verdict]) + " |")

    def compare(self, name, what, published, ours, bound):
        """Lists of figures, each within a bound of its own size."""
        published, ours = np.atleast_1d(published).astype(float), np.atleast_1d(ours).astype(float)
        difference = np.max(np.abs(ours - published) / np.where(published == 0, 1.0, np.abs(published)))
        self.row(difference <= bound, f"`check_{name}`", what, words(published), words(ours), f"{difference:.1e}", f"{bound:.1e}")


def words(numbers):
    """A list in a cell."""
    return " ".join(f"{number:.10g}" for number in numbers)


def frequencies(page):
    """Natural frequencies."""
    page.head("Frequencies", ["scene", "after", "published", "computed", "difference", "bound", ""])
    for name, after, published, power, factor, bound in FREQUENCIES:
        with page.run(f"check_{name}") as file:
            found = file["frequencies/lambda"][: len(published), 0]
        page.compare(name, after, published, factor * np.nan_to_num(found) ** power, bound)


def motions(page):
    """Closed forms and published problems of motion."""
    page.head("Motion", ["scene", "after", "published", "computed", "difference", "bound", ""])
    with page.run("check_mass_on_springs") as file:
        events = file["events/time"][()]
        force, impulse = (file["measures"][name][()] for name in ("greatest_force", "greatest_impulse"))
    held, free = math.sqrt(100 / 1.01e6), math.sqrt(100 / 1e4)
    expected = [math.pi * ((i + 1) // 2 * held + i // 2 * free) for i in range(6)]
    page.compare("mass_on_springs", "three contacts and separations, closed form, s", expected, events, 1e-10)
    page.compare("mass_on_springs", "maximum force, N", [1e6 * held], [force], 1e-11)
    page.compare("mass_on_springs", "its impulse, N s", [2e6 * held**2], [impulse], 1e-11)
    with page.run("check_one_impact") as file:
        events, speed = file["events/time"][()], file["events/velocity_after"][()]
    page.compare("one_impact", "period, closed form, s (the first three of a motion that is not stable)", [2.41660973353061] * 3,
                 np.diff(events)[:3], 1e-11)
    page.compare("one_impact", "velocity after impacts, m/s", [0.1720680596549182] * 3, speed[:3], 1e-11)
    with page.run("check_orbit_unstable") as file:
        multipliers = file["orbit/multiplier_real"][()]
    page.compare("orbit_unstable", "Floquet multipliers of that motion, closed form", [-4.766284172064514, -0.13427650909928524], multipliers, 1e-10)
    with page.run("check_orbit_doubling") as file:
        branch = file["orbit/branch_1"]
        doubles = branch["parameter"][()][branch["mark"][()] == 2]
    page.compare("orbit_doubling", "where a multiplier is -1, closed form, Hz", [0.42229340662982373], doubles, 1e-9)
    with page.run("check_orbit_grazing") as file:
        orbit, branch = file["orbit"], file["orbit/branch_1"]
        after = 0.8 * orbit.attrs["least_impact_speed"]
        multiplier = [orbit[name][0] for name in ("multiplier_real", "multiplier_imaginary")]
        amplitude, mark = branch["parameter"][()], branch["mark"][()]
    page.compare("orbit_grazing", "Dankowicz and Schilder 2013, example 15.2: velocity after the impact, m/s", [1.36], [after], 0.0037)
    page.compare("orbit_grazing", "the same, closed form", [1.356586350075906], [after], 1e-10)
    page.compare("orbit_grazing", "its Floquet multiplier, closed form", [-0.5842953143415296, 0.005600351492473558], multiplier, 1e-8)
    page.compare("orbit_grazing", "where the motion turns back and where it grazes, closed form, N", [0.0999707536283133, 0.1],
                 [*amplitude[mark == 1], *amplitude[mark == 4]], 1e-6)
    with page.run("check_grazing") as file:
        impacts = file["sweep/impacts"][()]
    touches = list(impacts[1::2] > 0)
    page.row(all(touches) and not any(impacts[::2]), "`check_grazing`", "six frequencies, 1e-8 below the amplitude and above",
             "none, all", f"{sum(impacts[::2] > 0)}, {sum(touches)}", "", "")
    stiffness, line = 200e9 * 0.02 * 0.01**3 / 12, 8000 * 0.02 * 0.01
    point = 30 * 0.5**3 * (0.37**2 * 2.63 / 6 + 1 / 3) / stiffness
    stretch = -200 * 0.5**4 * ((0.71**3 - 0.23**3) / 6 - (0.71**4 - 0.23**4) / 24) / stiffness
    weight = -(line * 0.5**4 / 8 + 0.3 * 0.5**3 / 3) / stiffness * (9.81 + 5)
    with page.run("check_static") as file:
        tip = file["response/displacement_tip"][()]
    page.compare("static", "tip under forces, line load, gravity, base, m", [point + stretch + weight] * 2, [tip.min(), tip.max()], 1e-10)
    with page.run("check_swinging_beam") as file:
        tip = 1e3 * file["response/displacement_tip"][1:13]
    page.compare("swinging_beam", "code_aster SDNL32, 18 kN/m, mm", SWING, tip, 0.0161)


def orders(page):
    """Newmark's steps, halved: the events of the mass on springs in closed form."""
    page.head("Order of Newmark's steps", ["scene", "steps, s", "maximum error of six events, s", "orders", "bounds", ""])
    text = (INPUTS / "check_mass_on_springs.nml").read_text(encoding="utf-8")
    held, free = math.sqrt(100 / 1.01e6), math.sqrt(100 / 1e4)
    expected = np.array([math.pi * ((i + 1) // 2 * held + i // 2 * free) for i in range(6)])
    steps, errors = [1e-3, 5e-4, 2.5e-4], []
    for number, step in enumerate(steps):
        scene = page.place / f"newmark_{number}.nml"
        tolerance = 1e-5 / 4 ** (number + 1)
        response = f"&response duration_time = 0.75, step_time = {step}, method = 'newmark', contact_tolerance = {tolerance}, " \
            f"release_tolerance = {tolerance} /"
        scene.write_text(re.sub(r"&response.*/", response, text), encoding="utf-8")
        with page.run(f"newmark_{number}", folder=page.place) as file:
            errors.append(np.max(np.abs(file["events/time"][:6] - expected)))
    found = [math.log2(errors[i] / errors[i + 1]) for i in range(2)]
    page.row(all(1.9 < order < 2.1 for order in found), "`check_mass_on_springs`, method = 'newmark'", words(steps),
             " ".join(f"{error:.1e}" for error in errors), words(np.round(found, 2)), "1.9 to 2.1")


def ledgers(page):
    """All energy of a run at every sample, over that of its start."""
    page.head("Energy", ["scene", "samples", "kinetic, strain, stop, dissipated, less created: relative difference from the start", "bound", ""])
    for scene, where in (("check_mass_on_springs", ""), ("fig04", "cases/case_2/"), ("fig04", "cases/case_4/")):
        with page.run(scene) as file:
            group = file[where + "energy"]
            whole = sum(group[name][()] for name in group if name not in ("tau", "time", "created", "work"))
            whole = whole - group["created"][()]
            miss = np.max(np.abs(whole / whole[0] - 1))
        page.row(miss <= 1e-11, f"`{scene}` {where.rstrip('/')}", whole.size, f"{miss:.1e}", "1e-11")


def rows_of(path):
    """The words of each line that is no comment."""
    lines = path.read_text(encoding="utf-8").splitlines()
    return [line.split() for line in lines if line.strip() and not line.startswith("#")]


def printed(page):
    """The paper's tables; where they are off by themselves, slips.txt says why."""
    page.head("The paper's tables", ["scene", "printed values", "different after rounding", "of these explained", ""])
    folder = ROOT / "tests" / "regression"
    slips = {(row[0], row[1], row[2], row[3]) for row in rows_of(folder / "slips.txt")}
    for number in ("1", "2"):
        with page.run(f"table{number}") as file:
            group = file["frequencies"]
            meshes = list(zip(group["column_elements"][()], group["column_ratio"][()]))
            ours, exact = group["lambda"][()], group["lambda_exact"][()]
        count = off = explained = 0
        for elements, ratio, mode, value in rows_of(folder / f"table{number}.txt"):
            column = [int(elements) == mesh[0] and abs(float(ratio) - mesh[1]) < 1e-9 for mesh in meshes]
            computed = ours[int(mode) - 1, column.index(True)] if int(elements) else exact[int(mode) - 1]
            count += 1
            if abs(computed - float(value)) > 0.5e-3 + 1e-9:
                off += 1
                explained += (number, elements, ratio, mode) in slips
        page.row(off == explained, f"`table{number}`", count, off, explained)


def statements(page):
    """The paper's statements, judged."""
    with page.run("statements", "impactbeam-paper") as file:
        verdicts = [value.decode() if isinstance(value, bytes) else str(value) for value in file["statements/verdict"][()].ravel()]
    kinds = ["holds" if word.startswith("holds") and "nodal" not in word else
             "does not hold" if word.startswith("does not hold") else "only under the nodal reading" for word in verdicts]
    page.head("The paper's statements", ["scene", "verdict", "computed for this page", "expected", ""])
    for kind, said in (("holds", 16), ("does not hold", 12), ("only under the nodal reading", 2)):
        page.row(kinds.count(kind) == said, "`statements`", kind, kinds.count(kind), said)


def planted_bugs(page):
    """What tests/mutants.py found when it was last run here; it takes too long to be run for a page."""
    title, result = "Bugs planted in the source", ROOT / "build" / "mutants" / "result.json"
    if not result.is_file():
        page.lines += ["", f"## {title}", "", "Not run here: `python3 tests/mutants.py`."]
        return
    page.head(title, ["suite", "planted", "survive", "at commit", ""])
    suites = {}
    for mutant, (verdict, commit) in json.loads(result.read_text(encoding="utf-8")).items():
        suites.setdefault(mutant.split("\t")[1], []).append((verdict, commit))
    for suite, found in sorted(suites.items()):
        missed = sum(verdict != "noticed" for verdict, _ in found)
        page.row(missed == 0, f"`test_{suite}`", len(found), missed, " ".join(sorted({commit for _, commit in found})))


def main(programs, place, out):
    """Run, write, judge."""
    page = Page(programs, place)
    page.lines = ["# Checks", "", "This page compares published values and closed forms with results that were computed when the page was made. Repeat each with",
                  "`impactbeam inputs/<scene>.nml`. The scenes are described on the page [checked against others](published.md)."]
    for part in (frequencies, motions, orders, ledgers, printed, statements, planted_bugs):
        part(page)
    page.lines += ["", "All are good." if page.is_good else '<span style="color:red"><b>Some fail.</b></span>', ""]
    Path(out).write_text("\n".join(page.lines), encoding="utf-8")
    print(f"{out}: {'all good' if page.is_good else 'some fail'}")
    return 0 if page.is_good else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
