"""Plant bugs and see whether the tests notice: mutants.py [--check] [NUMBER...]

Each bug of mutants.txt is put alone into a copy of the source (build/mutants), and the suite that must notice it is built and
run there. What is noticed and what survives is printed and kept in build/mutants/result.json, for docs/build's page of checks.
Numbers: those of the list alone. --check: only see that each of them fits the source as it is. Status 0: none survives.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PLACE = ROOT / "build" / "mutants"
RESULT = PLACE / "result.json"
# Seconds after which a suite that runs on has noticed; the slowest takes a third
MOST_SECONDS = 180


def read_list():
    """File, suite, old and new text of each; what does not fit ends the run."""
    lines = (ROOT / "tests" / "mutants.txt").read_text(encoding="utf-8").splitlines()
    lines = [line for line in lines if not line.startswith("#")]
    mutants = []
    for head, old, new in zip(lines[::3], lines[1::3], lines[2::3], strict=True):
        file, suite = head.split()
        if not old.startswith("- ") or not new.startswith("+ "):
            sys.exit(f"mutants.txt: after '{head}' a line with - and one with + must follow")
        times = (ROOT / file).read_text(encoding="utf-8").count(old[2:])
        if times != 1:
            sys.exit(f"mutants.txt: '{old[2:]}' is {times} times in {file}: must be once; bring the list up to date")
        mutants.append((file, suite, old[2:], new[2:]))
    return mutants


def run(seconds, *command):
    """Does a command succeed, and in time?"""
    with open(PLACE / "log", "a", encoding="utf-8") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log, stdin=subprocess.DEVNULL, start_new_session=True,
                                   env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})
        try:
            return process.wait(seconds) == 0
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            return False


def builds(suites):
    """Build the tests of some suites."""
    return run(None, "cmake", "--build", PLACE / "build", "--parallel", "2", "--target", *(f"test_{suite}" for suite in suites))


def passes(suite):
    """Run one."""
    return run(MOST_SECONDS, "ctest", "--test-dir", PLACE / "build", "--no-tests=error", "--output-on-failure", "-R",
               f"^test_{suite}$")


def prepare(suites):
    """The copy, built, with all suites passing in it. What has not changed keeps its time, and is not built again."""
    source = PLACE / "source"
    PLACE.mkdir(parents=True, exist_ok=True)
    (PLACE / "log").unlink(missing_ok=True)
    named = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    for name in filter(None, named.split("\0")):
        there, here = source / name, ROOT / name
        if not here.is_file() or there.is_file() and there.read_bytes() == here.read_bytes():
            continue
        there.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(here, there)
    ready = run(None, "cmake", "-S", source, "-B", PLACE / "build", "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                "-DCMAKE_Fortran_FLAGS_RELEASE=-O1", "-DIMPACTBEAM_NATIVE=OFF") and builds(suites)
    if not ready:
        sys.exit(f"does not build without bugs: see {PLACE / 'log'}")
    for suite in suites:
        if not passes(suite):
            sys.exit(f"{suite} fails without bugs: see {PLACE / 'log'}")


def verdict_on(file, suite, old, new):
    """Plant one bug, and take it out again."""
    path = PLACE / "source" / file
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace(old, new), encoding="utf-8")
    try:
        if not builds([suite]):
            return "does not build"
        return "survives" if passes(suite) else "noticed"
    finally:
        path.write_text(text, encoding="utf-8")


def main(words):
    """Plant, tell, keep."""
    mutants = read_list()
    if words == ["--check"]:
        return 0
    numbers = [int(word) for word in words] or range(1, len(mutants) + 1)
    prepare(sorted({mutants[number - 1][1] for number in numbers}))
    commit = subprocess.run(["git", "describe", "--always", "--dirty"], cwd=ROOT, check=True, capture_output=True,
                            text=True).stdout.strip()
    kept = json.loads(RESULT.read_text(encoding="utf-8")) if RESULT.is_file() else {}
    # those that are no more in the list are forgotten
    kept = {key: value for key, value in kept.items() if key in map("\t".join, mutants)}
    for number in numbers:
        mutant = mutants[number - 1]
        verdict = verdict_on(*mutant)
        print(f"{number:3} {verdict:9} {mutant[1]:16} {mutant[0]}: {mutant[2]}", flush=True)
        kept["\t".join(mutant)] = [verdict, commit]
        RESULT.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    missed = sum(verdict != "noticed" for verdict, _ in kept.values())
    print(f"{len(kept) - missed} of {len(kept)} noticed")
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
