#!/usr/bin/python3
"""Run plotting scripts on one file each, every one in a process of its own that has their libraries loaded already.

    run_scripts.py FOLDER_OF_SCRIPTS (SCRIPT FILE)...

Prints a status a line; what the first, second ... one says on standard error is left in errors.1, errors.2 ...
"""

import os
import runpy
import sys
import traceback

import h5py  # pylint: disable=unused-import
import matplotlib.pyplot  # pylint: disable=unused-import


def run(folder, script, file, errors):
    """Run a script as if the shell had; return its status."""
    sys.stdout.flush()
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    os.dup2(os.open(errors, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
    sys.path[0], sys.argv, status = folder, [script, file], 0
    try:
        runpy.run_path(os.path.join(folder, script), run_name="__main__")
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 1
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
    except BaseException:  # pylint: disable=broad-exception-caught
        traceback.print_exc()
        status = 1
    sys.stderr.flush()
    os._exit(status)


if __name__ == "__main__":
    pairs = zip(sys.argv[2::2], sys.argv[3::2])
    for number, (a_script, a_file) in enumerate(pairs, start=1):
        print(run(sys.argv[1], a_script, a_file, f"errors.{number}"))
