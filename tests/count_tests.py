"""Count the single tests in a log of ctest; print 'N passed, N failed'.

    count_tests.py LOG [PF_FILES]

Fails when none passed, when any failed, or when not as many were run as those .pf files hold that PF_FILES names.
"""

import os
import re
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "framework"))
from run_suite import tests_in  # pylint: disable=wrong-import-position

SUITE = re.compile(r"^suite \S+: (\d+) passed, (\d+) failed$", re.MULTILINE)


def count(text):
    """Passed and failed tests, and how many of them were in suites; a test that is no suite is one."""
    passed = failed = in_suites = 0
    for block in re.split(r"\n\d+/\d+ Testing: ", text)[1:]:
        good, suite = "\nTest Passed." in block, SUITE.search(block)
        if suite:
            here = [int(number) for number in suite.groups()]
            in_suites += sum(here)
            passed += here[0]
            failed += here[1] if good or here[1] else 1
        elif good:
            passed += 1
        else:
            failed += 1
    return passed, failed, in_suites


def read(path):
    """A text; nothing if it is not there."""
    try:
        with open(path, encoding="utf-8", errors="replace") as stream:
            return stream.read()
    except OSError:
        return ""


def main(log, pf_files=None):
    """Count and judge."""
    passed, failed, in_suites = count(read(log))
    expected = tests_in(read(pf_files).split("\n")[:-1]) if pf_files else in_suites
    if in_suites != expected:
        print(f"{expected} tests are in the .pf files, {in_suites} were run")
    print(f"{passed} passed, {failed} failed")
    return 0 if passed > 0 and failed == 0 and in_suites == expected else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
