"""Run one suite and judge it: in time, exit status 0, `OK`, as many tests as its .pf files hold, no sanitizer's word.

    run_suite.py --timeout SECONDS --tests FILE.pf... -- SUITE ARGUMENT...

The last line, `suite NAME: N passed, N failed`, is what count_tests.py adds up.
"""

import os
import re
import signal
import subprocess
import sys
import threading

MARK = re.compile(r"^\s*@test\b", re.IGNORECASE | re.MULTILINE)
GOOD = re.compile(r"OK\s+\((\d+) tests?\)")
BROKEN = re.compile(r"Tests run: (\d+), Failures: (\d+), Errors: (\d+)")
SANITIZER = re.compile(r"Sanitizer|runtime error:")


def tests_in(paths):
    """The number of tests in .pf files."""
    total = 0
    for path in paths:
        with open(path, encoding="utf-8") as stream:
            total += len(MARK.findall(stream.read()))
    return total


def run(command, seconds):
    """Status and output of a command, which is passed on line by line; status None: it did not end in time."""
    try:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                   text=True, errors="replace", start_new_session=True)
    except OSError as error:
        return error, ""
    late = threading.Event()

    def kill(*_):
        late.set()
        os.killpg(process.pid, signal.SIGKILL)

    signal.signal(signal.SIGTERM, kill)
    timer = threading.Timer(seconds, kill)
    timer.start()
    said = []
    for line in process.stdout:
        said.append(line)
        sys.stdout.write(line)
        sys.stdout.flush()
    process.wait()
    timer.cancel()
    return None if late.is_set() else process.returncode, "".join(said)


def verdict(status, said, expected):
    """Passed and failed tests, and what is wrong with the suite as a whole."""
    good, broken = GOOD.search(said), BROKEN.search(said)
    ran, failed = int(good.group(1)) if good else 0, 0
    if broken:
        ran, *several = map(int, broken.groups())
        failed = sum(several)
    wrong = []
    if status is None:
        wrong.append("it did not end in time")
    elif status != 0 and not failed:
        wrong.append(f"exit status {status}")
    if not good and not failed:
        wrong.append("it does not say OK")
    if ran != expected:
        wrong.append(f"{ran} tests were run, but there are {expected}")
    if expected == 0:
        wrong.append("there is no test")
    if SANITIZER.search(said):
        wrong.append("a sanitizer spoke")
    passed = ran - failed
    return passed, max(expected - passed, 1 if wrong else failed), wrong


def main(arguments):
    """Run, judge, say."""
    divide = arguments.index("--")
    seconds, paths, command = float(arguments[1]), arguments[3:divide], arguments[divide + 1:]
    expected = tests_in(paths)
    passed, failed, wrong = verdict(*run(command, seconds), expected)
    for what in wrong:
        print("run_suite.py: " + what)
    print(f"suite {os.path.basename(command[0])}: {passed} passed, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
