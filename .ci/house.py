#!/usr/bin/env python3
"""The house drawn from its `use` statements, and its rules.

    house.py            print the drawing
    house.py --check    fail if a rule is broken, or the drawing in CONTRIBUTING.md is not this one
    house.py --write    put the drawing into CONTRIBUTING.md

Folders stand in the order of src/CMakeLists.txt, in which data flows: a module uses modules of its own folder and of those
above it. What a folder is for is the comment on its line there.
"""

import os
import re
import sys
import textwrap

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PAGE = os.path.join(ROOT, "CONTRIBUTING.md")
WORDS = os.path.join(ROOT, ".ci", "words.txt")
BEGIN, END = "<!-- drawn by .ci/house.py --write -->\n```text\n", "```\n<!-- end of the drawing -->"
MOST_LINES_OF_FILE, MOST_LINES_OF_PROCEDURE, MOST_ARGUMENTS = 500, 80, 9
# others decide how many arguments their procedures take
FOREIGN_INTERFACES = ("lapack_interfaces",)
# what programs of others use
ENTRIES = ("impactbeam_library",)
# the folders that read namelists, and those that may use them besides
NAMELISTS, READERS = ("namelist", "scene"), ("namelist", "scene", "study", "app")

STRING = re.compile(r"'(?:[^']|'')*'|\"(?:[^\"]|\"\")*\"")
UNIT = re.compile(r"(?:module|program)\s+(?!procedure\b)(\w+)$|submodule\s*\((\w+)[^)]*\)\s*(\w+)$")
USE = re.compile(r"use\b(\s*,\s*intrinsic\s*::|\s*,\s*non_intrinsic\s*::|\s*::)?\s*(\w+)")
PROCEDURE = re.compile(r"(?!end\b)(?:[\w(),=*: ]*\s)?(?:subroutine|function)\s+(\w+)\s*(?:\(([^()]*)\))?")
END_OF_PROCEDURE = re.compile(r"end\s*(?:subroutine|function)\b")
INTERFACE = re.compile(r"(?:abstract\s+)?interface\b")
# a kind after a number is a word, too
WORD = re.compile(r"(?<=\d_)[a-z]\w*|\b[a-z]\w*")


class Module:
    """A module or a main program: its file and what it uses."""

    def __init__(self, name, folder, path, is_program):
        self.name, self.folder, self.path, self.is_program, self.uses = name, folder, path, is_program, set()
        self.imports, self.exports, self.words = [], [], []


def statements(text):
    """First line, last line and text of each statement, in small letters, without comments and strings."""
    whole, first = "", 0
    for number, line in enumerate(text.splitlines(), start=1):
        line = STRING.sub("''", line)
        line = line.split("!")[0].strip().lower()
        if not line:
            continue
        if not whole:
            first = number
        whole += line.lstrip("&")
        if whole.endswith("&"):
            whole = whole[:-1]
            continue
        for part in whole.split(";"):
            if part.strip():
                yield first, number, " ".join(part.split())
        whole = ""


def names_after(mark, statement):
    """The list of names behind a mark; empty where it is not there."""
    return [name.split("=")[0].strip() for name in statement.split(mark)[1].split(",")] if mark in statement else []


def read_file(folder, path, modules, broken):
    """Add the modules of a file, and what is too long in it."""
    with open(path, encoding="utf-8") as stream:
        text = stream.read()
    shown = os.path.relpath(path, ROOT)
    lines = text.count("\n")
    if lines > MOST_LINES_OF_FILE:
        broken.append(f"{shown}: {lines} lines, at most {MOST_LINES_OF_FILE}")
    module, opened, interfaces = None, [], 0
    for first, last, statement in statements(text):
        unit = UNIT.match(statement)
        if unit:
            module = Module(unit.group(1) or unit.group(3), folder, shown, statement.startswith("program"))
            if unit.group(2):
                module.uses.add(unit.group(2))
            modules[module.name] = module
            if os.path.basename(path) != f"{module.name}.f90":
                broken.append(f"{shown}: holds {module.name}; the file must have the name of its module")
            continue
        if module:
            module.words += WORD.findall(statement)
            module.exports += names_after("public ::", statement)
            if statement.startswith("use"):
                module.imports += names_after("only:", statement)
        use = USE.match(statement)
        if use and "intrinsic" not in (use.group(1) or "").replace("non_intrinsic", ""):
            module.uses.add(use.group(2))
        if re.match(r"end\s*interface\b", statement):
            interfaces -= 1
        elif INTERFACE.match(statement):
            interfaces += 1
        elif END_OF_PROCEDURE.match(statement):
            name, start = opened.pop()
            if last - start + 1 > MOST_LINES_OF_PROCEDURE:
                broken.append(f"{shown}:{start}: {name} has {last - start + 1} lines, at most {MOST_LINES_OF_PROCEDURE}")
        else:
            procedure = PROCEDURE.match(statement)
            if not procedure:
                continue
            opened.append((procedure.group(1), first))
            arguments = len([name for name in (procedure.group(2) or "").split(",") if name.strip()])
            is_foreign = interfaces > 0 and (module.name in FOREIGN_INTERFACES or "bind(c" in statement)
            if arguments > MOST_ARGUMENTS and not is_foreign:
                broken.append(f"{shown}:{first}: {procedure.group(1)} has {arguments} arguments, at most {MOST_ARGUMENTS}")


