# SPDX-License-Identifier: MIT
"""Part 2: writes that fail, are short or are interrupted at every call in turn; full and closed standard streams; a limit on
file sizes. The error must be reported, earlier outputs must stay whole, and the next run must leave nothing behind."""

import errno
import json
import os
import re
import resource
import shutil
import subprocess

import guard
import samples

WEIGHT = 3
# command, what it overwrites (sample -> path), whether it ends in a scene that repeats to the byte
COMMANDS = {
    "train": (["train", "in/colmap", "-o", "out/run", *samples.TRAIN], {}, "out/run"),
    "train again": (["train", "in/colmap", "-o", "out/run", *samples.TRAIN], {"run": "out/run"}, "out/run"),
    "resume": (["train", "in/colmap", "-o", "out/run", *samples.TRAIN, "--resume"], {"half": "out/run"}, "out/run"),
    "convert": (["convert", "--force", "in/scenes/scene.spz", "out/a.ply"], {"scenes/scene.ply": "out/a.ply"}, None),
    "convert to SPZ": (["convert", "--force", "in/scenes/scene.ply", "out/a.spz"], {"scenes/version_2.spz": "out/a.spz"}, None),
    "render": (["render", "in/run", "--cameras", "in/cameras.json", "-o", "out/frames", "--depth", "npy", "--force"],
               {"colmap/images": "out/frames"}, None),
    "screenshot": (["view", "in/run", "--screenshot", "out/s.png", "--size", "64x48", "--force"], {"colmap/images/view_0.png": "out/s.png"},
                   None),
    "export": (["view", "in/run", "--path", "in/path.json", "--export", "out/frames", "--size", "32x32"],
               {"colmap/images": "out/frames"}, None),
    "eval": (["eval", "in/run", "in/colmap", "--json", "out/e.json"], {"cameras.json": "out/e.json"}, None),
    "info": (["info", "in/run", "--json", "out/facts.json"], {"cameras.json": "out/facts.json"}, None),
    "psi": (["psi", "--kernels", "sinc", "--samples", "2", "--cells", "16", "--json", "out/p.json", "--html", "out/p.html"],
            {"cameras.json": "out/p.json", "run/report.html": "out/p.html"}, None),
    "compare": (["compare", "in/colmap", "-o", "out/compared", "--kernels", "gaussian", "--iterations", "4", "-q",
                 "--blending-views", "0"], {}, None),
}
ERRORS = [errno.ENOSPC, errno.EIO, errno.EDQUOT, errno.EROFS]
LETTERS = "owsrcfm"  # the letters of fault.c


def library(day):
    """The preloaded library, compiled at the first case; empty without a compiler."""
    if "fault.so" not in day.store:
        target = os.path.join(day.home, "fault.so")
        source = os.path.join(os.path.dirname(os.path.abspath(__file__)), "fault.c")
        built = subprocess.run(["gcc", "-O1", "-shared", "-fPIC", "-o", target, source, "-ldl"], check=False)
        day.store["fault.so"] = target if built.returncode == 0 else ""
    return day.store["fault.so"]


def set_up(case, name):
    arguments, earlier, scene = COMMANDS[name]
    for sample in ("colmap", "run", "scenes", "cameras.json", "path.json"):
        case.take(sample, f"in/{sample}")
    for sample, target in earlier.items():
        case.take(sample, target)
    case.add_foreign()
    case.guard()
    # What the run may replace; check_outputs tests afterwards whether it is whole.
    case.owned |= {path for path in case.before if any(path == t or path.startswith(t + "/") for t in earlier.values())}
    return arguments, scene


def outputs_of(case):
    return {path: state for path, state in guard.snapshot(case.folder).items()
            if path.startswith("out/") and state.startswith("100")}


def reference(case, name):
    """What the command leaves when nothing fails, and how often it makes each counted call."""
    known = case.day.store.get(("reference", name))
    if known is None:
        # in the folder of the case itself, because some files hold its path
        other = guard.Case(case.day, case.part, -1)
        arguments, _ = set_up(other, name)
        trace = os.path.join(case.day.home, "trace")
        if os.path.exists(trace):
            os.remove(trace)
        other.run(arguments, allowed=(0,), extra=preload(other, {"HOSTILE_TRACE": trace}))
        other.check_kept()
        case.runs += 1
        case.problems += other.problems
        calls = ""
        if os.path.exists(trace):
            with open(trace, encoding="ascii") as file:
                calls = file.read()
        known = outputs_of(other), calls
        shutil.rmtree(case.folder)
        os.makedirs(case.folder)
        case.day.store[("reference", name)] = known
    return known


def preload(case, more):
    if not library(case.day):
        return {}
    return {"LD_PRELOAD": library(case.day), "HOSTILE_UNDER": case.path("out"), **more}


def is_whole(path):
    """For files that differ from run to run: checks that they are complete."""
    with open(path, "rb") as file:
        data = file.read()
    try:
        if path.endswith(".json"):
            json.loads(data)
        elif path.endswith(".jsonl"):
            for line in data.split(b"\n")[:-1]:  # the last line may be cut
                json.loads(line)
        elif path.endswith(".html"):
            return data.rstrip().endswith(b"</html>")
        elif path.endswith(".ply"):
            head, _, body = data.partition(b"end_header\n")  # what a run that fails saves at its end
            splats = int(re.search(rb"element vertex (\d+)", head).group(1))
            return len(body) == 4 * splats * head.count(b"property float")
        else:
            # A resumed run reads the first; the last lists the frames so far.
            return path.endswith((".darb", ".mp4", "/darb_export.txt"))
    except ValueError:
        return False
    return True


