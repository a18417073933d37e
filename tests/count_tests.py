"""Count the single tests in a log of ctest; print 'N passed, N failed', fail when none passed or any failed."""

import re
import sys

SUITE = re.compile(r"OK\s+\((\d+) tests?\)")
FAILED = re.compile(r"Tests run: (\d+), Failures: (\d+), Errors: (\d+)")


def count(text):
    """Passed and failed tests: those of each suite, or one for a test that is no suite."""
    passed = failed = 0
    for block in re.split(r"\n\d+/\d+ Testing: ", text)[1:]:
        good = "\nTest Passed." in block or "\nTest Pass Reason:" in block
        suite, broken = SUITE.search(block), FAILED.search(block)
        if broken:
            run, failures, errors = map(int, broken.groups())
            passed += run - failures - errors
            failed += failures + errors
            if not good and failures + errors == 0:
                failed += 1
        elif suite and good:
            passed += int(suite.group(1))
        elif good:
            passed += 1
        else:
            failed += 1
    return passed, failed


def main(path):
    """Count and judge."""
    try:
        with open(path, encoding="utf-8", errors="replace") as stream:
            passed, failed = count(stream.read())
    except OSError:
        passed = failed = 0
    print(f"{passed} passed, {failed} failed")
    return 0 if passed > 0 and failed == 0 else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
