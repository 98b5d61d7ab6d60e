#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Trains the table of real data sets, lengths and strategies, and writes what came of it as JSON and as a page.

    real_scale.py run [--out DIR] [--limit SECONDS] [--reduced [PX]] [--sets NAME...] [--iterations N...]
                      [--strategies NAME...] [--seeds N...] [--data DIR] [--darb FILE] [--make-scene FILE]
                      [--commit TEXT] [--again-failed] [-- options of darb train...]
    real_scale.py page AFTER.json [BEFORE.json] [-o FILE.md]

run   trains SETS x ITERATIONS x STRATEGIES and adds a row a run to DIR/real_scale.json. When the time is over, the run
      under way is stopped and saved; the same command goes on with it. Rows that are there are not measured again. A
      set that is missing is skipped with a line that says so, and a run that fails becomes a row with its error.
page  prints a Markdown table, with two files the rows of both below each other and what changed.

--out         runs and results; default: build/real_scale. Finished runs keep their scene and lose their checkpoint.
--limit       seconds that the whole call may take; default: 540.
--make-scene  the program that makes still_life_1200 and town_1200 (36 photos), and town_1200_large (225 photos) where
              that is asked for, in DIR/sets; default: build/make_scene, which the preset lab builds. A photo of the
              town takes 45 s of one core, so the large one needs a larger --limit.
--reduced     the table for a CPU: photos at most PX wide (default 400), 2,000 iterations, adc and budget, three sets.
--data        the folder of the sets; default: ../shared/data beside the checkout, or DARB_TEST_DATA.
--darb        the command to run; default: build/darb of this checkout.
--commit      what the rows name; default: what git says of this checkout.
--again-failed  also what failed in an earlier call.

