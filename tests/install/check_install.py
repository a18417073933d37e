"""Checks of an installation that was moved: check_install.py SOURCE BUILD PLACE PART

install     cmake --install into a folder, which is then given another name, PLACE
programs    the programs and the scripts run there
words       every option of --help is in the man page and the completions
completion  what bash offers
library     a program of others is built there with CMake and with pkg-config, and runs
release     the version is in the changelog
"""

import os
import re
import shutil
import subprocess
import sys

SOURCE, BUILD, PLACE, PART = sys.argv[1:]
BIN = os.path.join(PLACE, "bin")


def run(*command, status=0, cwd=None, **variables):
    """Run a command; what it said on standard output and standard error."""
    done = subprocess.run(command, cwd=cwd, env={**os.environ, **variables}, text=True, check=False,
                          stdin=subprocess.DEVNULL, capture_output=True)
    if done.returncode != status:
        sys.exit(f"{' '.join(command)}: status {done.returncode}, not {status}\n{done.stdout}{done.stderr}")
    return done.stdout, done.stderr


def read(*path):
    """A text file."""
    with open(os.path.join(*path), encoding="utf-8") as stream:
        return stream.read()


def demand(condition, words):
    """End if something does not hold."""
    if not condition:
        sys.exit(words)


def folder(name):
    """An empty folder beside PLACE."""
    path = os.path.join(os.path.dirname(PLACE), name)
    shutil.rmtree(path, ignore_errors=True)
    os.makedirs(path)
    return path


def install():
    """Installed in one place, found in another; nothing in it names the first."""
    first = folder("first place")
    shutil.rmtree(PLACE, ignore_errors=True)
    run(os.environ["CMAKE"], "--install", BUILD, "--prefix", first)
    os.rename(first, PLACE)
    size = 0
    for path, _, names in os.walk(PLACE):
        for name in names:
            size += os.lstat(os.path.join(path, name)).st_size
            with open(os.path.join(path, name), "rb") as stream:
                demand(first.encode() not in stream.read(), f"{path}/{name} names the place of installation")
    demand(os.environ["FFLAGS"] or size < 60e6, f"{size} bytes are installed")
    readme = os.path.join(PLACE, "share", "doc", "impactbeam", "README.md")
    for link in re.findall(r"\]\(([\w/.]+)\)", read(readme)):
        demand(os.path.exists(os.path.join(os.path.dirname(readme), link)) or link == "CONTRIBUTING.md", f"README: no {link} is installed")


def programs():
    """They run, and find what they need."""
    # a library in the current folder is not theirs
    strange = folder("strange")
    with open(os.path.join(strange, "libm.so.6"), "wb"):
        pass
    for name in ("impactbeam", "impactbeam-paper", "impactbeam-benchmark"):
        for where in (BUILD, BIN):
            said = run(os.path.join(where, name), "--version", cwd=strange)[0]
            demand(said == f"{name} {os.environ['VERSION']}\n", f"{name} --version")
    examples = os.path.join(PLACE, "share", "impactbeam", "examples")
    here = folder("programs")
    run(os.path.join(BIN, "impactbeam"), "--quiet", os.path.join(examples, "fig04_preload_0.nml"), cwd=here)
    demand(os.path.isfile(os.path.join(here, "results", "fig04_preload_0.h5")), "no results file")
    plot = os.path.join(BIN, "impactbeam-plot")
    kinds = sorted(name[5:-3] for name in os.listdir(os.path.join(SOURCE, "scripts")) if name.startswith("plot_"))
    demand("response" in kinds and ", ".join(kinds) in run(plot, "--help")[0], "impactbeam-plot --help")
    demand("must be one of" in run(plot, "nothing", status=2)[1], "impactbeam-plot nothing")
    # where there is no Python
    bare = os.path.join(here, "impactbeam-plot")
    with open(bare, "w", encoding="utf-8") as stream:
        stream.write(read(plot).replace("/usr/bin/python3", "/no/python3"))
    os.chmod(bare, 0o755)
    said = run(bare, "response", status=1, PATH="/no")[1]
    demand(said == "impactbeam-plot: needs Python 3; on Debian: apt-get install python3 python3-h5py python3-matplotlib\n", said)
    if subprocess.run(["/usr/bin/python3", "-c", "import h5py, matplotlib"], capture_output=True, check=False).returncode == 0:
        demand(run(plot, "response", "results/fig04_preload_0.h5", cwd=here)[0] == "results/fig04_preload_0.png\n", "no picture")
        said = run(plot, "response", "none.h5", status=2)[1]
        demand(said == "impactbeam-plot response: none.h5: no such file\n", said)


