# SPDX-License-Identifier: MIT
"""Runs hostile cases for a while and writes what they found to hostile.json and hostile.txt, with the command that repeats
each finding, and its files.

Each case is a fresh folder, made only from the seed, the part and the case's number, so that a finding can be repeated:
    tools/lab/hostile.sh --only PART --seed N --case NUMBER
A command must end with its documented exit codes, within bounds of time and memory, name the file in its error, send
nothing to the terminal that the terminal acts on, and leave inputs and files of the user as they are.
"""

import argparse
import collections
import importlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import guard  # noqa: E402
import samples  # noqa: E402

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
PARTS = ["mutations", "faults", "kills", "flags", "folders", "pages"]
KEEP = 3  # how many cases of one finding keep their files


class Day:
    def __init__(self, darb, out, seed):
        self.darb, self.out, self.seed = darb, out, seed
        self.work, self.home, self.samples = (os.path.join(out, name) for name in ("work", "home", "samples"))
        self.cases, self.runs, self.seconds, self.counts = (collections.Counter() for _ in range(4))
        self.findings = {}
        self.store = {}  # what a part keeps between its cases
        for folder in (self.work, self.home, self.samples):
            shutil.rmtree(folder, ignore_errors=True)
            os.makedirs(folder)
        os.chmod(out, 0o755)
        samples.make(self.samples, self.run_for_sample)

    def run_for_sample(self, arguments):
        environment = {**os.environ, "HOME": self.home, "XDG_CACHE_HOME": self.home + "/cache"}
        done = subprocess.run([self.darb, *arguments], cwd=self.samples, env=environment, capture_output=True, text=True,
                              check=False)
        if done.returncode != 0:
            sys.exit(f"darb {' '.join(arguments)} ended with {done.returncode}: {done.stderr}")

    def repeat(self, case):
        return f"tools/lab/hostile.sh --only {case.part} --seed {self.seed} --case {case.number}"

    def record(self, case):
        for kind, text in dict.fromkeys(case.problems):
            sign = (case.part, kind, signature(text))
            found = self.findings.setdefault(sign, {
                "part": case.part, "kind": kind, "text": text[:600], "what": case.what, "commands": case.commands,
                "repeat": self.repeat(case), "count": 0, "kept": []})
            found["count"] += 1
            if len(found["kept"]) < KEEP:
                found["kept"].append(self.keep(case, kind))

    def keep(self, case, kind):
        """Copies the case's files aside, with the command lines that repeat it."""
        name = f"{case.part}_{case.number}_{re.sub('[^a-zA-Z0-9]+', '_', kind)}"
        target = os.path.join(self.out, "findings", name)
        shutil.rmtree(target, ignore_errors=True)
        os.makedirs(os.path.dirname(target), exist_ok=True)
        copy = subprocess.run(["cp", "-a", case.folder, target], check=False, capture_output=True)
        if copy.returncode == 0:
            for stream in ("stdout", "stderr"):
                if os.path.exists(f"{case.folder}.{stream}"):
                    shutil.copyfile(f"{case.folder}.{stream}", f"{target}/{stream}.txt")
            with open(f"{target}/repeat.txt", "w", encoding="utf-8", errors="backslashreplace") as file:
                file.write("\n".join([case.what, *(f"{k}: {t}" for k, t in case.problems), self.repeat(case), "in it:",
                                      *case.commands]) + "\n")
        return os.path.relpath(target, self.out)

    def run_case(self, part, number):
        start = time.monotonic()
        case = guard.Case(self, part, number)
        importlib.import_module(part).one(case)
        self.record(case)
        self.cases[part] += 1
        self.runs[part] += case.runs
        self.seconds[part] += time.monotonic() - start
        return case


def signature(text):
    """The part of a finding's text that does not change from case to case."""
    text = re.sub(r"'[^']*'|\"[^\"]*\"", "Q", text)
    return re.sub(r"[\w./-]*/[\w./-]*|-?\d[\d.e+-]*|\S*\\\S*", "N", text)[:60]