def read_house():
    """Folders with what they are for, modules by name, broken rules."""
    folders, modules, broken = {}, {}, []
    with open(os.path.join(ROOT, "src", "CMakeLists.txt"), encoding="utf-8") as stream:
        for line in stream:
            found = re.match(r"add_subdirectory\((\w+)\)\s*(?:#\s*(.*))?$", line)
            if found:
                folders[found.group(1)] = found.group(2) or ""
    for folder, _, names in sorted(os.walk(os.path.join(ROOT, "src"))):
        concern = os.path.relpath(folder, os.path.join(ROOT, "src")).split(os.sep)[0]
        for name in sorted(names):
            if name.endswith(".f90"):
                if concern not in folders:
                    broken.append(f"{concern}/{name}: its folder is not in src/CMakeLists.txt")
                    continue
                read_file(concern, os.path.join(folder, name), modules, broken)
    for module in modules.values():
        module.uses &= modules.keys()
    return folders, modules, broken


def check_uses(folders, modules, broken):
    """Add uses against the stream, circles, namelists where there should be none, modules that nobody uses."""
    place = {folder: number for number, folder in enumerate(folders)}
    for module in modules.values():
        for name in sorted(module.uses):
            used = modules[name]
            if place[used.folder] > place[module.folder]:
                broken.append(f"{module.path}: uses {name} of {used.folder}/, which comes after {module.folder}/")
            if used.folder in NAMELISTS and module.folder not in READERS:
                broken.append(f"{module.path}: uses {name}; only {', '.join(READERS)} may see a namelist")
    for ring in circles(modules):
        broken.append("circle: " + " -> ".join(ring))
    used = set().union(*(module.uses for module in modules.values()))
    for name in sorted(modules.keys() - used):
        if not modules[name].is_program and name not in ENTRIES:
            broken.append(f"{modules[name].path}: no other file uses {name}")


def check_names(modules, broken):
    """Add names that a file imports and does not use, and public ones that no other file uses, be it a test."""
    tests = set()
    for folder, _, names in os.walk(os.path.join(ROOT, "tests")):
        for name in names:
            if name.endswith((".f90", ".pf")):
                with open(os.path.join(folder, name), encoding="utf-8") as stream:
                    tests.update(WORD.findall(stream.read().lower()))
    for module in modules.values():
        for name in module.imports:
            if module.words.count(name) < 2:
                broken.append(f"{module.path}: imports {name} and does not use it")
        for name in module.exports if module.name not in ENTRIES else ():
            if name not in tests and not any(name in other.words for other in modules.values() if other is not module):
                broken.append(f"{module.path}: no other file uses {name}, which is public")


def check_words(modules, broken):
    """Add names that hold a word for which the field has a term, unless the list excepts them with a reason."""
    refused, excepted = {}, {}
    with open(WORDS, encoding="utf-8") as stream:
        for line in stream:
            if line.strip() and not line.startswith("#"):
                word, text = (side.strip() for side in line.split(":", 1))
                if word.startswith("except "):
                    excepted[word.removeprefix("except ")] = text
                else:
                    refused[word] = text
    seen = set()
    for module in modules.values():
        for name in sorted(set(module.words) | {module.name}):
            found = [word for word in refused if f"_{word}_" in f"_{name}_"]
            if name in excepted:
                seen.add(name)
            elif found:
                broken.append(f"{module.path}: {name} holds '{found[0]}', for which .ci/words.txt has: {refused[found[0]]}")
    for name in sorted(excepted):
        if name not in seen:
            broken.append(f".ci/words.txt: excepts {name}, which no file holds")
        if not excepted[name]:
            broken.append(f".ci/words.txt: excepts {name} without a reason")


def circles(modules):
    """Rings of modules that use each other."""
    found, state = [], {}

    def visit(name, path):
        state[name] = "open"
        for next_name in sorted(modules[name].uses):
            if state.get(next_name) == "open":
                found.append(path[path.index(next_name):] + [next_name])
            elif next_name not in state:
                visit(next_name, path + [next_name])
        state[name] = "done"

    for name in sorted(modules):
        if name not in state:
            visit(name, [name])
    return found


