# SPDX-License-Identifier: MIT
"""One case: a fresh folder, the commands that run in it under bounds, and what was wrong with them."""

import hashlib
import os
import random
import re
import resource
import select
import shlex
import shutil
import signal
import stat
import subprocess
import time

WALL_LIMIT = 120  # s; longer where it waits for the processor, as a run at idle priority may for long
CPU_LIMIT = 40  # s per command; the longest here takes 2
MEMORY_LIMIT = 1 << 30  # bytes resident
DATA_LIMIT = 8 << 30  # bytes of RLIMIT_DATA, so that a runaway ends before the machine does
FILE_LIMIT = 1 << 30  # bytes of RLIMIT_FSIZE

# What a terminal acts on: C0 except tab and newline, DEL, C1, and marks that change the direction of text.
CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]")


class Result:
    def __init__(self, code, out, err, cpu, start, wall, rss, timed_out):
        self.code, self.out, self.err, self.start = code, out, err, start
        self.cpu, self.wall, self.rss, self.timed_out = cpu, wall, rss, timed_out

    def last_words(self):
        return (self.err.strip() or self.out.strip())[-400:]


def hash_of(path):
    with open(path, "rb") as file:
        return hashlib.sha256(file.read()).hexdigest()[:16]


def snapshot(root):
    """-> {path below root: what it is}; follows no link and opens no FIFO."""
    found = {}
    for folder, folders, files in os.walk(root):
        for name in folders + files:
            path = os.path.join(folder, name)
            status = os.lstat(path)
            mode = f"{stat.S_IFMT(status.st_mode):o} {stat.S_IMODE(status.st_mode):o}"
            if stat.S_ISLNK(status.st_mode):
                mode += " -> " + os.readlink(path)
            elif stat.S_ISREG(status.st_mode):
                mode += f" {status.st_size} {hash_of(path)}"
            found[os.path.relpath(path, root)] = mode
    return found


def wants_processor(pid):
    """Whether one of the process's threads could run, in one of ten looks a tenth of a second apart."""
    for _ in range(10):
        try:
            for thread in os.listdir(f"/proc/{pid}/task"):
                with open(f"/proc/{pid}/task/{thread}/stat", encoding="utf-8", errors="replace") as file:
                    if file.read().rpartition(")")[2].split()[0] == "R":
                        return True
        except (FileNotFoundError, ProcessLookupError):
            return True  # it is about to end
        time.sleep(0.1)
    return False


def run_bounded(command, cwd, environment, **options):
    """options: stdin, stdout, stderr as for Popen; limits {resource: value}; poke(process) is called once it runs; user: the user
    to run as; streams: where the text of both goes."""
    streams = options.get("streams", cwd)
    out_path, err_path = streams + ".stdout", streams + ".stderr"
    limits = {resource.RLIMIT_CORE: 0, resource.RLIMIT_CPU: CPU_LIMIT, resource.RLIMIT_DATA: DATA_LIMIT,
              resource.RLIMIT_FSIZE: FILE_LIMIT, **options.get("limits", {})}

    def before():
        for which, value in limits.items():
            resource.setrlimit(which, (value, value + 5 if which == resource.RLIMIT_CPU else value))
        options.get("before", lambda: None)()

    with open(out_path, "wb") as out, open(err_path, "wb") as err:
        start = time.monotonic()
        process = subprocess.Popen(
            command, cwd=cwd, env=environment, stdin=options.get("stdin", subprocess.DEVNULL),
            stdout=options.get("stdout", out), stderr=options.get("stderr", err), start_new_session=True,
            preexec_fn=before, user=options.get("user"))
        if "poke" in options:
            options["poke"](process)
        handle = os.pidfd_open(process.pid)
        poll = select.poll()
        poll.register(handle, select.POLLIN)
        timed_out = not poll.poll(1000 * options.get("wall", WALL_LIMIT))
        while timed_out and wants_processor(process.pid):
            timed_out = not poll.poll(10_000)
        if timed_out:
            os.killpg(process.pid, signal.SIGKILL)
        _, status, usage = os.wait4(process.pid, 0)
        os.close(handle)
        process.returncode = os.waitstatus_to_exitcode(status)
        wall = time.monotonic() - start

    def text(path):
        with open(path, "rb") as file:
            return file.read(1 << 20).decode("utf-8", "surrogateescape")
    return Result(process.returncode, text(out_path), text(err_path), usage.ru_utime + usage.ru_stime, start,
                  wall, 1024 * usage.ru_maxrss, timed_out)


