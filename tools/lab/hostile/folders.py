# SPDX-License-Identifier: MIT
"""Part 5: outputs that are inputs or links, folders that cannot be written, two runs in one folder, FIFOs, devices and
folders in place of files."""

import os
import socket
import threading

import guard
import samples

WEIGHT = 2
NOBODY = 65534
TRAIN = " ".join(samples.TRAIN)


def spellings(rng, path):
    """Other names for one file or folder, below the case's folder."""
    head, tail = os.path.split(path)
    return rng.choice([path, "./" + path, f"{head}/../{head}/{tail}" if head else f"./{tail}", path.replace("/", "//", 1),
                       "linked/" + tail if head == "in" else path])


def set_up(case, folder_link=True):
    for sample in ("colmap", "frames", "run", "scenes", "cameras.json", "path.json"):
        case.take(sample, f"in/{sample}")
    if folder_link:
        os.symlink("in", case.path("linked"))
    os.makedirs(case.path("out"), exist_ok=True)


def onto_inputs(case):
    """Whatever an output is called, the input of the same command must stay."""
    set_up(case)
    photo = "in/colmap/images/view_0.png"
    compare = "compare in/colmap --kernels gaussian --iterations 2 -q --blending-views 0"
    lines = [
        "convert in/scenes/scene.ply in/scenes/scene.ply", "convert in/scenes/scene.spz in/scenes/scene.spz",
        f"eval in/run in/colmap --json {photo}", "eval in/run in/colmap --json in/run/checkpoint.darb",
        "view in/scenes/scene.ply --screenshot in/scenes/scene.ply --size 64x48",
        "info in/scenes/scene.ply --json in/scenes/scene.ply", "info in/cameras.json --json in/cameras.json",
        "info in/colmap --json in/colmap/sparse/0/cameras.bin", "info in/frames --json in/frames/transforms.json",
        f"plan in/colmap --no-price --json {photo}", "plan in/scenes/scene.ply --no-price --json in/scenes/scene.ply",
        "cost in/scenes/scene.ply --quick --size 32x32 -q --json in/scenes/scene.ply",
        f"train in/colmap -o in/colmap {TRAIN}", f"train in/frames -o in/frames/images {TRAIN}",
        f"train in/colmap -o {photo} {TRAIN}", "render in/run --cameras in/colmap -o in/colmap/images",
        "render in/run --cameras in/colmap -o in/colmap/masks --depth npy",
        "view in/scenes/scene.ply --path in/path.json --export in/colmap/images --size 32x32",
        "view in/scenes/scene.ply --path in/path.json --export in --size 32x32",
        f"{compare} -o in/colmap", f"{compare} -o out --json {photo}",
    ]
    line = case.random.choice(lines).split()
    for i in range(len(line) - 1, 0, -1):
        if line[i].startswith("in/") and case.random.random() < 0.6:
            line[i] = spellings(case.random, line[i])
            break
    if case.random.random() < 0.3:
        case.random.choice([os.link, lambda a, b: os.symlink(os.path.abspath(a), b)])(
            case.path("in/scenes/scene.ply"), case.path("in/other.ply"))
        line = ["convert", "in/scenes/scene.ply", "in/other.ply"]
    case.what = " ".join(line)
    case.guard()
    case.run(line, names=())
    case.check_kept(("in",))


def into_links(case):
    """A link is followed or replaced; other files where it leads must stay."""
    set_up(case)
    case.add_foreign()
    os.makedirs(case.path("elsewhere"))
    kind = case.random.choice(["to folder", "dangling", "loop", "to file", "to device"])
    target = {"to folder": "elsewhere", "dangling": "elsewhere/none", "loop": "", "to file": "mine/notes.txt",
              "to device": "/dev/full"}[kind]
    case.what = f"output is a link {kind}"
    for name in ("link", "link.ply"):  # the second one for outputs whose name tells the format
        to = name if kind == "loop" else target if target.startswith("/") else case.path(target)
        os.symlink(to, case.path(name))
    line = case.random.choice(one_output("link"))
    case.guard()
    if kind == "to file":
        case.owned.add("mine/notes.txt")  # the user named it as the output
    case.owned |= {"link", "link.ply"}
    case.run(line)
    case.check_kept(("link", "link.ply", "elsewhere"))


def one_output(path):
    return [["convert", "in/scenes/scene.ply", path + ".ply" if path else ""], ["train", "in/colmap", "-o", path, *samples.TRAIN],
            ["render", "in/run", "--cameras", "in/cameras.json", "-o", path],
            ["view", "in/run", "--screenshot", path, "--size", "64x48"],
            ["view", "in/run", "--path", "in/path.json", "--export", path, "--size", "32x32"],
            ["info", "in/run", "--json", path], ["eval", "in/run", "in/colmap", "--json", path],
            ["psi", "--kernels", "sinc", "--samples", "2", "--cells", "16", "--json", path]]


