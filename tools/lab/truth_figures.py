#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Figures on how far the numbers can be trusted, collected from the output of the checks and shown in docs/experiments/float32.md.

    tools/lab/truth_figures.py WHAT=FILE...     takes new figures into assets/results/truth_lavapipe.json and leaves the
                                            others as they are; `tools/lab/guards.py docs` then shows them
        check=FILE    what `darb check --every-kernel --json FILE` wrote
        quick=FILE    the same of `darb check --json FILE`
        price=FILE    what tools/lab/price_of_determinism.py wrote
        guards=FILE, soak=FILE    output of tools/lab/guards.py run, tools/lab/soak.sh
        hostile=FILE  the hostile.json of tools/lab/hostile.sh
        fuzz=FILE     output of tools/fuzz.sh, of one run or of several behind each other
"""

import json
import os
import re
import sys

import results  # beside this file

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
FIGURES = "assets/results/truth_lavapipe.json"


def rounded(value):
    return float(f"{value:.3g}")


def errors_of(row):
    figures = {"error": rounded(row["error"]), "allowed": rounded(row["allowed"])}
    if "float_alone" in row:
        figures["float_alone"] = rounded(row["float_alone"])
    if row["outside"]:
        figures["outside"], figures["values"] = row["outside"], row["values"]
    return figures


def check(text):
    """Hard cases by case and kernel, walks and kernels by kernel and footprint."""
    report = json.loads(text)
    cases, walks, kernels = {}, {}, {}
    for row in report["checks"]:
        case = re.fullmatch(r"hard cases, (\S+) psi", row["group"])
        walk = re.fullmatch(r"walk, (\S+ \S+)", row["group"])
        if case and row["allowed"] > 0:
            name, of = re.match(r"(.*) (image|gradient)", row["name"]).groups()
            cases.setdefault(name, {}).setdefault(of, {})[case[1]] = errors_of(row)
        elif walk and row["allowed"] > 0:
            walks.setdefault(walk[1], {})[row["name"]] = errors_of(row)
        elif row["group"] == "kernels":
            name, of = row["name"].rsplit(" ", 1)
            kernels.setdefault(name, {})[of] = errors_of(row)
    return {"device": report["device"], "driver": report["driver"], "checks": len(report["checks"]),
            "failed": report["failed"], "seconds": rounded(report["seconds"]), "hard_cases": cases, "walks": walks,
            "kernels": kernels}


def quick(text):
    report = json.loads(text)
    return {"checks": len(report["checks"]), "failed": report["failed"], "seconds": rounded(report["seconds"])}


def fuzz(text):
    readers = {}
    for name, seconds, runs in re.findall(r"^(\w+): (\d+) s, (\d+) executions, no finding$", text, re.M):
        sums = readers.setdefault(name, {"seconds": 0, "executions": 0})
        sums["seconds"] += int(seconds)
        sums["executions"] += int(runs)
    return {"findings": len(re.findall("FAILED", text)), "of": readers,
            "hours": rounded(sum(r["seconds"] for r in readers.values()) / 3600),
            "executions": sum(r["executions"] for r in readers.values())}


def guards(text):
    disabled, unwatched = re.search(r"^(\d+) guards, (\d+) unwatched$", text, re.M).groups()
    return {"disabled": int(disabled), "unwatched": int(unwatched)}


def hostile(text):
    day = json.loads(text)
    return {"hours": rounded(day["hours"]), "findings": len(day["findings"]), "counts": day["counts"],
            "of": {name: part["executions"] for name, part in day["parts"].items()}}


def soak(text):
    found = re.search(r"^(\d+) iterations, (\d+) s: ([\d.]+) MiB, then ([\d.]+) MiB, most ([\d.]+) MiB$", text, re.M)
    return {"iterations": int(found[1]), "seconds": int(found[2]), "mib_in_the_fourth_fifth": float(found[3]),
            "mib_in_the_last_fifth": float(found[4]), "mib_most": float(found[5])}


COLLECT = {"check": check, "quick": quick, "price": json.loads, "fuzz": fuzz, "guards": guards, "hostile": hostile,
           "soak": soak}


def load():
    path = os.path.join(ROOT, FIGURES)
    if not os.path.exists(path):
        return {}
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def shown(figures):
    return f"{figures['error']:.0e}" + ("*" if "outside" in figures else "")


def case_errors(check_figures):
    cases = check_figures["hard_cases"]
    kernels = list(next(iter(cases.values()))["image"])
    lines = ["| case | of | " + " | ".join(k.replace("_", " ") for k in kernels) + " | float alone |",
             "|---|---|" + "---|" * (len(kernels) + 1)]
    for name, by_what in cases.items():
        for of, by_kernel in by_what.items():
            alone = max(f.get("float_alone", 0) for f in by_kernel.values())
            cells = [shown(by_kernel[k]) for k in kernels] + [f"{alone:.0e}"]
            lines.append(f"| {name} | {of} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def walk_errors(check_figures):
    walks = check_figures["walks"]
    names = list(next(iter(walks.values())))
    lines = ["| kernel, footprint | " + " | ".join(n.replace("_", " ") for n in names) + " |",
             "|---|" + "---|" * len(names)]
    for kernel, errors in walks.items():
        cells = [f"{shown(errors[n])} ({errors[n]['float_alone']:.0e})" for n in names]
        lines.append(f"| {kernel.replace('_', ' ')} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def run_table(figures):
    """What was run, a line each; checks that never ran have none."""
    lines = ["| what | found |", "|---|---|"]

    def line(what, name, text):
        if name in figures:
            lines.append(f"| {what} | {text(figures[name])} |")

    line("`darb check`", "quick", lambda f: f"{f['checks']} checks in {f['seconds']:.0f} s, {f['failed']} failed")
    line("`darb check --every-kernel`", "check",
         lambda f: f"{f['checks']} checks in {f['seconds']:.0f} s, {f['failed']} failed")
    line("`tools/lab/guards.py run`", "guards",
         lambda f: f"{f['disabled']} guards disabled in turn, {f['unwatched']} without a red test")
    line("`tools/fuzz.sh`", "fuzz",
         lambda f: f"{f['executions']:,} executions in {f['hours']} h, {f['findings']} findings left: " +
         ", ".join(f"{n} {r['executions']:,}" for n, r in f["of"].items()))
    line("`tools/lab/hostile.sh`", "hostile",
         lambda f: f"{sum(f['of'].values()):,} executions in {f['hours']} h, {f['findings']} findings left: " +
         ", ".join(f"{n} {count:,}" for n, count in f["of"].items()))
    line("`tools/lab/soak.sh`", "soak",
         lambda f: f"{f['iterations']:,} iterations: {f['mib_in_the_fourth_fifth']} MiB, "
         f"then {f['mib_in_the_last_fifth']} MiB")
    line("`tools/lab/price_of_determinism.py`", "price",
         lambda f: f"{f['deterministic']['ms']['all passes']} ms an iteration, with atomics "
         f"{f['atomics']['ms']['all passes']} ms; {f['rounds']} runs end in {f['deterministic']['different_scenes']} "
         f"and {f['atomics']['different_scenes']} different scenes")
    return "\n".join(lines)


def tables():
    """-> {marker of docs/experiments/float32.md: text}"""
    figures = load()
    found = {"runs": run_table(figures)}
    if "check" in figures:
        found["errors"] = case_errors(figures["check"])
        found["walks"] = walk_errors(figures["check"])
    return found


def main():
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(__doc__.strip())
        return 0
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    figures = load()
    for argument in sys.argv[1:]:
        what, _, path = argument.partition("=")
        if what not in COLLECT:
            sys.exit(__doc__)
        with open(path, encoding="utf-8") as file:
            figures[what] = COLLECT[what](file.read())
    results.write(os.path.join(ROOT, FIGURES), figures)
    print("tools/lab/guards.py docs writes them into docs/experiments/float32.md")
    return 0


if __name__ == "__main__":
    sys.exit(main())
