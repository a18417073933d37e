"""Run the commands of the tutorial and of the page about spectra as they stand: tutorial.py FOLDER_OF_PROGRAMS PLACE

Each must do, and each picture that the pages show must be there afterwards.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
PROGRAMS, PLACE = sys.argv[1:]

if __name__ == "__main__":
    page = "".join((HERE / f"{name}.md").read_text(encoding="utf-8") for name in ("tutorial", "spectra"))
    shutil.rmtree(PLACE, ignore_errors=True)
    os.makedirs(PLACE)
    path = os.pathsep.join([PROGRAMS, str(HERE.parent / "scripts"), os.environ["PATH"]])
    for command in re.findall(r"```sh\n(.*?)```", page, re.DOTALL):
        done = subprocess.run(["bash", "-euo", "pipefail", "-c", command], cwd=PLACE, env={**os.environ, "PATH": path}, text=True,
                              check=False, stdin=subprocess.DEVNULL, capture_output=True)
        if done.returncode:
            sys.exit(f"status {done.returncode} of\n{command}\n{done.stdout}{done.stderr}")
        if "--format csv" in command:
            header, values = done.stdout.split()
            share = dict(zip(header.split(","), map(float, values.split(","))))
            if not (0.6 < share["lost_beam"] < 0.85 and 0.15 < share["lost_stop"] < 0.4):
                sys.exit(f"the tutorial is wrong about the energy: {share}")
    for picture in re.findall(r"!\[[^]]*\]\(([^)]*)\)", page):
        if (Path(PLACE) / picture).stat().st_size < 10000:
            sys.exit(f"{picture} is empty")
