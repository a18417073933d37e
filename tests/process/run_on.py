"""Start a program under circumstances that a test asks for, and leave what came of it in files.

    run_on.py [OPTIONS] -- PROGRAM ARGUMENT... [--and PROGRAM ARGUMENT...]
    run_on.py --serve PROCESS

A new test is a .pf file in the list of CMakeLists.txt here; in it, with `use process_runs, only: ...`,
    @assertEqual(0, status_of('--out new scene.nml', on='--terminal 80x24'), message=said_errors())
    @assertTrue(index(said_on_terminal(), 'cases a second') > 0)
`on` holds OPTIONS of the list below (run_on.py --help): streams on a terminal, closed, full or broken; limits; a
full disk; processes under MPI; signals; `beside` starts a second one at the same time. Every start has an end: after
--timeout seconds (default: IMPACTBEAM_TIMEOUT of the suite) all that was started is killed, status 124.
The status is the program's, 128 + n after signal n, 99 when a sanitizer spoke; the greatest of several.
Files left: run.out, run.errors, run.terminal (what each stream got), run.status (each status, then the seconds).
With --serve each request of the pipe `run.requests` is such a command line, of words that NUL ends, and then `end`. A
process of its own, which need not load Python, does what it asks. Its status goes to the pipe `run.answers`. That ends
with the PROCESS.
What needs a limit that sanitizers do not bear, MPI or a mount goes into a list that CMakeLists.txt asks first.
"""

import argparse
import ctypes
import fcntl
import glob
import os
import pty
import re
import resource
import select
import signal
import struct
import subprocess
import sys
import termios
import threading
import time

STREAMS = ("stdin", "stdout", "stderr")
LIMITS = {"address_space": resource.RLIMIT_AS, "stack": resource.RLIMIT_STACK, "file_size": resource.RLIMIT_FSIZE,
          "open_files": resource.RLIMIT_NOFILE, "cpu_time": resource.RLIMIT_CPU}
TIMED_OUT, SANITIZER_SPOKE = 124, 99
# Open MPI keeps memory of its own until the end, which is no leak of the program's.
UNDER_MPI = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "ASAN_OPTIONS": "detect_leaks=0"}
# A program goes down with this one.
LIBC, PR_SET_PDEATHSIG = ctypes.CDLL(None), 1
SANITIZER = re.compile(rb"Sanitizer|runtime error:")


def options_of(arguments):
    """The options."""
    parser = argparse.ArgumentParser(prog="run_on.py", formatter_class=argparse.RawDescriptionHelpFormatter)
    for stream in STREAMS:
        parser.add_argument(f"--{stream}", default="null" if stream == "stdin" else "pipe", metavar="WHERE",
                            help="pipe, terminal, closed, full (/dev/full), null, broken (nobody reads) or a file")
    parser.add_argument("--terminal", metavar="COLUMNSxROWS", help="all three streams on a terminal of that size")
    parser.add_argument("--limit", action="append", default=[], metavar="NAME=NUMBER",
                        help="a limit, in bytes or seconds: " + ", ".join(LIMITS))
    parser.add_argument("--ignore", action="append", default=[], metavar="SIGNAL",
                        help="a signal that is ignored at the start, as XFSZ beside the limit file_size")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="an environment variable")
    parser.add_argument("--processes", type=int, metavar="N", help="as N processes under MPI")
    parser.add_argument("--disk", metavar="SIZE", help="with a disk of that size, as 200k, mounted on the folder `disk`")
    parser.add_argument("--signal", action="append", default=[], nargs=2, metavar=("SIGNAL", "WHEN"),
                        help="send a signal after WHEN seconds, once a text was said (said:TEXT), or said so often "
                             "(times:NUMBER:TEXT), or a file is there (file:PATTERN)")
    parser.add_argument("--share", type=float, default=1.0, metavar="NUMBER",
                        help="let it run for this share of the time only, 0 to 1, where nothing but time has to pass")
    parser.add_argument("--timeout", type=float, default=float(os.environ.get("IMPACTBEAM_TIMEOUT", "120")),
                        metavar="SECONDS")
    return parser.parse_args(arguments)


