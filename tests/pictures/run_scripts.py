#!/usr/bin/python3
"""Run plotting scripts, every one in a process of its own that has their libraries loaded already.

    run_scripts.py FOLDER_OF_SCRIPTS PROCESS

Each line of the pipe `requests` is OUT ERRORS FOLDER SCRIPT ARGUMENT...: the script runs in that folder, what it says goes
to the two files, and its status to the pipe `answers`. It ends with the process of that number.
"""

import glob
import os
import runpy
import select
import shlex
import sys
import traceback

import h5py  # pylint: disable=unused-import
import matplotlib.pyplot  # pylint: disable=unused-import


def run(scripts, request):
    """Run a script as if the shell had; return its status."""
    out, errors, folder, script, *words = shlex.split(request)
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    for stream, file in ((1, out), (2, errors)):
        os.dup2(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666), stream)
    os.chdir(folder)
    arguments = [name for word in words for name in sorted(glob.glob(word)) or [word]]
    sys.path[0], sys.argv, status = scripts, [script, *arguments], 0
    try:
        runpy.run_path(os.path.join(scripts, script), run_name="__main__")
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else int(end.code is not None)
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
    except BaseException:  # pylint: disable=broad-exception-caught
        traceback.print_exc()
        status = 1
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


def serve(scripts, process):
    """Answer requests, of which none comes before the last one is answered."""
    requests, answers = (os.open(pipe, os.O_RDWR) for pipe in ("requests", "answers"))
    while os.path.exists(f"/proc/{process}"):
        if select.select([requests], [], [], 1.0)[0]:
            os.write(answers, f"{run(scripts, os.read(requests, 65536).decode())}\n".encode())


if __name__ == "__main__":
    serve(*sys.argv[1:])
