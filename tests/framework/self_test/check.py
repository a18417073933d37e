"""Check that what must fail fails, with a status and a message that names file and line."""

import os
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
TRANSLATOR = os.path.join(HERE, os.pardir, "translate_pf.py")


def run(*command):
    """Status and output of a command."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def lines_with(path, word):
    """Numbers of the lines of a file that hold a word."""
    with open(path, encoding="utf-8") as stream:
        return [number for number, line in enumerate(stream, start=1) if word in line]


def check(condition, what):
    """Stop at the first thing that is not so."""
    if not condition:
        sys.exit("stand-in: " + what)


def refused(name, text, word):
    """A .pf file that the translator must refuse, with a message that holds a word."""
    with tempfile.TemporaryDirectory() as folder:
        source = os.path.join(folder, name)
        with open(source, "w", encoding="utf-8") as stream:
            stream.write(text)
        target = os.path.join(folder, "out.f90")
        status, output = run(sys.executable, TRANSLATOR, "file", source, target)
        check(status != 0 and word in output and name in output, f"{name} was not refused: {output}")
        check(not os.path.exists(target), f"{name} left a file")


def main(failing, stopping, hollow, empty):
    """Run them all."""
    status, output = run(failing)
    asserts = lines_with(os.path.join(HERE, "failing.pf"), "@assert")
    check(status != 0, "failing assertions end with status 0")
    for number in asserts:
        check(f"failing.pf:{number}:" in output, f"the failure in line {number} is not named")
    check(f"Tests run: {len(asserts)}, Failures: {len(asserts)}" in output, "the count of failures is wrong")
    check(" OK" not in output, "failing assertions print OK")
    _, output = run(stopping)
    check(" OK" not in output, "a test that stops the program prints OK")
    status, output = run(hollow)
    check(status != 0 and "hollow.asserts_nothing" in output and "no assertion was reached" in output
          and "Tests run: 3, Failures: 2" in output, "a test that asserts nothing passes")
    status, output = run(empty)
    check(status != 0 and " OK" not in output, "a suite without tests passes")
    refused("odd.pf", "module odd\ncontains\n@tset\nsubroutine a()\nend subroutine a\nend module odd\n", "@tset")
    refused("name.pf", "module other\nend module other\n", "named as its file")
    refused("bare.pf", "module bare\ncontains\n@assertTrue\nend module bare\n", "needs its arguments")
    refused("wide.pf", f"module wide\ncontains\n@assertTrue({'a' * 120})\nend module wide\n", "columns of this line")
    refused("loose.pf", "module loose\ncontains\n@test\ninteger :: i\nend module loose\n", "must follow @test")
    refused("empty.pf", "module empty\nend module empty\n", "no @test")
    refused("lost.pf", "module lost\ncontains\n@test\nsubroutine a()\nend subroutine a\n"
            "subroutine b()\nend subroutine b\nend module lost\n", "named nowhere: b")
    print("the stand-in fails where it must")


if __name__ == "__main__":
    main(*sys.argv[1:])