def check_outputs(case, old, new):
    """Every earlier file must be as it was or as the whole run writes it, and every other file must be whole."""
    after = outputs_of(case)
    for path, state in old.items():
        if path not in after and path in new and state not in after.values():
            case.problem("earlier output lost", path)
    for path, state in after.items():
        if state in (old.get(path), new.get(path)) or state in old.values() or ".tmp" in path:
            continue
        if not is_whole(case.path(path)):
            case.problem("output in part", f"{path}: {state}, whole: {new.get(path)}, earlier: {old.get(path)}")


def check_next(case, name, arguments, scene, new):
    """Runs the same command without a fault: it must succeed, leave no temporary file, and make the same scene to the byte."""
    if scene and "--resume" not in arguments and os.path.exists(case.path(scene, "checkpoint.darb")) and \
            case.random.random() < 0.5 and name == "train":
        arguments = [*arguments, "--resume"]
    result = case.run(arguments, allowed=(0,))
    case.check_kept()
    after = outputs_of(case)
    for path, state in new.items():
        if path.endswith((".ply", ".spz", ".png", ".npy")) and after.get(path) != state and result.code == 0:
            case.problem("other bytes after a fault", f"{path}: {after.get(path)}, without a fault {state}")


def choose_fault(case, calls):
    """-> environment for the library, whether the command must succeed all the same, a description."""
    rng = case.random
    letter = rng.choice([one for one in LETTERS if one in calls] or ["w"])
    first = rng.randrange(1, calls.count(letter) + 1) if letter in calls else 1
    last = first if rng.random() < 0.5 else 1 << 30
    if letter == "w" and rng.random() < 0.2:
        return f"w:1:{1 << 30}:short", True
    if letter in "w" and rng.random() < 0.15:
        return f"{letter}:{first}:{first + 3}:{errno.EINTR}", True
    return f"{letter}:{first}:{last}:{rng.choice(ERRORS)}", False


def one(case):
    name = case.random.choice(list(COMMANDS))
    new, calls = reference(case, name)
    arguments, scene = set_up(case, name)
    old = outputs_of(case)
    kind = case.random.choice(["call"] * 4 + ["size", "stream"])
    if kind == "call" and not library(case.day):
        kind = "size"
    if kind == "call":
        fault, harmless = choose_fault(case, calls)
        case.what = f"{name}: fault {fault}"
        result = case.run(arguments, allowed=(0,) if harmless else (0, 2), extra=preload(case, {"HOSTILE_FAULT": fault}))
        if result.code == 0 and not harmless and fault[0] in "wr" and not result.err.strip():
            case.problem("fault unnoticed", f"{fault} of {calls}")
    elif kind == "size":
        limit = case.random.choice([0, 1, 100, 1000, 3000, 10000, 30000])
        case.what = f"{name}: files of at most {limit} bytes"
        run_limited(case, arguments, limit)
    else:
        run_without_streams(case, name, arguments)
    check_outputs(case, old, new)
    check_next(case, name, arguments, scene, new)


def run_limited(case, arguments, limit):
    """The streams go to /dev/null, because as files they would reach the limit, too."""
    result = case.run(arguments, limits={resource.RLIMIT_FSIZE: limit}, shell=f"  # prlimit --fsize={limit}",
                      stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, judge=False)
    if result.code not in (0, 2):
        case.problem(f"ends with {result.code} at a limit of file sizes", f"{limit} bytes")


def run_without_streams(case, name, arguments):
    kind = case.random.choice(["full", "closed stdout", "closed stderr", "closed stdin", "all closed", "no reader"])
    case.what = f"{name}: {kind}"

    def close(*numbers):
        return lambda: [os.close(n) for n in numbers]
    options = {"full": {}, "no reader": {}, "closed stdout": {"before": close(1)}, "closed stderr": {"before": close(2)},
               "closed stdin": {"before": close(0)}, "all closed": {"before": close(0, 1, 2)}}[kind]
    shell = {"full": ">/dev/full", "closed stdout": ">&-", "closed stderr": "2>&-", "closed stdin": "<&-",
             "all closed": "<&- >&- 2>&-", "no reader": "| true"}[kind]
    if kind == "full":
        with open("/dev/full", "wb") as full:
            result = case.run(arguments, stdout=full, shell="  " + shell)
        if result.code == 0 and name != "compare":  # compare prints nothing there with -q
            case.problem("full standard output unnoticed", name)
    elif kind == "no reader":
        reader, writer = os.pipe()
        os.close(reader)
        judge_code(case, case.run(arguments, stdout=writer, shell="  " + shell, judge=False))
        os.close(writer)
    else:
        judge_code(case, case.run(arguments, shell="  " + shell, judge=False, **options))


def judge_code(case, result):
    if result.code not in (0, 2):
        case.problem(f"ends with {result.code} without its streams", case.what)
