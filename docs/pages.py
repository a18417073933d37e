"""What FORD makes pages of: pages.py FOLDER_OF_PROGRAMS PLACE

(FORD's `warn` stays off: it asks for words on every argument, where here a name that says it all has none.)

Puts the pages of docs with a title each, the reference and the pictures of the pages into PLACE/pages, and FORD's
settings beside them. With the word `offline` as third argument it instead lets the HTML that FORD made take nothing from a
network.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
# The parts of the manual, each with its pages
PARTS = {
    "Learn": ["tutorial"],
    "How to": ["howto/relay", "howto/tube", "howto/valve_reed", "howto/mems_switch", "howto/drop_test", "howto/hammer",
               "howto/impact_damper", "howto/sprung_contact", "howto/contact_law",
               "howto/mesh_and_modes", "howto/cluster", "howto/read_results", "howto/paraview", "spectra", "sweeps", "measurements",
               "meshes"],
    "Look up": ["scenes", "analyses", "results", "examples", "reference", "glossary"],
    "Understand": ["computing", "theory", "published", "paper", "checks"],
    "Install and test": ["building", "testing"],
}
ORDER = [name for names in PARTS.values() for name in names]
SETTINGS = """---
project: impactbeam
summary: Beams that hit stops, rebound, chatter and come to rest
author: The impactbeam developers
src_dir: {place}/src
page_dir: {place}/pages
output_dir: {place}/html
media_dir: {place}/media
preprocess: false
display: public
source: false
graph: false
search: false
warn: false
predocmark: >
md_extensions: markdown.extensions.toc
print_creation_date: false
---
"""
# What the style sheet of a network address did for FORD's pages: columns, menus, tables, code
STYLE = """body { font: 16px/1.5 sans-serif; color: #222; margin: 0; padding: 0; }
html { scroll-padding-top: 1rem; }
.container, .container-fluid { max-width: 76rem; margin: 0 auto; padding: 0 1rem; box-sizing: border-box; }
.row { display: flex; flex-wrap: wrap; gap: 0 2rem; }
.row > h1, .row > .container { flex: 0 0 100%; }
.col-3, .col-md-3 { flex: 0 0 16rem; font-size: 0.85rem; }
.col-9, .col-md-9, .col-md-8, .col { flex: 1 1 30rem; min-width: 0; }
.navbar { background: #20262e; padding: 0.4rem 0; margin-bottom: 1rem; }
.navbar a { color: #fff; text-decoration: none; }
.navbar .container { display: flex; flex-wrap: wrap; gap: 0 1.5rem; }
.navbar-toggler, #jumbotron, .row#text > :nth-child(2), .row#text ~ .row, .align-items-center > .col:first-child { display: none; }
.nav-item:nth-child(2)::before { content: "Source code:"; color: #aab; margin-right: 0.6rem; }
.nav-item:nth-child(2) { display: flex; }
.navbar-nav, .list-inline, .breadcrumb { list-style: none; display: flex; flex-wrap: wrap; gap: 0 1.2rem; padding: 0; margin: 0; }
.nav { list-style: none; padding: 0; }
.nav .nav { padding-left: 1rem; }
.nav-link { display: block; padding: 0.1rem 0; }
.active { font-weight: bold; color: #222; }
a { color: #1f5fa8; }
h1 { font-size: 1.8rem; } h2 { font-size: 1.3rem; margin-top: 1.8rem; }
table { border-collapse: collapse; margin: 1rem 0; display: block; overflow-x: auto; }
td, th { padding: 0.2rem 0.8rem 0.2rem 0; border-bottom: 1px solid #ccc; text-align: left; vertical-align: top; }
pre { background: #f4f4f4; padding: 0.6rem; overflow-x: auto; }
img { max-width: 100%; }
.highlight .err { border: 0; }
hr { border: 0; border-top: 1px solid #ccc; }
@media (max-width: 50rem) { .col-3, .col-md-3 { order: 1; flex-basis: 100%; } .navbar-nav .nav-item + .nav-item { display: none; } }
"""


def reference(program):
    """The names that the program prints, a table for each group."""
    said = [subprocess.run([program, "--names", *what, "--markdown"], check=True, capture_output=True, text=True).stdout.splitlines()[2:]
            for what in ([], ["measures"])]
    lines = ["# Every name of a scene", "", "`impactbeam --names` prints these names too, and `impactbeam --names stop` those of one group, `impactbeam --names measures` the results of a run."]
    last = ""
    for row in said[0] + said[1]:
        group, name, values, default, meaning = (cell.strip() for cell in re.split(r"(?<!\\)\|", row)[1:-1])
        if group != last:
            lines += ["", f"## {group}", "", "| name | values | meaning |", "|---|---|---|"]
        last = group
        lines.append(f"| {name} | {values}{'; default ' if default else ''}{default} | {meaning} |")
    return "\n".join(lines) + "\n"


def title_of(text):
    """The first heading."""
    return text.splitlines()[0].lstrip("# ")


def without_comments(text):
    """A page without its comments, which end a list in FORD's Markdown."""
    return re.sub(r" *<!--.*?-->", "", re.sub(r"(?m)^[ \t]*(?:<!--.*?-->[ \t]*)+\n", "", text))


def with_title(name, text, names):
    """The first heading as FORD's title; links to pages as it makes them, others as words."""
    def link(found):
        page, mark = re.fullmatch(r"([^#]*)(#.*)?", found[2]).groups()
        target = os.path.normpath(os.path.join(os.path.dirname(name), page.removesuffix(".md")))
        if target in names:
            return f"[{found[1]}]({page.removesuffix('.md')}.html{mark or ''})"
        return found[0] if re.match(r"https?:|#", found[2]) else found[1]

    rest = re.sub(r"(?<!!)\[([^]]*)\]\(([^)]*)\)", link, without_comments(text).split("\n", 1)[1])
    return f"title: {title_of(text)}\n\n{rest}"


def contents(texts, folder):
    """Links to all pages, part by part, from a folder of the manual."""
    lines = []
    for part, names in PARTS.items():
        lines += ["", f"## {part}", ""] + [f"- [{title_of(texts[name])}]({folder}{name}.html)" for name in names]
    return "\n".join(lines) + "\n"


def take_offline(html):
    """Remove what the pages would load from a network; style sheets and scripts of FORD lie beside them."""
    for path in Path(html).rglob("*.html"):
        text = path.read_text(encoding="utf-8")
        depth = "../" * len(path.relative_to(html).parent.parts)
        for tag in re.findall(r"<(?:link|script)\b[^>]*(?:href|src)=[\"'](?:https?:)?//[^>]*>(?:\s*</script>)?", text):
            text = text.replace(tag, "")
        text = text.replace("</head>", f'<link href="{depth}css/manual.css" rel="stylesheet"></head>', 1)
        path.write_text(text, encoding="utf-8")
    (Path(html) / "css").mkdir(exist_ok=True)
    (Path(html) / "css" / "manual.css").write_text(STYLE, encoding="utf-8")


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
    texts = {str(page.relative_to(HERE).with_suffix("")): page.read_text(encoding="utf-8") for page in HERE.rglob("*.md")}
    texts["reference"] = reference(Path(programs) / "impactbeam")
    texts["checks"] = (place / "checks.md").read_text(encoding="utf-8")
    missing = set(texts) ^ set(ORDER)
    if missing:
        sys.exit(f"pages.py does not know where these go, or they are not there: {', '.join(sorted(missing))}")
    for name, text in texts.items():
        target = pages / f"{name}.md"
        target.parent.mkdir(exist_ok=True)
        target.write_text(with_title(name, text, texts), encoding="utf-8")
        # pictures lie where the page's commands left them
        for picture in re.findall(r"!\[[^]]*\]\(([^)]*\.png)\)", text):
            shutil.copy(place / "run" / name / picture, target.parent)
        # pictures of measurements that are not repeated for the pages
        for picture in re.findall(r"!\[[^]]*\]\(([^)]*\.svg)\)", text):
            shutil.copy(HERE / picture, target.parent)
    top = dict.fromkeys(f"{name}.md" if "/" not in name else "howto" for name in ORDER)
    tasks = [name.removeprefix("howto/") for name in ORDER if "/" in name]
    (pages / "index.md").write_text("title: Manual\n" + "".join(f"ordered_subpage: {name}\n" for name in top)
                                    + contents(texts, ""), encoding="utf-8")
    (pages / "howto" / "index.md").write_text(
        "title: How to\n" + "".join(f"ordered_subpage: {name}.md\n" for name in tasks) + "\n"
        + "".join(f"- [{title_of(texts['howto/' + name])}]({name}.html)\n" for name in tasks), encoding="utf-8")
    readme = (HERE.parent / "README.md").read_text(encoding="utf-8")
    head = readme.split("\n## Install")[0].split("\n", 1)[1].replace("docs/first_picture.svg", "media/first_picture.svg")
    (place / "media").mkdir(exist_ok=True)
    shutil.copy(HERE / "first_picture.svg", place / "media")
    (place / "ford.md").write_text(SETTINGS.format(root=HERE.parent, place=place) + head + contents(texts, "page/")
                                   + "\n## Source code\n\n- [Files](lists/files.html)\n- [Modules](lists/modules.html)\n- [Procedures](lists/procedures.html)\n", encoding="utf-8")


if __name__ == "__main__":
    take_offline(sys.argv[2]) if sys.argv[3:] == ["offline"] else main(*sys.argv[1:])
