#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Tables of what accuracy costs on some scenes (docs/experiments/accuracy_cost.md), and of which effects each data set needs
(docs/experiments/effect_costs.md).

    tools/lab/show_costs.py --darb build/darb --scene NAME=SCENE[,DATASET] ... [--quick]
        runs `darb cost` on each scene; writes OUT/accuracy_cost.json
    tools/lab/show_costs.py --darb build/darb --plan NAME=PATH ... [--compare NAME=PATH[,CAMERAS] ...]
        runs `darb plan` on each data set or scene, with time and memory of none, auto and all for those of
        --compare; writes OUT/effect_plans.json

--out OUT: default assets/results. --prefix "chrt -r 4": put before each measuring command. --note TEXT: about the
machine, kept in the files. Results of scenes that are not named this time are kept. Every call, even one without scenes,
rewrites the tables of both pages.
"""

import argparse
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile

import guards  # beside this file: the tables of a page
import results

SETTINGS_FIRST = ["balanced", "fast", "exact"]
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def read(path):
    if not os.path.exists(path):
        return {}
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def write(path, data):
    os.makedirs(os.path.dirname(os.path.abspath(path)), exist_ok=True)
    results.write(path, dict(sorted(data.items())))


def named(text):
    name, _, paths = text.partition("=")
    if not paths:
        sys.exit(f"{text}: write it as NAME=PATH")
    return name, paths.split(",")


def run(prefix, command):
    print("$ " + shlex.join(command), file=sys.stderr, flush=True)
    done = subprocess.run(shlex.split(prefix) + command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{shlex.join(command)} ended with {done.returncode}:\n{done.stderr}")
    return done.stdout


def cost_of(options, paths):
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "cost.json")
        quick = ["--quick"] if options.quick else []
        run(options.prefix, [options.darb, "cost", *paths, "--json", file, "-q", *quick])
        full = read(file)
    rows = []
    for row in full["rows"]:
        one = {"name": row["name"], "ms": row["ms"], "error": row["error"], "on_front": row["on_front"],
               "same_as_balanced": row["same_as_balanced"]}
        if "photos" in row:
            one["photos"] = row["photos"]
        rows.append(one)
    kept = ("version", "device", "driver", "kernel", "footprint", "splats", "pixels", "repeats", "answers")
    return {**{key: full[key] for key in kept}, "views": len(full["views"]), "rows": rows,
            "note": options.note}


def plan_of(options, paths, compare):
    command = [options.darb, "plan", paths[0], "--json", "-", "--no-price"]
    if len(paths) > 1:
        command += ["--cameras", paths[1]]
    plan = json.loads(run(options.prefix if compare else "", command + (["--compare"] if compare else [])))
    plan.pop("path")
    plan["note"] = options.note
    return plan


def cost_cell(row):
    photos = f", {row['photos']['psnr_db']:.2f} dB" if "photos" in row else ""
    text = f"{row['ms']['median']:.1f} ms, {row['error']['psnr_db']:.1f} dB{photos}"
    return f"**{text}**" if row["on_front"] else text


def answer_table(answers):
    """The sentences of `darb cost` about what is fastest under a condition, one row each."""
    form = re.compile(r"Fastest (?:with|within|at) (.*): (.*), ([\d.]+) ms a frame, ([\d.]+) times as fast as balanced, "
                      r"([\d.]+ dB) from the truth(?:, ([\d.]+ dB) against the photos)?\.")
    rows = []
    for answer in answers:
        found = form.fullmatch(answer)
        if not found:
            sys.exit(f"accuracy_cost.json: no settings, times and errors in '{answer}'; `darb cost` says it otherwise now")
        rows.append([cell or "" for cell in found.groups()])
    return ["| fastest with | settings | ms | beside balanced | from the truth | photos |", "|---|---|---|---|---|---|",
            *(f"| {what} | {settings} | {ms} | {ratio} times as fast | {truth} | {photos} |"
              for what, settings, ms, ratio, truth, photos in rows)]


def cost_tables(costs):
    """Single settings and presets with a column for each scene, then the answers and the front of each."""
    single = [s for s in SETTINGS_FIRST if any(s == r["name"] for scene in costs.values() for r in scene["rows"])]
    single += [r["name"] for scene in costs.values() for r in scene["rows"]
               if re.fullmatch(r"[a-z_]+ \S+", r["name"]) and r["name"] not in single]
    lines = ["| setting | " + " | ".join(f"{n}: a frame, from the truth" + (", from photos" if "photos" in s["rows"][0]
                                         else "") for n, s in costs.items()) + " |", "|---|" + "---|" * len(costs)]
    for name in dict.fromkeys(single):
        cells = [next((cost_cell(r) for r in s["rows"] if r["name"] == name), "") for s in costs.values()]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    for name, scene in costs.items():
        lines += ["", f"**{name}**: {scene['splats']:,} splats ({scene['kernel']}), {scene['views']} views, "
                  f"{scene['pixels']:,} px, {scene['repeats']} repeats or more, {scene['driver']}. {scene['note']} "
                  "The front, fastest first:", "", "| settings | ms | from the truth |" +
                  (" photos |" if "photos" in scene["rows"][0] else ""),
                  "|---|---|---|" + ("---|" if "photos" in scene["rows"][0] else "")]
        for row in sorted((r for r in scene["rows"] if r["on_front"]), key=lambda r: r["ms"]["median"]):
            photos = f" {row['photos']['psnr_db']:.2f} dB |" if "photos" in row else ""
            lines.append(f"| {row['name']} | {row['ms']['median']:.1f} | {row['error']['psnr_db']:.1f} dB |{photos}")
        lines += ["", *answer_table(scene["answers"])]
    return "\n".join(lines)


def what_is_on(plan):
    on = [e for e in plan["effects"] if e["on"]]
    off = [e for e in plan["effects"] if not e["on"] and e["measured"] > 0]
    return "; ".join(f"**{e['effect']}**: {e['reason']}" for e in on) + \
        "".join(f"; {e['effect']} off: {e['reason']}" for e in off)


def plan_table(plans):
    rows = [f"| {name} | {what_is_on(plan)} |" for name, plan in sorted(plans.items())]
    return "\n".join(["| of | effects that are on, and why; those that are off by a measured number |", "|---|---|"] + rows)


def compared_table(plans):
    lines = ["| what | none | auto | all |", "|---|---|---|---|"]
    for name, plan in sorted(plans.items()):
        if "compared" in plan:
            cells = [f"{c['ms']:.1f} ms (± {c['spread_ms']:.1f}), {c['peak_bytes'] / 1e6:.1f} MB" for c in plan["compared"]]
            lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def write_docs(costs, plans):
    for page, tables in (("docs/experiments/accuracy_cost.md", {"costs": cost_tables(costs)}),
                         ("docs/experiments/effect_costs.md", {"compared": compared_table(plans), "plans": plan_table(plans)})):
        path = os.path.join(ROOT, page)
        with open(path, encoding="utf-8") as file:
            text = file.read()
        for name, table in tables.items():
            text = guards.between(text, name, new=table)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--darb", default=os.path.join(ROOT, "build/darb"))
    parser.add_argument("--out", default=os.path.join(ROOT, "assets/results"))
    parser.add_argument("--prefix", default="")
    parser.add_argument("--note", default="")
    parser.add_argument("--quick", action="store_true")
    for kind in ("scene", "plan", "compare"):
        parser.add_argument("--" + kind, action="append", default=[], metavar="NAME=PATH")
    options = parser.parse_args()
    costs_file = os.path.join(options.out, "accuracy_cost.json")
    plans_file = os.path.join(options.out, "effect_plans.json")
    costs, plans = read(costs_file), read(plans_file)
    for text in options.scene:
        name, paths = named(text)
        costs[name] = cost_of(options, paths)
        write(costs_file, costs)
    for kind in ("plan", "compare"):
        for text in getattr(options, kind):
            name, paths = named(text)
            plans[name] = plan_of(options, paths, kind == "compare")
            write(plans_file, plans)
    write_docs(costs, plans)


if __name__ == "__main__":
    main()