Every 8th photo is held out. budget and mcmc get the number of splats with which adc ended on the same photos in as many
iterations, where its row is there, so they come after it. Seconds are those of training alone. "drawn" are the splats
whose opacity reaches 1/255. Exit code: 0; 1 where a row is a failed run; 2 for bad usage.
"""

import argparse
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SETS = ["fox_800", "castle_p30_1600", "monstree_800", "miku_plush_800", "asclepius_1600", "still_life_1200",
        "town_1200"]
# What make_scene is asked for to make a set with exact truth, photos of 1,200 x 900 px.
GENERATED = {"still_life_1200": ["FOLDER", "6"], "town_1200": ["town", "FOLDER", "6", "6"],
             "town_1200_large": ["town", "FOLDER", "15", "6"]}
ITERATIONS = [1_600, 7_000, 30_000]
STRATEGIES = ["adc", "budget", "mcmc"]
REDUCED = {"sets": ["castle_p30_1600", "fox_800", "monstree_800"], "iterations": [2_000],
           "strategies": ["adc", "budget"]}
FULL = {"sets": SETS, "iterations": ITERATIONS, "strategies": STRATEGIES}
LEAST_SECONDS = 5  # a run is not begun with less time than that
SECONDS_TO_SAVE = 60  # that a stopped run may take to end
KEY = ["set", "resolution", "iterations", "strategy", "seed", "options"]
FORMAT = 1


def fail(text):
    sys.exit(f"real_scale.py: {text}")


def say(text):
    print(text, flush=True)


def read_json(path):
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        fail(f"{path}: cannot be read as JSON ({error}); take another --out, or restore the file")


def read_rows(path):
    rows = read_json(path)
    if not isinstance(rows, dict) or rows.get("format") != FORMAT or not isinstance(rows.get("rows"), list):
        fail(f"{path}: is no result of real_scale.py run; take another --out, or another file")
    return rows["rows"]


def write_rows(path, rows):
    text = ",\n  ".join(json.dumps(row, sort_keys=True) for row in rows)
    whole = f'{{"format": {FORMAT}, "rows": [\n  {text}\n]}}\n'
    beside = path.with_suffix(".tmp")
    beside.write_text(whole, encoding="utf-8")
    beside.replace(path)


def key_of(row):
    return tuple(row[name] for name in KEY)


def commit_of(root):
    git = ["git", "-C", str(root)]
    done = subprocess.run([*git, "rev-parse", "--short=10", "HEAD"], capture_output=True, text=True)
    if done.returncode != 0:
        return "unknown"
    changed = subprocess.run([*git, "status", "--porcelain", "-uno"], capture_output=True, text=True).stdout.strip()
    return done.stdout.strip() + ("-dirty" if changed else "")


def last_line(path):
    lines = [line for line in path.read_text(errors="replace").splitlines() if line.strip()]
    errors = [line for line in lines if line.startswith("darb: ") or "error" in line.lower()]
    return (errors or lines or ["it said nothing"])[-1][:300]


class Table:
    def __init__(self, args, rest):
        self.args, self.options = args, rest
        self.out = args.out
        self.out.mkdir(parents=True, exist_ok=True)
        self.file = self.out / "real_scale.json"
        self.rows = read_rows(self.file) if self.file.exists() else []
        self.commit = args.commit or commit_of(ROOT)
        self.end = time.monotonic() + args.limit
        for row in self.rows:
            if row["commit"] != self.commit:
                fail(f"{self.file}: holds rows of the commit {row['commit']}, this is {self.commit}; one table is of one "
                     "commit: take another --out, or name the commit with --commit")

    def left(self):
        return self.end - time.monotonic()

    def runs(self):
        """The keys of the table, what others wait for first."""
        for strategy in self.args.strategies:
            for iterations in self.args.iterations:
                for name in self.args.sets:
                    for seed in self.args.seeds:
                        yield {"set": name, "resolution": self.args.reduced or 0, "iterations": iterations,
                               "strategy": strategy, "seed": seed, "options": " ".join(self.options)}

    def find(self, run):
        return next((row for row in self.rows if key_of(row) == key_of(run)), None)

    def budget(self, run):
        """-> splats for a strategy that is given a number, or None."""
        adc = self.find(run | {"strategy": "adc"})
        return adc.get("splats") if adc and run["strategy"] != "adc" else None

    def folder(self, run):
        name = [run["set"], run["strategy"], str(run["iterations"]), f"seed{run['seed']}"]
        if run["resolution"]:
            name.append(f"{run['resolution']}px")
        if run["options"]:
            name.append(re.sub(r"[^A-Za-z0-9.]+", "_", run["options"]).strip("_"))
        return self.out / "runs" / "-".join(name)

    def data_of(self, name):
        """The folder of a set; what is generated lies beside the results, unless --data has it."""
        given = self.args.data / name
        return self.out / "sets" / name if name in GENERATED and not given.is_dir() else given

    def can_have(self, name):
        return self.data_of(name).is_dir() or name in GENERATED and os.access(self.args.make_scene, os.X_OK)

    def make(self, name):
        """Generates a set that is not there yet, and which appears once it is whole. -> False where the time is over"""
        folder = self.data_of(name)
        if folder.is_dir():
            return True
        beside = folder.with_name(name + ".tmp")
        shutil.rmtree(beside, ignore_errors=True)
        beside.parent.mkdir(parents=True, exist_ok=True)
        begun = time.monotonic()
        words = [str(beside) if word == "FOLDER" else word for word in GENERATED[name]]
        try:
            done = subprocess.run([str(self.args.make_scene), *words], capture_output=True, text=True,
                                  timeout=max(self.left(), 0.1))
        except subprocess.TimeoutExpired:
            say(f"{name}: the time was over before its photos were made; a larger --limit makes them")
            return False
        if done.returncode != 0:
            fail(f"{self.args.make_scene} {' '.join(words)}: exit code {done.returncode}: {done.stderr.strip()[:300]}")
        beside.rename(folder)
        say(f"{name}: made in {time.monotonic() - begun:.0f} s")
        return True

    def command(self, run, folder):
        if (folder / "checkpoint.darb").exists():
            return [self.args.darb, "train", "--resume", "-o", folder, "-q"]
        command = [self.args.darb, "train", self.data_of(run["set"]), "-o", folder, "--eval", "--no-report", "-q",
                   "--iterations", str(run["iterations"]), "--strategy", run["strategy"], "--seed", str(run["seed"])]
        if run["resolution"]:
            command += ["-r", str(run["resolution"])]
        if (splats := self.budget(run)) is not None:
            command += ["--budget", str(splats)]
        return command + self.options

    def train(self, run, folder):
        """-> whether it came to its end, and the error where it failed"""
        folder.mkdir(parents=True, exist_ok=True)
        log = folder.with_suffix(".log") if not folder.suffix else pathlib.Path(f"{folder}.log")
        with open(log, "w", encoding="utf-8") as file:
            child = subprocess.Popen([str(word) for word in self.command(run, folder)], stdout=file,
                                     stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL)
            try:
                code = child.wait(timeout=max(self.left(), 0.1))
            except subprocess.TimeoutExpired:
                child.send_signal(signal.SIGINT)
                try:
                    child.wait(timeout=SECONDS_TO_SAVE)
                except subprocess.TimeoutExpired:
                    child.kill()
                    child.wait()
                return False, None
        return code == 0, None if code == 0 else f"exit code {code}: {last_line(log)}"

    def drawn(self, metrics, scene):
        """Splats of the scene whose opacity reaches 1/255."""
        done = subprocess.run([self.args.darb, "info", scene, "--json", "-", "-q"], capture_output=True, text=True)
        try:
            info = json.loads(done.stdout)
            return info["splats"] - info["invisible"]
        except (ValueError, KeyError):
            return metrics.get("saved_splats")

    def measure(self, run, folder):
        metrics = read_json(folder / "metrics.json")
        last = metrics["evaluations"][-1] if metrics.get("evaluations") else {}
        start = metrics.get("start", {})
        scene = folder / "point_cloud" / f"iteration_{metrics['iteration']}" / "point_cloud.ply"
        return run | {
            "seconds": round(metrics["seconds"], 2), "splats": metrics["splats"],
            "drawn_splats": self.drawn(metrics, scene), "psnr_db": last.get("psnr_db"), "ssim": last.get("ssim"),
            "ended_at": metrics["iteration"], "peak_device_mb": round(metrics["peak_device_bytes"] / 1e6, 1),
            "peak_host_mb": round(metrics["peak_host_bytes"] / 1e6, 1), "device": start.get("device", "unknown"),
            "driver": start.get("driver", "unknown"), "commit": self.commit}

    def do(self, run):
        """-> False where the time is over"""
        folder = self.folder(run)
        begun = time.monotonic()
        ended, error = self.train(run, folder)
        if not ended and not error:
            say(f"{folder.name}: stopped, as the time is over; the same command goes on")
            return False
        if not error:
            try:
                row = self.measure(run, folder)
            except (KeyError, TypeError, SystemExit) as what:
                error = f"its metrics.json could not be read: {what}"
        if error:
            row = run | {"error": error, "commit": self.commit}
            say(f"{folder.name}: failed, {error}")
        else:
            (folder / "checkpoint.darb").unlink(missing_ok=True)
            say(f"{folder.name}: {row['psnr_db']:.2f} dB, SSIM {row['ssim']:.4f}, {row['splats']:,} splats, "
                f"{row['seconds']:.1f} s ({time.monotonic() - begun:.0f} s of this call)")
        self.rows = [other for other in self.rows if key_of(other) != key_of(run)] + [row]
        write_rows(self.file, self.rows)
        return True

    def is_done(self, run):
        row = self.find(run)
        return row is not None and not ("error" in row and self.args.again_failed)

    def execute(self):
        missing = [name for name in self.args.sets if not self.can_have(name)]
        for name in missing:
            why = f", which {self.args.make_scene} would make" if name in GENERATED else ""
            say(f"{name}: skipped, as {self.data_of(name)} is not there{why}")
        todo = [run for run in self.runs() if run["set"] not in missing and not self.is_done(run)]
        for place, run in enumerate(todo):
            if self.left() < LEAST_SECONDS or not self.make(run["set"]) or not self.do(run):
                say(f"{len(todo) - place} of {len(todo)} runs are left; the same command goes on with them")
                break
        else:
            say(f"the table is whole: {self.file}")
        (self.out / "real_scale.md").write_text(page(self.rows, []), encoding="utf-8")
        return 1 if any("error" in row for row in self.rows) else 0


COLUMNS = [  # heading, key of a row, format, whether more is better (None: neither)
    ("seconds", "seconds", "{:,.1f}", False), ("splats", "splats", "{:,}", None), ("drawn", "drawn_splats", "{:,}", None),
    ("PSNR (dB)", "psnr_db", "{:.2f}", True), ("SSIM", "ssim", "{:.4f}", True),
    ("device memory (MB)", "peak_device_mb", "{:,.0f}", False)]


def cells(row):
    if "error" in row:
        return [f"failed: {row['error']}"] + [""] * (len(COLUMNS) - 1)
    texts = [form.format(row[key]) if row.get(key) is not None else "" for _, key, form, _ in COLUMNS]
    if row.get("ended_at", row["iterations"]) != row["iterations"]:
        texts[0] += f" (ended at {row['ended_at']:,})"
    return texts


def changes(before, after):
    texts = []
    for _, key, _, _ in COLUMNS:
        a, b = before.get(key), after.get(key)
        if a is None or b is None:
            texts.append("")
        elif key in ("psnr_db", "ssim"):
            texts.append(f"{b - a:+.2f}" if key == "psnr_db" else f"{b - a:+.4f}")
        else:
            texts.append(f"x {b / a:.2f}" if a else "")
    return texts


def condition(rows, name):
    values = sorted({str(row[name]) for row in rows if name in row})
    return ", ".join(values) or "unknown"


def page(after, before):
    """Markdown of the rows; with rows of before, these above them and what changed below."""
    old = {key_of(row): row for row in before}
    order = sorted(after, key=lambda row: (row["set"], row["resolution"], row["iterations"], row["strategy"], row["seed"],
                                           row["options"]))
    lines = ["# Runs at real scale", "",
             f"Device: {condition(after, 'device')} ({condition(after, 'driver')}). Commit: {condition(after, 'commit')}"
             + (f", before it {condition(before, 'commit')} on {condition(before, 'device')}." if before else ".")
             + " Every 8th photo is held out; seconds are those of training alone.", "",
             "| set | iterations | strategy | " + ("row | " if before else "")
             + " | ".join(name for name, *_ in COLUMNS) + " |",
             "|" + "---|" * (3 + (1 if before else 0) + len(COLUMNS))]
    for row in order:
        name = row["set"] + (f", {row['resolution']} px" if row["resolution"] else "")
        details = row["strategy"] + (f", seed {row['seed']}" if row["seed"] else "")
        details += f" `{row['options']}`" if row["options"] else ""
        head = [name, f"{row['iterations']:,}", details]
        earlier = old.get(key_of(row))
        if not before:
            lines.append("| " + " | ".join(head + cells(row)) + " |")
            continue
        if earlier:
            lines.append("| " + " | ".join(head + ["before"] + cells(earlier)) + " |")
            head = ["", "", ""]
        lines.append("| " + " | ".join(head + ["after"] + cells(row)) + " |")
        if earlier and "error" not in row and "error" not in earlier:
            lines.append("| " + " | ".join(head + ["change"] + changes(earlier, row)) + " |")
    gone = [key for key in old if key not in {key_of(row) for row in after}]
    if gone:
        lines += ["", "Only before: " + "; ".join(f"{key[0]} {key[3]} {key[2]:,}" for key in sorted(gone)) + "."]
    return "\n".join(lines) + "\n"


def parse(arguments):
    if "--" in arguments:
        at = arguments.index("--")
        arguments, rest = arguments[:at], arguments[at + 1:]
    else:
        rest = []
    parser = argparse.ArgumentParser(prog="real_scale.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    run = commands.add_parser("run")
    run.add_argument("--out", type=pathlib.Path, default=ROOT / "build" / "real_scale")
    run.add_argument("--limit", type=float, default=540)
    run.add_argument("--reduced", type=int, nargs="?", const=400)
    run.add_argument("--sets", nargs="+")
    run.add_argument("--iterations", type=int, nargs="+")
    run.add_argument("--strategies", nargs="+")
    run.add_argument("--seeds", type=int, nargs="+", default=[0])
    run.add_argument("--data", type=pathlib.Path,
                     default=pathlib.Path(os.environ.get("DARB_TEST_DATA") or ROOT.parent / "shared" / "data"))
    run.add_argument("--darb", type=pathlib.Path, default=ROOT / "build" / "darb")
    run.add_argument("--make-scene", type=pathlib.Path, default=ROOT / "build" / "make_scene")
    run.add_argument("--commit")
    run.add_argument("--again-failed", action="store_true")
    shown = commands.add_parser("page")
    shown.add_argument("after", type=pathlib.Path)
    shown.add_argument("before", type=pathlib.Path, nargs="?")
    shown.add_argument("-o", "--output", type=pathlib.Path)
    args = parser.parse_args(arguments)
    if args.command == "run":
        table = REDUCED if args.reduced else FULL
        args.sets, args.iterations = args.sets or table["sets"], args.iterations or table["iterations"]
        args.strategies = args.strategies or table["strategies"]
        unknown = [name for name in args.strategies if name not in STRATEGIES]
        if unknown:
            fail(f"--strategies {unknown[0]}: is none of {', '.join(STRATEGIES)}")
        if min(args.iterations) < 1 or args.limit <= 0 or (args.reduced or 1) < 1:
            fail("--iterations, --limit and --reduced take numbers above 0")
        if not os.access(args.darb, os.X_OK):
            fail(f"{args.darb} is not built; name another with --darb")
    return args, rest


def main():
    args, rest = parse(sys.argv[1:])
    if args.command == "run":
        return Table(args, rest).execute()
    text = page(read_rows(args.after), read_rows(args.before) if args.before else [])
    if args.output:
        args.output.write_text(text, encoding="utf-8")
    else:
        print(text, end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