def unwritable(case):
    """Folders that cannot be written, lie below a file or in /proc, or have names that are too long: an error at once."""
    set_up(case)
    case.write("a_file", "mine\n")
    os.makedirs(case.path("closed"))
    target = case.random.choice(["closed/x", "a_file/x", "/proc/x", "/sys/x", "x" * 300, "out/" + "y/" * 2100 + "z", "",
                                 "/dev/null/x"])
    line = case.random.choice(one_output(target))
    case.what = f"output {target[:40]!r}"
    options = {}
    if os.geteuid() == 0 and target == "closed/x":
        if not reachable(case.folder):
            return
        options["user"] = NOBODY
        os.chmod(case.path("closed"), 0o555)
    os.chmod(case.path("closed"), 0o555)
    case.guard()
    result = case.run(line, extra={"XDG_CACHE_HOME": "/nonexistent"} if options else None, allowed=(2,), **options)
    if result.code == 2 and result.cpu > 10:
        case.problem("late error", f"{result.cpu:.1f} s on the processor: {result.last_words()}")
    case.check_kept()


def reachable(path):
    while path != "/":
        if not os.stat(path).st_mode & 1:
            return False
        path = os.path.dirname(path)
    return True


def two_at_once(case):
    """Two runs into one folder: either one is refused, or both are whole."""
    set_up(case)
    line = case.random.choice([
        "train in/colmap -o out/run -q --iterations 600", f"train in/colmap -o out/run {TRAIN} --resume",
        "render in/run --cameras in/cameras.json -o out/frames", "convert in/scenes/scene.ply out/a.spz",
        "compare in/colmap -o out/c --kernels gaussian --iterations 4 -q --blending-views 0"]).split()
    if "--resume" in line:
        case.take("half", "out/run")
    case.what = "at once: " + " ".join(line)
    case.guard()
    case.owned |= {path for path in case.before if path.startswith("out/")}
    other = guard.Case.__new__(guard.Case)
    other.__dict__.update(case.__dict__, commands=[], problems=[], runs=0)
    results = []
    second = threading.Thread(target=lambda: results.append(run_beside(other, line)))
    second.start()
    results.append(case.run(line))
    second.join()
    case.commands += other.commands
    case.problems += other.problems
    case.runs += 1
    codes = [r.code for r in results]
    if "600" in line and codes == [0, 0] and overlapped(results):
        case.problem("two runs in one folder", f"both end with 0: {case.what}")
    if 0 not in codes:
        case.problem("no run of two succeeds", results[0].last_words())
    case.check_kept()


def run_beside(case, line):
    """The same as Case.run, with its own streams."""
    result = guard.run_bounded([case.day.darb, *line], case.folder, case.environment({}), streams=case.folder + ".other")
    case.judge(result, (0, 2))
    return result


def overlapped(results):
    """Whether both runs were at work for most of their time, rather than one after the other."""
    starts, ends = [r.start for r in results], [r.start + r.wall for r in results]
    return min(ends) - max(starts) > 0.8 * min(r.wall for r in results)


def no_files(case):
    """FIFOs, sockets, devices and folders as inputs: an error at once, without waiting for any of them."""
    set_up(case)
    os.mkfifo(case.path("pipe"))
    with socket.socket(socket.AF_UNIX) as plug:
        plug.bind(os.path.relpath(case.path("plug")))
        odd = case.random.choice("pipe plug in none /dev/zero /dev/null /dev/tty /dev/random /dev/stdin /proc/self/mem "
                                 "/proc/kmsg".split())
        kind = case.random.choice(["argument", "link", "photo", "model", "checkpoint", "camera path"])
        where = {"link": case.random.choice(["in/scenes/scene.ply", "in/cameras.json"]),
                 "photo": "in/colmap/images/view_1.jpg", "model": "in/colmap/sparse/0/images.bin",
                 "checkpoint": "in/run/checkpoint.darb", "camera path": "in/path.json"}.get(kind)
        lines = {
            "argument": [f"info {odd}", f"convert {odd} out/a.ply", f"view {odd} --screenshot out/s.png",
                         f"eval in/run {odd}", f"render in/run --cameras {odd} -o out/f", f"train {odd} -o out/run",
                         f"plan {odd} --no-price", f"train in/colmap -o out/run --start-checkpoint {odd}",
                         f"compare in/colmap -o out/c --iterations 2 --kernels gaussian --lpips {odd} -q",
                         f"view in/run --path {odd} --export out/f"],
            "link": [f"info {where}", "render in/scenes/scene.ply --cameras in/cameras.json -o out/f"],
            "photo": [f"train in/colmap -o out/run {TRAIN}", "eval in/run in/colmap --split all"],
            "model": ["info in/colmap", f"train in/colmap -o out/run {TRAIN}"],
            "checkpoint": [f"train in/colmap -o in/run --resume {TRAIN}"],
            "camera path": ["view in/run --path in/path.json --export out/f --size 32x32"],
        }[kind]
        line = case.random.choice(lines).split()
        if where:
            os.remove(case.path(where))
            os.symlink(odd if odd.startswith("/") else case.path(odd), case.path(where))
        case.what = f"{odd} as {where or 'an argument'}"
        case.guard()
        case.owned |= {"in/run"} if kind == "checkpoint" else set()
        case.run(line, wall=60)
        case.check_kept()


SCENARIOS = [onto_inputs, into_links, unwritable, two_at_once, no_files]


def one(case):
    case.random.choice(SCENARIOS)(case)
