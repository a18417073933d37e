#!/usr/bin/env python3
"""The rules of the pages: README.md, CONTRIBUTING.md, docs and, of programs that are named, --help, --names and --new.

    pages.py [PROGRAM...]

No word of .ci/page_words.txt; links lead to files and headings that exist; every page of docs links the glossary; the scene of
README.md is inputs/first_scene.nml. The words are those of pictures and of impactbeam-plot's messages, too.
"""

import ast
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
KINDS = ("beam", "relay", "tube", "reed")
LINK = re.compile(r"!?\[[^]]*\]\(([^)\s]+)\)")


def read_words():
    """Refused words with what to write instead, and phrases that hold them all the same."""
    refused, excepted = {}, []
    for line in (ROOT / ".ci" / "page_words.txt").read_text(encoding="utf-8").splitlines():
        if line.strip() and not line.startswith("#"):
            word, text = (side.strip() for side in line.split(":", 1))
            if word.startswith("except "):
                excepted.append(word.removeprefix("except "))
            else:
                refused[word] = text
    return refused, excepted


def without_code(text):
    """A page with blanks for its code."""
    def blank(found):
        return re.sub(r"[^\n]", " ", found[0])
    return re.sub(r"`[^`]*`", blank, re.sub(r"(?ms)^ *```.*?^ *```|^    .*?$|<!--.*?-->", blank, text))


def check_words(name, text, words, broken):
    """Add the refused words of a text."""
    refused, excepted = words
    shown = text.lower()
    for phrase in excepted:
        shown = re.sub(r"\s+".join(map(re.escape, phrase.split())), lambda found: re.sub(r"\S", " ", found[0]), shown)
    for word, instead in refused.items():
        for found in re.finditer(r"(?<![\w/-])" + r"\s+".join(map(re.escape, word.split())) + r"(?![\w-])", shown):
            broken.append(f"{name}:{shown.count(chr(10), 0, found.start()) + 1}: '{word}': write: {instead}")


def marks_of(page):
    """The marks of the headings of a page, as they are linked."""
    headings = re.findall(r"(?m)^#+ (.*)$", without_code(page.read_text(encoding="utf-8")))
    return {re.sub(r"[^\w -]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def check_links(page, text, made, broken):
    """Add links that lead nowhere; pictures that the page's commands make need not exist."""
    for target in LINK.findall(text):
        path, _, mark = target.partition("#")
        if re.match(r"https?:", target):
            continue
        place = (page.parent / path).resolve() if path else page
        if path.endswith(".png") and page in made:
            continue
        if not place.exists():
            broken.append(f"{page.relative_to(ROOT)}: links {target}, which is not there")
        elif mark and mark not in marks_of(place):
            broken.append(f"{page.relative_to(ROOT)}: links {target}: no such heading")


def main(programs):
    """Check all."""
    broken, words = [], read_words()
    docs = sorted((ROOT / "docs").rglob("*.md"))
    made = {page for page in docs if "```sh\n" in page.read_text(encoding="utf-8")}
    for page in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *docs]:
        text = page.read_text(encoding="utf-8")
        check_links(page, without_code(text), made, broken)
        check_words(str(page.relative_to(ROOT)), without_code(text), words, broken)
        if page in docs and page.name != "glossary.md" and "glossary.md)" not in text:
            broken.append(f"{page.relative_to(ROOT)}: does not link the glossary")
    for script in [*sorted((ROOT / "scripts").glob("plot_*.py")), ROOT / "docs" / "checks.py"]:
        for node in ast.walk(ast.parse(script.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value:
                check_words(f"{script.relative_to(ROOT)}:{node.lineno}", node.value, words, broken)
    scene = (ROOT / "inputs" / "first_scene.nml").read_text(encoding="utf-8")
    if f"```\n{scene}```" not in (ROOT / "README.md").read_text(encoding="utf-8"):
        broken.append("README.md: its scene is not inputs/first_scene.nml")
    for program in programs:
        for options in (["--help"], ["--names"], *(["--new", kind] for kind in KINDS)):
            said = subprocess.run([program, *options], check=True, capture_output=True, text=True).stdout
            # values in quotes are what users type
            check_words(f"{Path(program).name} {' '.join(options)}", re.sub(r"'\w*'", "''", said), words, broken)
    for what in broken:
        print("pages.py: " + what)
    print(f"pages: {len(docs) + 2} pages, {len(programs)} programs, {len(broken)} rules broken")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