def layers(names, modules):
    """Names in groups, each using only those of earlier groups."""
    depth = {}

    def depth_of(name):
        if name not in depth:
            depth[name] = 0  # ends a circle
            depth[name] = max([1 + depth_of(other) for other in modules[name].uses & names], default=0)
        return depth[name]

    for name in names:
        depth_of(name)
    return [sorted(name for name in names if depth[name] == level) for level in range(max(depth.values(), default=-1) + 1)]


def draw(folders, modules):
    """The drawing as text: nothing that every change would move, such as a count."""
    lines, numbers = [], {folder: number for number, folder in enumerate(folders, start=1)}
    members = {folder: {name for name, module in modules.items() if module.folder == folder} for folder in folders}
    room = max(len(folder) for folder in folders)
    purpose_room = max(len(purpose) for purpose in folders.values())
    columns = "".join(f"{number:3d}" for number in numbers.values())
    lines.append(f"    {'folder':{room}}  {'what it is for':{purpose_room}}{columns}")
    for folder, number in numbers.items():
        row = ""
        for other, place in numbers.items():
            is_used = any(modules[name].uses & members[other] for name in members[folder])
            row += f"{'x' if is_used else '.':>3}" if place <= number or is_used else ""
        lines.append(f"{number:3d} {folder:{room}}  {folders[folder]:{purpose_room}}{row}".rstrip())
    lines.append("")
    for folder in folders:
        text = " | ".join(" ".join(group) for group in layers(members[folder], modules))
        lines += textwrap.wrap(text, 118, initial_indent=f"{folder:{room}}  ", subsequent_indent=" " * (room + 2),
                               break_on_hyphens=False)
    return "\n".join(lines) + "\n"


def check_page(page, drawing, broken):
    """Is the drawing there, and is all that is named in CONTRIBUTING.md there?"""
    if BEGIN not in page or END not in page:
        broken.append("CONTRIBUTING.md: has no place for the drawing")
    elif page.split(BEGIN)[1].split(END)[0] != drawing:
        broken.append("CONTRIBUTING.md: the drawing is out of date: .ci/house.py --write")
    source = ""
    for folder, _, names in os.walk(os.path.join(ROOT, "src")):
        for name in sorted(names):
            with open(os.path.join(folder, name), encoding="utf-8") as stream:
                source += stream.read().lower()
    words = set(re.findall(r"\w+", source))
    for quoted in re.findall(r"`([^`\n]+)`", page):
        if "/" in quoted and re.fullmatch(r"[\w.][\w./-]*", quoted):
            if not os.path.exists(os.path.join(ROOT, quoted)) and not quoted.startswith("build/"):
                broken.append(f"CONTRIBUTING.md: there is no {quoted}")
        elif re.fullmatch(r"[a-z]\w*_\w+", quoted) and quoted not in words:
            broken.append(f"CONTRIBUTING.md: no {quoted} in src/")
    with open(os.path.join(ROOT, "docs", "theory.md"), encoding="utf-8") as stream:
        theory = stream.read()
    sections = set(re.findall(r"^## (\d+)\.", theory, re.MULTILINE))
    contents = " ".join(theory.split("\n## ")[0].split())
    for number, title in re.findall(r"^## (\d+)\. (.*)$", theory, re.MULTILINE):
        if f"{number}. [{title}](#{number}-" not in contents:
            broken.append(f"docs/theory.md: its contents do not name section {number}, {title}")
    for named in re.findall(r"theory\.md, sections? ((?:\d+(?:, | and )?)+)", source):
        for number in sorted(set(re.findall(r"\d+", named)) - sections):
            broken.append(f"src/: points to section {number} of docs/theory.md, which is not there")


def main(arguments):
    """Draw, check or write."""
    folders, modules, broken = read_house()
    drawing = draw(folders, modules)
    if arguments not in ([], ["--check"], ["--write"]):
        print(__doc__, file=sys.stderr)
        return 2
    if not arguments:
        print(drawing, end="")
        return 0
    with open(PAGE, encoding="utf-8") as stream:
        page = stream.read()
    if arguments == ["--write"]:
        before, after = page.split(BEGIN)[0], page.split(END)[1]
        with open(PAGE, "w", encoding="utf-8") as stream:
            stream.write(before + BEGIN + drawing + END + after)
        return 0
    check_uses(folders, modules, broken)
    check_names(modules, broken)
    check_words(modules, broken)
    check_page(page, drawing, broken)
    for what in broken:
        print("house.py: " + what)
    print(f"house: {len(modules)} modules in {len(folders)} folders, {len(broken)} rules broken")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
