"""Run the commands of the tutorial, the how-to pages and the page about spectra as they stand: run_pages.py FOLDER_OF_PROGRAMS PLACE

The commands of each page are run in a folder of its own. Each must succeed. A block of `text` after a command gives lines of its
output: words as they are and in this order, numbers within one percent. Every picture that a page shows must be there afterwards, and every comment such as
<!-- results/gap.h5 sweep/greatest_force[10] = 8.07 --> must agree with the file within one percent. The scenes of the reference pages are
checked only.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py

HERE = Path(__file__).resolve().parent
# Pages whose examples are whole scenes
COMPLETE = ["scenes", "meshes"]
PAGES = ["tutorial", "spectra", *sorted(f"howto/{page.stem}" for page in (HERE / "howto").glob("*.md"))]
# What runs in place of impactbeam-plot: it asks a process that has loaded Matplotlib already, which takes as long as a picture.
SERVED = '''#!/usr/bin/env bash
tools=$(dirname "$0")
exec 3>&1
echo "$(printf '%q ' /proc/$$/fd/3 /proc/$$/fd/2 "$PWD" impactbeam-plot "$@")" > "$tools/requests"
read -r status < "$tools/answers"
exit "$status"
'''
NUMBER = re.compile(r"[-+]?\d+(\.\d*)?([eE][-+]?\d+)?")


def is_near(said, found):
    """Two words, or two numbers within one percent."""
    if said == found:
        return True
    if not (NUMBER.fullmatch(said) and NUMBER.fullmatch(found)):
        return False
    return abs(float(said) - float(found)) <= 0.01 * abs(float(said))


def words_of(line):
    """The words of a line, without brackets and commas."""
    return re.sub(r"[\[\]{},]", " ", line).split()


def missing_line(text, output):
    """The first line of a page that the output does not hold in this order; further words of a line of the output do not matter."""
    lines = iter(output.splitlines())
    for line in filter(str.strip, text.splitlines()):
        words = words_of(line)

        def holds(found, words=words):
            found = iter(words_of(found))
            return all(any(is_near(word, other) for other in found) for word in words)

        if not any(holds(found) for found in lines):
            return line
    return None


def wrong_number(comment, place):
    """What is wrong with the number of a comment; nothing if the file holds it."""
    path, name, index, said = comment
    with h5py.File(place / path) as file:
        values = file[name][()]
        found = float(values.ravel()[int(index)] if index else values)
    return "" if abs(found - float(said)) <= 0.01 * abs(float(said)) else f"{path} {name}[{index}] is {found:.6g}, not {said}"


def run_page(page, place, environment):
    """Run the commands of one page, and compare."""
    text = (HERE / f"{page}.md").read_text(encoding="utf-8")
    place.mkdir(parents=True)
    output = ""
    for kind, block in re.findall(r"```(sh|text)\n(.*?)```", text, re.DOTALL):
        if kind == "text":
            line = missing_line(block, output)
            if line is not None:
                sys.exit(f"{page}.md: the output has no line such as\n{line}\nbut is\n{output}")
            continue
        done = subprocess.run(["bash", "-euo", "pipefail", "-c", block], cwd=place, env=environment, text=True, check=False,
                              stdin=subprocess.DEVNULL, capture_output=True)
        output = done.stdout
        if done.returncode:
            sys.exit(f"{page}.md: status {done.returncode} of\n{block}\n{done.stdout}{done.stderr}")
    for picture in re.findall(r"!\[[^]]*\]\(([^)]*)\)", text):
        if (place / picture).stat().st_size < 10000:
            sys.exit(f"{page}.md: {picture} is empty")
    for comment in re.findall(r"<!-- (\S+\.h5) (\S+?)(?:\[(\d+)\])? = (\S+) -->", text):
        problem = wrong_number(comment, place)
        if problem:
            sys.exit(f"{page}.md: {problem}")


def check_scenes(page, place, environment):
    """Check the scenes that a page gives in full. The table that one of them names is a file of the user."""
    place.mkdir(parents=True)
    (place / "shaker.txt").write_text("0 0\n1 0.1\n2 0\n", encoding="utf-8")
    for number, block in enumerate(re.findall(r"```\n(&.*?)```", (HERE / f"{page}.md").read_text(encoding="utf-8"), re.DOTALL)):
        scene = place / f"{page}_{number + 1}.nml"
        scene.write_text(block, encoding="utf-8")
        done = subprocess.run(["impactbeam", "--check", scene.name], cwd=place, env=environment, text=True, check=False, capture_output=True)
        if done.returncode or "warning" in done.stdout:
            sys.exit(f"{page}.md: {done.stdout}{done.stderr} by\n{block}")


def serve_pictures(tools):
    """Let one process draw all pictures from now on."""
    for pipe in ("requests", "answers"):
        os.mkfifo(tools / pipe)
    root = HERE.parent
    subprocess.Popen([root / "tests/pictures/run_scripts.py", root / "scripts", str(os.getpid())], cwd=tools,
                     stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    (tools / "impactbeam-plot").write_text(SERVED, encoding="utf-8")
    (tools / "impactbeam-plot").chmod(0o755)


def main(programs, place):
    """Run all pages."""
    place = Path(place)
    shutil.rmtree(place, ignore_errors=True)
    tools = place / "tools"
    tools.mkdir(parents=True)
    (tools / "python3").symlink_to(sys.executable)
    path = os.pathsep.join([str(tools.resolve()), programs, str(HERE.parent / "scripts"), os.environ["PATH"]])
    for page in COMPLETE:
        check_scenes(page, place / page, {**os.environ, "PATH": path})
    for page in PAGES:
        run_page(page, place / page, {**os.environ, "PATH": path})
        # the pictures of the first page are drawn as a user draws them
        if page == PAGES[0]:
            serve_pictures(tools)


if __name__ == "__main__":
    main(*sys.argv[1:])
