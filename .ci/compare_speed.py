#!/usr/bin/python3
"""Processor time of this build beside that of another program or commit, in pairs: medians, and the median of the pairs'
ratios with an interval that covers it in 95 of 100.

    .ci/compare_speed.py build/release/impactbeam <program or commit> [--rounds 9]

A commit is built first, in build/compare/<commit>. Each round starts both for each task, now one first, now the other.
"""

import argparse
import math
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SWEEP = "&sweep {} zeta_range = 0.001, 0.05 zeta_points = {} preload_range = 0, 0.5 preload_points = 20 /\n"
FORCE = "&force position = 1, kind = 'harmonic', amplitude_ratio = 0.3, frequency_ratio = 1.7 /\n"
THREE_ELEMENT = "&stop law = 'three_element', stiffness_ratio = 1000 /\n"


def scene_named(name):
    """The text of one of inputs/."""
    return (ROOT / "inputs" / f"{name}.nml").read_text(encoding="utf-8")


# name, scene (none: the options alone), options, share of the rounds
TASKS = [
    ("--version", None, ["--version"], 3),
    ("fig04_preload_0", scene_named("fig04_preload_0"), [], 3),
    ("10 000 cases, restitution", "&stop /\n&response duration = 20 /\n" + SWEEP.format("", 500), ["--threads", "1"], 1),
    ("10 000 cases of sweep_figure4", scene_named("sweep_figure4").replace("zeta_points = 50", "zeta_points = 5"),
     ["--threads", "1"], 1),
    ("2 000 cases under a load", FORCE + "&stop /\n&response duration = 20 /\n" + SWEEP.format("", 100), ["--threads", "1"],
     1),
    ("tube_driven", scene_named("tube_driven"), [], 1),
    ("fig04_newmark", scene_named("fig04_newmark"), [], 3),
    ("200 cases, three elements", THREE_ELEMENT + "&response duration = 20 /\n" + SWEEP.format("", 10), ["--threads", "1"], 1),
    ("512 elements, three elements", "&mesh elements = 512 /\n" + THREE_ELEMENT + "&response duration = 20 /\n", [], 1),
]


def built(other):
    """The program of a commit; a program as it is."""
    if Path(other).is_file():
        return Path(other).resolve()
    found = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short", f"{other}^{{commit}}"], capture_output=True, text=True,
                           check=False)
    if found.returncode:
        sys.exit(f"{other}: neither a program nor a commit")
    tree = ROOT / "build" / "compare" / found.stdout.strip()
    tree.mkdir(parents=True, exist_ok=True)
    archive = subprocess.run(["git", "-C", ROOT, "archive", other], capture_output=True, check=True).stdout
    subprocess.run(["tar", "-x", "-C", tree], input=archive, check=True)
    subprocess.run(["cmake", "--preset", "release", "-DBUILD_TESTING=OFF"], cwd=tree, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", "--preset", "release"], cwd=tree, check=True, stdout=subprocess.DEVNULL)
    return tree / "build" / "release" / "impactbeam"


def seconds(program, arguments, folder):
    """Processor time of one start."""
    process = subprocess.Popen([program, *arguments], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    said = process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"{program} {' '.join(arguments)}: status {process.returncode}: {said.decode()}")
    return usage.ru_utime + usage.ru_stime


def interval(ratios):
    """Two of some sorted numbers that have their median between them in 95 of 100, by the binomial distribution."""
    count = len(ratios)
    outside, place = 0.0, 0
    while place < count // 2 and outside + math.comb(count, place) / 2**count <= 0.025:
        outside += math.comb(count, place) / 2**count
        place += 1
    place = max(place - 1, 0)
    return ratios[place], ratios[count - 1 - place]


def main():
    """Read the command line, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", help="this build")
    parser.add_argument("other", help="another program, or a commit")
    parser.add_argument("--rounds", type=int, default=9, help="starts of each; three times as many of the short ones")
    options = parser.parse_args()
    programs = [built(options.program), built(options.other)]
    print(f"{'processor time, s':30} {'this':>9} {'other':>9} {'ratio':>6} {'from':>6} {'to':>6}")
    with tempfile.TemporaryDirectory() as folder:
        for name, scene, arguments, share in TASKS:
            if scene:
                Path(folder, "task.nml").write_text(scene, encoding="utf-8")
                arguments = ["task.nml", "--quiet", *arguments]
            taken = [[], []]
            for number in range(options.rounds * share):
                for which in ((0, 1), (1, 0))[number % 2]:
                    taken[which].append(seconds(programs[which], arguments, folder))
            ratios = sorted(this / that for this, that in zip(*taken, strict=True))
            low, high = interval(ratios)
            print(f"{name:30} {statistics.median(taken[0]):9.4f} {statistics.median(taken[1]):9.4f} "
                  f"{statistics.median(ratios):6.3f} {low:6.3f} {high:6.3f}", flush=True)


if __name__ == "__main__":
    main()
