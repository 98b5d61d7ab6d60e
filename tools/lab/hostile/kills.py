# SPDX-License-Identifier: MIT
"""Part 3: SIGKILL, SIGTERM, SIGINT and SIGHUP at random moments of short trainings. Each is resumed and must end in the same
scene, to the byte, as a run that nobody ended. No signal but SIGKILL may lose what was trained so far."""

import os
import signal
import threading
import time

import guard

WEIGHT = 3
SCENE = "point_cloud/iteration_150/point_cloud.ply"
OPTIONS = ["-r", "8", "-q", "--iterations", "150", "--densify-from-iter", "20", "--densification-interval", "20",
           "--save-iterations", "75", "150"]
OFTEN, RESET = ["--checkpoint-interval", "5"], ["--opacity-reset-interval", "50"]
SIGNALS = {signal.SIGKILL: (-9,), signal.SIGTERM: (0, 143), signal.SIGINT: (0, 130), signal.SIGHUP: (0, 129)}
VARIANTS = [OFTEN + RESET, OFTEN + ["--strategy", "mcmc"], OFTEN + ["--strategy", "budget"], OFTEN + ["--kernel", "sinc"],
            OFTEN + ["--schedule", "3dgs"], OFTEN + RESET + ["--effects", "all"], ["--checkpoint-interval", "0"],
            OFTEN + RESET + ["--eval"]]


def scene_folder():
    return os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))), "assets", "scene")


def whole(case, variant):
    """The scenes of a run that nobody ends, and its seconds."""
    key = ("whole", tuple(variant))
    if key not in case.day.store:
        other = guard.Case(case.day, "kills_whole", 0)
        start = time.monotonic()
        other.run(["train", scene_folder(), *OPTIONS, *variant, "-o", "out"], allowed=(0,))
        case.runs += 1
        case.problems += other.problems
        case.day.store[key] = scenes(other), time.monotonic() - start
    return case.day.store[key]


def scenes(case):
    return {path: state for path, state in guard.snapshot(case.path("out")).items()
            if path.endswith(".ply") and path.startswith("point_cloud/")}


def one(case):
    variant = case.random.choice(VARIANTS)
    expected, seconds = whole(case, variant)
    ended = []
    for _ in range(case.random.randrange(1, 4)):
        which = case.random.choice(list(SIGNALS))
        moment = case.random.uniform(0, 1.1) * seconds
        twice = case.random.random() < 0.2
        if not end_at(case, variant, which, moment, twice):
            break
        ended.append(f"{which.name} after {moment:.2f} s" + (", twice" if twice else ""))
    case.what = f"{' '.join(variant)}: {'; '.join(ended)}"
    case.run(["train", scene_folder(), *OPTIONS, *variant, "-o", "out", *resume(case)], allowed=(0,))
    found = scenes(case)
    for path, state in expected.items():
        if found.get(path) != state:
            case.problem("other scene after a kill", f"{path}: {found.get(path)}, never ended: {state}; {case.what}")
    left = [path for path in guard.snapshot(case.folder) if ".tmp" in os.path.basename(path)]
    if left:
        case.problem("temporary file left", ", ".join(left))


def resume(case):
    return ["--resume"] if os.path.exists(case.path("out/checkpoint.darb")) else []


def end_at(case, variant, which, moment, twice):
    """Whether the signal reached the run before its end."""
    def poke(process):
        def strike():
            for _ in range(2 if twice else 1):
                try:
                    # not waited for before the timer is cancelled, so it is still this process
                    os.kill(process.pid, which)
                except ProcessLookupError:
                    return
        timer = threading.Timer(moment, strike)
        timer.daemon = True
        timer.start()
        timers.append(timer)
    timers = []
    begun = os.path.exists(case.path("out/run.jsonl"))
    result = case.run(["train", scene_folder(), *OPTIONS, *variant, "-o", "out", *resume(case)], judge=False, poke=poke,
                      shell=f"  # {which.name} after {moment:.2f} s")
    timers[0].cancel()
    timers[0].join()
    if result.code == 0 and os.path.exists(case.path("out", SCENE)):
        return False
    case.day.counts["runs ended by a signal"] += 1
    case.day.counts["of them with a checkpoint to resume"] += bool(resume(case))
    started = begun or os.path.exists(case.path("out/run.jsonl"))
    if result.timed_out or result.code not in SIGNALS[which]:
        # Before its handler is installed, a signal ends the program as it ends any other; so may a second signal.
        if not (result.code == -which and (twice or moment < 0.5 or not started)):
            case.problem(f"{which.name} ends with {result.code}", result.last_words())
    if which != signal.SIGKILL and result.code >= 0 and started and not resume(case):
        case.problem(f"no save after {which.name}", result.last_words())
    return True