class Case:
    """day: what all cases share (hostile.Day). The case's files are `inp`uts below in/, the user's own below mine/, and
    outputs below out/, where files of the user lie as well."""

    def __init__(self, day, part, number):
        self.day, self.part, self.number = day, part, number
        self.random = random.Random(f"{day.seed}/{part}/{number}")
        self.folder = os.path.join(day.work, part)
        shutil.rmtree(self.folder, ignore_errors=True)
        os.makedirs(self.folder)
        self.what = ""  # what the case is, a line for the summary
        self.commands, self.problems, self.runs = [], [], 0
        self.owned = set()  # paths that darb may change, because it wrote them
        self.before = {}

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def write(self, name, content):
        os.makedirs(os.path.dirname(self.path(name)), exist_ok=True)
        with open(self.path(name), "wb") as file:
            file.write(content if isinstance(content, bytes) else content.encode("utf-8", "surrogateescape"))

    def read(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()

    def take(self, sample, name):
        """Copies a sample, a file or folder, to in/NAME or to where `name` says."""
        source, target = os.path.join(self.day.samples, sample), self.path(name)
        os.makedirs(os.path.dirname(target), exist_ok=True)
        shutil.copytree(source, target, symlinks=True) if os.path.isdir(source) else shutil.copyfile(source, target)

    def add_foreign(self, folders=("mine", "out")):
        """Files that a user may have around; none of them may change."""
        for folder in folders:
            self.write(f"{folder}/notes.txt", "mine\n")
            self.write(f"{folder}/frame_note.png", "mine too\n")
            self.write(f"{folder}/kept/scene.ply", "ply\n")
            if not os.path.lexists(self.path(folder, "link")):
                os.symlink("notes.txt", self.path(folder, "link"))
                os.symlink("kept", self.path(folder, "link_to_folder"))
                os.mkfifo(self.path(folder, "pipe"))

    def guard(self):
        """From here on, everything that exists must stay as it is, except `owned`."""
        self.before = snapshot(self.folder)

    def environment(self, extra):
        keep = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
        return {**keep, "HOME": self.day.home, "XDG_CACHE_HOME": os.path.join(self.day.home, "cache"), **extra}

    def run(self, arguments, allowed=(0, 2), extra=None, names=(), judge=True, **options):
        """Runs darb. names: the text of an error must hold one of them."""
        self.runs += 1
        words = [f"{k}={v}" for k, v in (extra or {}).items()]
        self.commands.append(shlex.join(words + ["darb", *arguments]) + options.pop("shell", ""))
        try:
            result = run_bounded([self.day.darb, *arguments], self.folder, self.environment(extra or {}), **options)
        except (ValueError, OSError) as error:  # an argument that exec cannot pass, such as one with a zero byte
            return Result(2, "", f"error: {error}", 0, 0, 0, 0, False)
        if judge:
            self.judge(result, allowed, names)
        return result

    def judge(self, result, allowed, names=()):
        if result.timed_out:
            self.problem("hangs", f"after {result.wall:.0f} s, {result.cpu:.1f} s of them on the processor")
        elif result.code not in allowed:
            kind = f"signal {signal.Signals(-result.code).name}" if result.code < 0 else f"exit code {result.code}"
            self.problem(kind, result.last_words())
        elif result.cpu > CPU_LIMIT / 2:
            self.problem("slow", f"{result.cpu:.1f} s on the processor")
        if result.rss > MEMORY_LIMIT:
            self.problem("memory", f"{result.rss >> 20} MiB resident")
        if result.code == 2 and not result.timed_out:
            if not result.err.strip():
                self.problem("silent error", "exit code 2 and nothing on stderr")
            elif names and not any(os.path.basename(name) in result.err for name in names):
                self.problem("error without a name", f"none of {list(names)} in: {result.err.strip()[:300]}")
        for stream, text in (("stdout", result.out), ("stderr", result.err)):
            found = CONTROL.search(text)
            if found:
                at = text[max(0, found.start() - 40):found.end() + 20]
                self.problem("control characters", f"{stream} has {found.group()!r}: {at!r}")

    def check_kept(self, outputs=()):
        """Checks that nothing from before guard() is missing or changed, nothing new lies outside out/ and `outputs`, and no
        temporary file is left."""
        after = snapshot(self.folder)
        for path, was in self.before.items():
            if path in self.owned or any(path.startswith(owned + "/") for owned in self.owned):
                continue
            if path not in after:
                self.problem("file lost", path)
            elif after[path] != was and not was.startswith("40000 "):
                self.problem("file changed", f"{path}: was {was}, is {after[path]}")
        for path in after:
            if path in self.before:
                continue
            if not any(path == o or path.startswith(o + "/") or o.startswith(path + "/") for o in ("out", *outputs)):
                self.problem("file outside the output", path)
            if ".tmp" in os.path.basename(path):
                self.problem("temporary file left", path)

    def problem(self, kind, text):
        self.problems.append((kind, text))
