"""Translate a .pf file into Fortran for the stand-in `funit`, or write the main program of a suite.

    translate_pf.py file FILE.pf FILE.f90
    translate_pf.py driver DRIVER.f90 MODULE...

A directive stands alone on its line: @test, @before, @after before a subroutine, or an @assert... call.
"""

import os
import re
import sys

ASSERTS = {
    "assertequal", "asserttrue", "assertfalse", "assertlessthan", "assertlessthanorequal",
    "assertgreaterthan", "assertgreaterthanorequal", "assertrelativelyequal", "assertisnan",
    "assertisfinite", "assertexceptionraised",
}
MARKS = {"test", "before", "after"}
DIRECTIVE = re.compile(r"^\s*@(\w+)\s*(.*)$")
SUBROUTINE = re.compile(r"^\s*subroutine\s+(\w+)", re.IGNORECASE)
BARE = re.compile(r"^\s*subroutine\s+(\w+)\s*(?:\(\s*\))?\s*(?:!.*)?$", re.IGNORECASE)
FRAME = re.compile(r"^\s*(?:!|(?:end\s+)?subroutine\b)", re.IGNORECASE)
MODULE = re.compile(r"^\s*module\s+(\w+)\s*(!.*)?$", re.IGNORECASE)


class TranslationError(Exception):
    """A line that cannot be translated."""


def translate(path):
    """Lines of Fortran for a .pf file."""
    stem = os.path.splitext(os.path.basename(path))[0]
    out = [f'# 1 "{path}"']
    module, mark = None, None
    tests, before, after = [], None, None
    with open(path, encoding="utf-8") as stream:
        lines = stream.read().splitlines()
    for number, line in enumerate(lines, start=1):
        where = f"{path}:{number}: "
        found = DIRECTIVE.match(line)
        if found:
            word, rest = found.group(1).lower(), found.group(2).strip()
            if mark:
                raise TranslationError(where + f"a subroutine must follow @{mark}")
            if word in MARKS:
                if rest:
                    raise TranslationError(where + f"@{word} stands alone on its line")
                mark = word
                out.append("")
            elif word in ASSERTS:
                if not (rest.startswith("(") and rest.endswith(")")):
                    raise TranslationError(where + f"@{found.group(1)} needs its arguments and nothing else on one line")
                inner = rest[1:-1].strip()
                comma = ", " if inner else ""
                call = f"  call {found.group(1)}({inner}{comma}&"
                if len(call) > 132:
                    raise TranslationError(where + f"pFUnit makes {len(call)} columns of this line, Fortran takes 132")
                out.append(call)
                out.append(f"   & location=SourceLocation( &")
                out.append(f"   & '{os.path.basename(path)}', {number}))")
                out.append("if (anyExceptions()) return")
                out.append(f'# {number + 1} "{path}"')
            else:
                raise TranslationError(where + f"unknown directive @{found.group(1)}")
            continue
        name = SUBROUTINE.match(line)
        if mark and name:
            if mark == "test":
                tests.append(name.group(1))
            elif mark == "before":
                before = name.group(1)
            else:
                after = name.group(1)
            mark = None
        elif mark and line.strip() and not line.strip().startswith("!"):
            raise TranslationError(where + f"a subroutine must follow @{mark}")
        opened = MODULE.match(line)
        if opened and module is None and opened.group(1).lower() != "procedure":
            module = opened.group(1)
        out.append(line)
    if module is None or module.lower() != stem.lower():
        raise TranslationError(f"{path}: the module must be named as its file, {stem}")
    if not tests:
        raise TranslationError(f"{path}: there is no @test in it")
    lost = lost_in(lines, {*tests, before, after})
    if lost:
        raise TranslationError(f"{path}: without @test, and named nowhere: {', '.join(lost)}")
    if any(len(name) > 44 for name in tests):
        names = ', '.join(name for name in tests if len(name) > 44)
        raise TranslationError(f"{path}: names of tests longer than 44 characters: {names}")
    out += ["", f"module Wrap_{stem}", "   use funit, only: add_test, test_suite_t", f"   use {module}",
            "   implicit none (type, external)", "   private", f"   public :: {stem}_suite", "contains",
            f"   function {stem}_suite() result(suite)", "      type(test_suite_t) :: suite", "",
            f"      suite%name = '{stem}'"]
    for test in tests:
        extra = "".join(f", &\n         {key}={value}" for key, value in (("before", before), ("after", after)) if value)
        out.append(f"      call add_test(suite, '{test}', {test}{extra})")
    out += [f"   end function {stem}_suite", f"end module Wrap_{stem}"]
    return out


def lost_in(lines, used):
    """Subroutines without arguments that nothing else names: tests that lost their mark."""
    bare = [found.group(1) for found in map(BARE.match, lines) if found]
    text = "\n".join(line for line in lines if not FRAME.match(line))
    return [name for name in bare if name not in used and not re.search(rf"\b{name}\b", text, re.IGNORECASE)]


def driver(modules):
    """The main program that runs the suites of some modules."""
    out = ["program run_tests", "   use funit, only: run_suites, test_suite_t"]
    out += [f"   use Wrap_{name}, only: {name}_suite" for name in modules]
    out += ["   implicit none (type, external)", f"   type(test_suite_t) :: suites({len(modules)})", ""]
    out += [f"   suites({i}) = {name}_suite()" for i, name in enumerate(modules, start=1)]
    return out + ["   call run_suites(suites)", "end program run_tests"]


def main(arguments):
    """Write the file asked for."""
    try:
        if arguments[0] == "file":
            target, lines = arguments[2], translate(arguments[1])
        else:
            target, lines = arguments[1], driver(arguments[2:])
    except TranslationError as error:
        print(error, file=sys.stderr)
        return 1
    with open(target, "w", encoding="utf-8") as stream:
        stream.write("\n".join(lines) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
