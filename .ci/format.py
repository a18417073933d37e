#!/usr/bin/env python3
"""Indent the Fortran of src/ and tests/ with findent: three columns a level, a continuation three beyond its statement.

    format.py            rewrite files where that changes them
    format.py --check    list them, and fail if there are any

Spaces inside a line and where it breaks are left as they are.
"""

import os
import shutil
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
FLAGS = ["-ifree", "-i3", "-c3", "-k3"]


def sources():
    """Fortran files and files of tests."""
    for top in ("src", "tests"):
        for folder, _, names in sorted(os.walk(os.path.join(ROOT, top))):
            for name in sorted(names):
                if name.endswith((".f90", ".pf")):
                    yield os.path.join(folder, name)


def main(arguments):
    """Format or check."""
    if arguments not in ([], ["--check"]):
        print(__doc__, file=sys.stderr)
        return 2
    findent = shutil.which("findent", path=os.path.join(ROOT, "build", "tools", "bin")) or shutil.which("findent")
    if not findent:
        print("format.py: there is no findent; .ci/check gets it", file=sys.stderr)
        return 2
    changed = files = 0
    for path in sources():
        with open(path, encoding="utf-8") as stream:
            before = stream.read()
        after = subprocess.run([findent, *FLAGS], input=before, capture_output=True, text=True, check=True).stdout
        files += 1
        if after == before:
            continue
        changed += 1
        if arguments:
            print("format.py: " + os.path.relpath(path, ROOT))
        else:
            with open(path, "w", encoding="utf-8") as stream:
                stream.write(after)
    print(f"format: {files} files, {changed} " + ("to be formatted" if arguments else "changed"))
    return 1 if arguments and changed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
