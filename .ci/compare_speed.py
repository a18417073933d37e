#!/usr/bin/python3
"""Processor time of this build beside that of another program or commit, in turns, medians and ratios.

    .ci/compare_speed.py build/release/impactbeam <program or commit> [--rounds 9]

A commit is built first, in build/compare/<commit>. Each round starts both for each task, now one first, now the other.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SWEEP = "&sweep {} zeta_range = 0.001, 0.05 zeta_points = {} preload_range = 0, 0.5 preload_points = 20 /\n"
THREE_ELEMENT = "&stop law = 'three_element', stiffness_ratio = 1000 /\n"
# name, scene (none: the options alone), options, share of the rounds
TASKS = [
    ("--version", None, ["--version"], 3),
    ("fig04_preload_0", (ROOT / "inputs/fig04_preload_0.nml").read_text(encoding="utf-8"), [], 3),
    ("10 000 cases, restitution", "&stop /\n&response duration = 20 /\n" + SWEEP.format("", 500), ["--threads", "1"], 1),
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


def main():
    """Read the command line, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", help="this build")
    parser.add_argument("other", help="another program, or a commit")
    parser.add_argument("--rounds", type=int, default=9, help="starts of each; three times as many of the short ones")
    options = parser.parse_args()
    programs = [built(options.program), built(options.other)]
    print(f"{'processor time, s':30} {'this':>9} {'other':>9} {'ratio':>6}")
    with tempfile.TemporaryDirectory() as folder:
        for name, scene, arguments, share in TASKS:
            if scene:
                Path(folder, "task.nml").write_text(scene, encoding="utf-8")
                arguments = ["task.nml", "--quiet", *arguments]
            taken = [[], []]
            for number in range(options.rounds * share):
                for which in ((0, 1), (1, 0))[number % 2]:
                    taken[which].append(seconds(programs[which], arguments, folder))
            this, that = map(statistics.median, taken)
            print(f"{name:30} {this:9.4f} {that:9.4f} {this / that:6.3f}", flush=True)


if __name__ == "__main__":
    main()
