#!/usr/bin/env python3
"""The tables of docs/accuracy.md: what accuracy costs on some scenes, and what effects each data set calls for.

    tools/show_costs.py --darb build/tools/darb --scene NAME=SCENE[,DATASET] ... [--quick]
        runs `darb cost` on each scene; writes OUT/accuracy_cost.json
    tools/show_costs.py --darb build/tools/darb --plan NAME=PATH ... [--compare NAME=PATH[,CAMERAS] ...]
        runs `darb plan` on each data set or scene, with time and memory of none, auto and all for those of
        --compare; writes OUT/effect_plans.json

--out OUT: default assets/results. --prefix "chrt -r 4": put before each measuring command. --note TEXT: about the
machine, kept in the files. --print: only prints the tables of the files that are there. Results of scenes that are
not named this time are kept. The tables are printed as Markdown.
"""

import argparse
import json
import os
import shlex
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def read(path):
    if not os.path.exists(path):
        return {}
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def write(path, data):
    os.makedirs(os.path.dirname(os.path.abspath(path)), exist_ok=True)
    with open(path, "w", encoding="utf-8") as file:
        json.dump(data, file, indent=1, sort_keys=True)
        file.write("\n")


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
    command = [options.darb, "plan", paths[0], "--json", "--no-price"]
    if len(paths) > 1:
        command += ["--cameras", paths[1]]
    plan = json.loads(run(options.prefix if compare else "", command + (["--compare"] if compare else [])))
    plan.pop("path")
    plan["note"] = options.note
    return plan


def cost_table(name, scene):
    photos = "photos" in scene["rows"][0]
    print(f"\n**{name}**: {scene['splats']:,} splats, {scene['views']} views, {scene['device']}. {scene['note']}\n")
    print("| setting | ms | PSNR to the truth (dB) | largest error |" + (" photos (dB) |" if photos else ""))
    print("|---|---|---|---|" + ("---|" if photos else ""))
    for row in scene["rows"]:
        mark = "**" if row["on_front"] else ""
        cells = [f"{mark}{row['name']}{mark}", f"{row['ms']['median']:.1f}", f"{row['error']['psnr_db']:.1f}",
                 f"{row['error']['max']:.4f}"]
        if photos:
            cells.append(f"{row['photos']['psnr_db']:.2f}")
        print("| " + " | ".join(cells) + " |")
    for answer in scene["answers"]:
        print(f"- {answer}")


def plan_tables(plans):
    print("\n| what | on | of these by measured numbers |\n|---|---|---|")
    for name, plan in plans.items():
        on = [row for row in plan["effects"] if row["on"]]
        reasons = "; ".join(f"{row['effect']}: {row['reason']}" for row in on)
        print(f"| {name} | {', '.join(row['effect'] for row in on) or 'none'} | {reasons} |")
    print("\n| what | none | auto | all |\n|---|---|---|---|")
    for name, plan in plans.items():
        if "compared" in plan:
            cells = [f"{c['ms']:.1f} ms, {c['peak_bytes'] / 1e6:.1f} MB" for c in plan["compared"]]
            print(f"| {name} | " + " | ".join(cells) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--darb", default=os.path.join(ROOT, "build/tools/darb"))
    parser.add_argument("--out", default=os.path.join(ROOT, "assets/results"))
    parser.add_argument("--prefix", default="")
    parser.add_argument("--note", default="")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--print", action="store_true")
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
    if options.scene or options.print:
        for name, scene in costs.items():
            cost_table(name, scene)
    if options.plan or options.compare or options.print:
        plan_tables(plans)


if __name__ == "__main__":
    main()