def commit():
    """Empty where there is no git or no repository."""
    if not shutil.which("git"):
        return ""
    return subprocess.run(["git", "-C", ROOT, "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False).stdout.strip()


def summary(day, begin, hours):
    return {"darb": day.darb, "commit": commit(), "seed": day.seed, "hours_asked": hours,
            "hours": round((time.time() - begin) / 3600, 4),
            "parts": {part: {"cases": day.cases[part], "executions": day.runs[part], "seconds": round(day.seconds[part], 1),
                             "findings": sum(1 for sign in day.findings if sign[0] == part)}
                      for part in PARTS if day.cases[part]},
            "counts": dict(day.counts), "findings": sorted(day.findings.values(), key=lambda f: (f["part"], f["kind"], -f["count"]))}


def as_text(facts):
    lines = [f"{sum(p['executions'] for p in facts['parts'].values())} executions in {facts['hours']:.2f} h, "
             f"{len(facts['findings'])} findings; commit {facts['commit']}, seed {facts['seed']}", ""]
    lines += [f"{name:10} {p['cases']:7} cases {p['executions']:8} executions {p['findings']:4} findings"
              for name, p in facts["parts"].items()]
    lines += [f"{count} {name}" for name, count in facts["counts"].items()]
    for found in facts["findings"]:
        lines += ["", f"{found['part']}: {found['kind']}, {found['count']} times", f"  {found['text']!r}",
                  f"  {found['what']!r}", *(f"  $ {command}" for command in found["commands"][-4:]),
                  f"  {found['repeat']}", f"  kept: {', '.join(found['kept'])}"]
    return "\n".join(lines) + "\n"


def write_summary(day, begin, hours):
    facts = summary(day, begin, hours)
    with open(os.path.join(day.out, "hostile.json"), "w", encoding="utf-8") as file:
        json.dump(facts, file, indent=1)
    text = as_text(facts)
    with open(os.path.join(day.out, "hostile.txt"), "w", encoding="utf-8", errors="backslashreplace") as file:
        file.write(text)
    return text


def spend(day, hours, parts):
    """Runs cases of the part that has had the least of its share, until the time is over; each part at least once."""
    begin, number = time.time(), collections.Counter()
    weights = {part: importlib.import_module(part).WEIGHT for part in parts}
    written = begin
    while True:
        waiting = [part for part in parts if not number[part]]
        if not waiting and time.time() - begin >= 3600 * hours:
            return begin
        part = waiting[0] if waiting else min(parts, key=lambda p: day.seconds[p] / weights[p])
        day.run_case(part, number[part])
        number[part] += 1
        if time.time() - written > 60:
            written = time.time()
            write_summary(day, begin, hours)


def main():
    parser = argparse.ArgumentParser(
        prog="tools/lab/hostile.sh", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="parts: " + ", ".join(PARTS) + ". Exit code 1: there are findings. The command under test is build/darb, or "
        "$DARB.")
    parser.add_argument("hours", nargs="?", type=float, help="how long; fractions are legal, 0.01 is a quick look")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="of every case (default: the time)")
    parser.add_argument("--out", help="folder of the summary and of kept cases (default: a new one in the temporary folder)")
    parser.add_argument("--only", choices=PARTS, help="one part alone")
    parser.add_argument("--case", type=int, help="one case of --only alone")
    options = parser.parse_args()
    if options.case is None and options.hours is None or options.case is not None and not options.only:
        parser.error("give HOURS, or --only PART --case N")
    darb = os.path.abspath(os.environ.get("DARB", os.path.join(ROOT, "build", "darb")))
    if not os.access(darb, os.X_OK):
        sys.exit(f"{darb} does not exist: build it, or name it in DARB")
    out = os.path.abspath(options.out or tempfile.mkdtemp(prefix="hostile_"))
    os.makedirs(out, exist_ok=True)
    day = Day(darb, out, options.seed)
    begin = time.time()
    if options.case is not None:
        case = day.run_case(options.only, options.case)
        print("\n".join([case.what, *case.commands]))
    else:
        begin = spend(day, options.hours, [options.only] if options.only else PARTS)
    print(write_summary(day, begin, options.hours or 0).encode("ascii", "backslashreplace").decode())
    print(f"in {out}: hostile.txt, hostile.json, findings/")
    for folder in (day.work, day.home, day.samples):
        shutil.rmtree(folder, ignore_errors=True)
    sys.exit(1 if day.findings else 0)


if __name__ == "__main__":
    main()
