"""What FORD makes pages of: pages.py FOLDER_OF_PROGRAMS PLACE

(FORD's `warn` stays off: it asks for words on every argument, where here a name that says it all has none.)

Puts the pages of docs with a title each, the reference and the tutorial's pictures into PLACE/pages, and FORD's
settings beside them.
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ORDER = ["tutorial", "spectra", "sweeps", "measurements", "meshes", "scenes", "analyses", "results", "examples", "reference", "glossary",
         "computing", "theory", "published", "paper", "checks", "building", "testing"]
SETTINGS = """---
project: impactbeam
summary: Beams that hit stops, rebound, chatter and come to rest
author: The impactbeam developers
license: by
src_dir: {place}/src
page_dir: {place}/pages
output_dir: {place}/html
media_dir: {place}/media
css: {place}/pages.css
preprocess: false
display: public
source: false
graph: false
search: false
warn: false
predocmark: >
print_creation_date: false
---
"""


def reference(program):
    """The table of names, as the program prints it."""
    said = subprocess.run([program, "--names", "--markdown"], check=True, capture_output=True, text=True).stdout
    return "# Every name of a scene\n\nAs `impactbeam --names` prints them, all or those of one group (`impactbeam --names stop`).\n\n" + said


def with_title(text):
    """The first heading as FORD's title; links to pages as it makes them."""
    title, rest = text.split("\n", 1)
    rest = re.sub(r"\]\((\w+)\.md", r"](\1.html", rest)
    rest = re.sub(r"\[([^]]*)\]\(\.\./[^)]*\)", r"\1", rest)
    return f"title: {title.lstrip('# ')}\n\n{rest}"


def copy_source(place):
    """The source; FORD takes a comment that begins with a word and a colon for a setting of its own."""
    for path in (HERE.parent / "src").rglob("*.[fF]90"):
        target = place / path.relative_to(HERE.parent)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(re.sub(r"(?m)^(\s*!>\s*[\w-]+):", r"\1&#58;", path.read_text(encoding="utf-8")), encoding="utf-8")


def main(programs, place):
    """Write all."""
    place = Path(place)
    copy_source(place)
    pages = place / "pages"
    pages.mkdir(parents=True, exist_ok=True)
    texts = {page.stem: page.read_text(encoding="utf-8") for page in HERE.glob("*.md")}
    texts["reference"] = reference(Path(programs) / "impactbeam")
    texts["checks"] = (place / "checks.md").read_text(encoding="utf-8")
    missing = set(texts) ^ set(ORDER)
    if missing:
        sys.exit(f"pages.py does not know where these go, or they are not there: {', '.join(sorted(missing))}")
    for name, text in texts.items():
        (pages / f"{name}.md").write_text(with_title(text), encoding="utf-8")
    for picture in (place / "run").glob("*.png"):
        shutil.copy(picture, pages)
    readme = (HERE.parent / "README.md").read_text(encoding="utf-8")
    (pages / "index.md").write_text("title: Pages\n" + "".join(f"ordered_subpage: {name}.md\n" for name in ORDER) + "\n"
                                    + "".join(f"- [{texts[name].splitlines()[0].lstrip('# ')}]({name}.html)\n" for name in ORDER),
                                    encoding="utf-8")
    head = readme.split("\n## ")[0].split("![")[0].split("\n", 1)[1]
    (place / "media").mkdir(exist_ok=True)
    (place / "pages.css").write_text("img { max-width: 100%; } td, th { padding: 0.1em 0.6em; }\n", encoding="utf-8")
    (place / "ford.md").write_text(SETTINGS.format(root=HERE.parent, place=place) + head + "\nSee the [pages](page/index.html).\n",
                                   encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
