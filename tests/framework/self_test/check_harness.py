"""Check that what judges suites and counts tests notices each fault that is put in here."""

import os
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
FRAMEWORK = os.path.dirname(HERE)
ROOT = os.path.dirname(os.path.dirname(FRAMEWORK))
THREE_TESTS = os.path.join(HERE, "hollow.pf")


def run(*command):
    """Status and output of a command."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def check(condition, what):
    """Stop at the first thing that is not so."""
    if not condition:
        sys.exit("harness: " + what)


def judged(script, *files, timeout="60"):
    """The judgement on a suite that is a script of the shell; by default it ought to hold three tests."""
    return run(sys.executable, os.path.join(FRAMEWORK, "run_suite.py"), "--timeout", timeout, "--tests",
               *(files or [THREE_TESTS]), "--", "sh", "-c", script)


def suites_are_judged():
    """A good suite passes, bad ones fail with their reason."""
    good = "echo ' OK'; echo ' (3 tests)'"
    status, output = judged(good)
    check(status == 0 and output.endswith("suite sh: 3 passed, 0 failed\n"), "a good suite fails: " + output)
    for script, reason in (
            (good + "; exit 5", "exit status 5"),
            (good + "; kill -SEGV $$", "exit status -11"),
            ("echo ' OK'; echo ' (2 tests)'", "2 tests were run, but there are 3"),
            ("echo ' OK'; echo ' (4 tests)'", "4 tests were run, but there are 3"),
            ("echo started", "does not say OK"),
            (good + "; echo ERROR: AddressSanitizer", "a sanitizer spoke"),
            ("echo Tests run: 3, Failures: 1, Errors: 0", "suite sh: 2 passed, 1 failed")):
        status, output = judged(script)
        check(status != 0 and reason in output and " 0 failed" not in output, f"this suite passes: {script}: {output}")
    status, output = judged(good, os.devnull)
    check(status != 0, "a suite without tests passes")
    begin = time.monotonic()
    status, output = judged("sleep 60 & echo begun; wait; " + good, timeout="0.3")
    check(status != 0 and "did not end in time" in output and "begun" in output, "an endless suite passes: " + output)
    check(time.monotonic() - begin < 30, "an endless suite is waited for")


def tests_are_counted(folder):
    """Tests that were not run are missed."""
    log, files = os.path.join(folder, "log"), os.path.join(folder, "files")
    block = "\n1/2 Testing: a\nsuite test_a: 3 passed, 0 failed\nTest Passed.\n\n2/2 Testing: b\nTest Passed.\n"
    for path, text in ((log, block), (files, THREE_TESTS + "\n")):
        with open(path, "w", encoding="utf-8") as stream:
            stream.write(text)
    counter = os.path.join(ROOT, "tests", "count_tests.py")
    status, output = run(sys.executable, counter, log, files)
    check(status == 0 and output == "4 passed, 0 failed\n", "a good log fails: " + output)
    with open(files, "a", encoding="utf-8") as stream:
        stream.write(THREE_TESTS + "\n")
    status, output = run(sys.executable, counter, log, files)
    check(status != 0 and "6 tests are in the .pf files, 3 were run" in output, "a lost suite is not missed: " + output)


def files_are_listed(folder, cmake):
    """A .pf file must be in one list."""
    for name in ("one.pf", "two.pf"):
        open(os.path.join(folder, name), "w", encoding="utf-8").close()
    for lists, word in (("LISTED one.pf two.pf", ""), ("LISTED one.pf", "two.pf is in 0 lists"),
                        ("LISTED one.pf two.pf one.pf", "one.pf is in 2 lists")):
        with open(os.path.join(folder, "CMakeLists.txt"), "w", encoding="utf-8") as stream:
            stream.write(f"cmake_minimum_required(VERSION 3.25)\nproject(lists NONE)\n"
                         f"include(\"{ROOT}/cmake/TestFiles.cmake\")\nnote_test_files({lists})\n"
                         f"check_test_files(${{CMAKE_CURRENT_SOURCE_DIR}})\n")
        status, output = run(cmake, "-S", folder, "-B", os.path.join(folder, "build"))
        check((status == 0) == (word == "") and word in output, f"lists of tests: {lists}: {output}")


def main(cmake):
    """Check them all."""
    suites_are_judged()
    with tempfile.TemporaryDirectory() as folder:
        tests_are_counted(folder)
        files_are_listed(folder, cmake)
    print("faults are noticed")


if __name__ == "__main__":
    main(*sys.argv[1:])