def words():
    """No page forgets an option."""
    options = set(re.findall(r"--[a-z]+", run(os.path.join(BIN, "impactbeam"), "--help")[0]))
    demand(len(options) >= 8, "--help tells no options")
    page = read(PLACE, "share", "man", "man1", "impactbeam.1").replace("\\-", "-")
    for program in ("paper", "benchmark", "plot"):
        demand(read(PLACE, "share", "man", "man1", f"impactbeam-{program}.1") == ".so man1/impactbeam.1\n", f"no page of {program}")
    bash = read(PLACE, "share", "bash-completion", "completions", "impactbeam")
    zsh = read(PLACE, "share", "zsh", "site-functions", "_impactbeam")
    for option in sorted(options):
        for name, text in (("the man page", page), ("bash", bash), ("zsh", zsh)):
            demand(re.search(option + r"\b", text), f"{name} does not know {option}")
    for name, text in (("the man page", page), ("bash", bash), ("zsh", zsh)):
        unknown = set(re.findall(r"(?<![-\w])--[a-z]+", text)) - options
        demand(not unknown, f"{name} knows {unknown}, which do not exist")
    if shutil.which("man"):
        said = run("man", "--warnings", "-l", os.path.join(PLACE, "share", "man", "man1", "impactbeam.1"), LC_ALL="C.UTF-8")
        demand(not said[1] and "EXIT STATUS" in said[0], f"man: {said[1]}")


def offered(line):
    """What bash offers for the last word of a line."""
    script = 'source "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _${1//-/_}; printf "%s\\n" "${COMPREPLY[@]}"'
    completion = os.path.join(PLACE, "share", "bash-completion", "completions", "impactbeam")
    said = run("bash", "-c", script, "bash", completion, *line, cwd=folder("completion"),
               PATH=BIN + os.pathsep + os.environ["PATH"])
    return said[0].split()


def completion():
    """Options, scenes, kinds of pictures."""
    demand(offered(["impactbeam", "--th"]) == ["--threads"], "--th is not completed")
    demand(offered(["impactbeam", os.path.join(SOURCE, "inputs", "valve_r")])
           == os.path.join(SOURCE, "inputs", "valve_reed.nml").split(), "a scene is not completed")
    demand(offered(["impactbeam-plot", "resp"]) == ["response"], "a kind of picture is not completed")


def library():
    """The example, built and run."""
    example = os.path.join(PLACE, "share", "impactbeam", "examples", "library")
    here = folder("library of others")
    cmake = os.environ["CMAKE"]
    said = run(cmake, "-S", example, "-B", here, "-G", os.environ["GENERATOR"], f"-DCMAKE_PREFIX_PATH={PLACE}")[1]
    demand("Warning" not in said, said)
    run(cmake, "--build", here)
    said = run("./softest_stop", cwd=here)[0]
    demand(said.split() == [f"results/stop_{number}.h5" for number in (2, 5, 8)], said)
    # a wrong scene is told, and stops nothing
    source = read(example, "softest_stop.f90").replace("[0.2, 0.5, 0.8]", "[0.2, 1.5, 0.8]")
    with open(os.path.join(here, "wrong.f90"), "w", encoding="utf-8") as stream:
        stream.write(source)
    if not shutil.which("pkg-config"):
        return
    found = os.path.join(PLACE, "lib")
    paths = [path for path, _, names in os.walk(found) if "impactbeam.pc" in names]
    flags = run("pkg-config", "--cflags", "--libs", "impactbeam", PKG_CONFIG_PATH=paths[0])[0]
    build = f"{os.environ['FC']} {os.environ['FFLAGS']} wrong.f90 -o wrong {flags}"
    run("sh", "-c", build, cwd=here)
    said = run("./wrong", status=1, cwd=here)[0]
    demand("stop_15.nml:1: &stop restitution = 1.5" in said, said)


def release():
    """Who changes the version says so in the changelog."""
    demand(f"\n## [{os.environ['VERSION']}] - " in read(SOURCE, "CHANGELOG.md"), "CHANGELOG.md does not know this version")


PARTS = {part.__name__: part for part in (install, programs, words, completion, library, release)}

if __name__ == "__main__":
    PARTS[PART]()