class Start:
    """One program that was started, and what it says."""

    def __init__(self, command, options):
        self.said = {"out": bytearray(), "errors": bytearray(), "terminal": bytearray()}
        self.readers, self.begin = [], time.monotonic()
        where = [options.__dict__[stream] for stream in STREAMS]
        if options.terminal:
            where = ["terminal"] * 3
        self.master = self.slave = None
        if "terminal" in where:
            self.master, self.slave = pty.openpty()
            columns, rows = map(int, (options.terminal or "80x24").split("x"))
            fcntl.ioctl(self.slave, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        ends = [self.end_for(number, name) for number, name in enumerate(where)]
        closed = [number for number, name in enumerate(where) if name == "closed"]
        limits = [(LIMITS[name], int(number)) for name, number in (text.split("=") for text in options.limit)]

        def prepare():
            LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
            for limit, number in limits + [(resource.RLIMIT_CORE, 0)]:
                resource.setrlimit(limit, (number, number))
            for name in options.ignore:
                signal.signal(getattr(signal, "SIG" + name), signal.SIG_IGN)
            if self.slave is not None:
                fcntl.ioctl(self.slave, termios.TIOCSCTTY, 0)
            for number in closed:
                os.close(number)

        environment = os.environ | (UNDER_MPI if options.processes else {})
        environment |= dict(text.split("=", 1) for text in options.set)
        self.process = subprocess.Popen(command, stdin=ends[0], stdout=ends[1], stderr=ends[2], env=environment,
                                        start_new_session=True, preexec_fn=prepare)
        for end in {end for end in ends if end not in (subprocess.DEVNULL, self.slave)}:
            os.close(end)
        if self.slave is not None:
            os.close(self.slave)
            self.listen(self.master, "terminal")

    def end_for(self, number, name):
        """The program's end of a stream."""
        if name == "terminal":
            return self.slave
        if name in ("null", "closed"):
            return subprocess.DEVNULL
        if name == "full":
            return os.open("/dev/full", os.O_RDWR)
        if name in ("pipe", "broken"):
            reader, writer = os.pipe()
            if number == 0:
                os.close(writer)
                return reader
            if name == "broken":
                os.close(reader)
            else:
                self.listen(reader, ("out", "errors")[number - 1])
            return writer
        return os.open(name, os.O_RDONLY if number == 0 else os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)

    def listen(self, descriptor, name):
        """Keep what comes out of a pipe or a terminal, to its end."""
        def read():
            try:
                while piece := os.read(descriptor, 65536):
                    self.said[name] += piece
            except OSError:  # the other side of a terminal is gone
                pass
        self.readers.append(threading.Thread(target=read, daemon=True))
        self.readers[-1].start()

    def is_due(self, when):
        """Is it time for a signal?"""
        kind, _, what = when.partition(":")
        if kind == "said":
            return any(what.encode() in said for said in self.said.values())
        if kind == "times":
            number, _, text = what.partition(":")
            return any(said.count(text.encode()) >= int(number) for said in self.said.values())
        if kind == "file":
            return bool(glob.glob(what))
        return time.monotonic() - self.begin >= float(when)

    def status(self):
        """How it ended, as a shell says it; to be asked once."""
        kill_session(self.process.pid)
        for reader in self.readers:
            reader.join(5)
        if any(SANITIZER.search(said) for said in self.said.values()):
            return SANITIZER_SPOKE
        code = self.process.returncode
        return code if code >= 0 else 128 - code


def kill_session(leader):
    """Kill all that a program left behind: its session, whatever groups there are in it."""
    for entry in glob.glob("/proc/[0-9]*/stat"):
        try:
            with open(entry, encoding="utf-8", errors="replace") as stream:
                session = stream.read().rpartition(")")[2].split()[3]
            if int(session) == leader:
                os.kill(int(entry.split("/")[2]), signal.SIGKILL)
        except OSError:  # it has just ended
            pass


def wait_for(starts, options):
    """Wait until all have ended, send the signals on the way; say whether time was enough."""
    to_send = list(options.signal)
    while any(start.process.poll() is None for start in starts):
        for one in list(to_send):
            if starts[0].is_due(one[1]):
                to_send.remove(one)
                if starts[0].process.poll() is None:
                    os.killpg(starts[0].process.pid, getattr(signal, "SIG" + one[0]))
        if options.share < 1.0 and starts[0].process.poll() is None:
            is_stopped = 10.0 * (time.monotonic() - starts[0].begin) % 1.0 > options.share
            os.killpg(starts[0].process.pid, signal.SIGSTOP if is_stopped else signal.SIGCONT)
        if time.monotonic() - starts[0].begin > options.timeout:
            for start in starts:
                kill_session(start.process.pid)
                start.process.wait()
            return False
        time.sleep(0.002)
    return True


def commands_of(words, options):
    """The commands of a list of words that --and divides, with what goes before each of them."""
    before = []
    if options.disk:
        os.makedirs("disk", exist_ok=True)
        mount = f'mount -t tmpfs -o size={options.disk} none disk && exec "$@"'
        before = ["unshare", "-m" if os.geteuid() == 0 else "-rm", "sh", "-c", mount, "sh"]
    if options.processes:
        before += [os.environ["IMPACTBEAM_MPIRUN"], "--oversubscribe", "-n", str(options.processes)]
    commands = [before[:]]
    for word in words:
        if word == "--and":
            commands.append(before[:])
        else:
            commands[-1].append(word)
    return commands


def main(arguments):
    """Start, wait, write the files."""
    divide = arguments.index("--") if "--" in arguments else len(arguments)
    options = options_of(arguments[:divide])
    starts = [Start(command, options) for command in commands_of(arguments[divide + 1:], options)]
    in_time = wait_for(starts, options)
    seconds = time.monotonic() - starts[0].begin
    statuses = [start.status() if in_time else TIMED_OUT for start in starts]
    if not in_time:
        starts[0].said["errors"] += f"run_on.py: killed after {options.timeout:g} s\n".encode()
    for name in starts[0].said:
        with open("run." + name, "wb") as stream:
            stream.write(b"".join(start.said[name] for start in starts))
    with open("run.status", "w", encoding="utf-8") as stream:
        stream.write("\n".join([*map(str, statuses), f"{seconds:.3f}"]) + "\n")
    return max(statuses)


def serve(process):
    """Answer requests, of which none comes before the last one is answered."""
    # what a shell starts in the background ignores them
    for number in (signal.SIGINT, signal.SIGQUIT):
        signal.signal(number, signal.SIG_DFL)
    requests, answers = (os.open("run." + pipe, os.O_RDWR) for pipe in ("requests", "answers"))
    said = b""
    while os.path.exists(f"/proc/{process}"):
        if not select.select([requests], [], [], 1.0)[0]:
            continue
        said += os.read(requests, 65536)
        if not said.endswith(b"\0end\0"):
            continue
        words, said = os.fsdecode(said).split("\0")[:-2], b""
        child = os.fork()
        if child == 0:
            os.close(requests)
            os.close(answers)
            try:
                os._exit(main(words))
            finally:  # it was not understood
                os._exit(125)
        os.write(answers, b"%d\n" % os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))


if __name__ == "__main__":
    sys.exit(serve(sys.argv[2]) if sys.argv[1:2] == ["--serve"] else main(sys.argv[1:]))
