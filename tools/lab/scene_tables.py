#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Keeps the results of `darb compare` on data sets in assets/results/scenes_lavapipe.json and writes their tables into
docs/experiments/kernels_on_photos.md.

    tools/lab/scene_tables.py TITLE=COMPARE.json...     takes these comparisons, one table each; others stay
    tools/lab/scene_tables.py                           only writes the page again
"""

import json
import os
import sys

import results  # beside this file

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
FIGURES = os.path.join(ROOT, "assets/results/scenes_lavapipe.json")
PAGE = os.path.join(ROOT, "docs/experiments/kernels_on_photos.md")
KEPT = {"psnr_db": 3, "ssim": 4, "lpips": 4, "model_mb": 3, "splats": 0, "peak_mb": 1, "training_s": 1}
BLENDING = {"blended_per_pixel": 1, "pairs_per_splat": 2, "blend_ms": 1, "ns_per_splat_pixel": 2, "frame_ms": 1}


def kept(report):
    """The medians of a report, with the runs they come from; curves and views stay in the report."""
    rows = []
    for dataset in report["datasets"]:
        for m in dataset["medians"]:
            row = {"dataset": dataset["name"], "kernel": m["kernel"], "iteration": m["iteration"]}
            for name, digits in KEPT.items():
                if m.get(name) is not None:  # null: every run failed, or none was evaluated there
                    row[name] = [round(m[name][k], digits) for k in ("median", "low", "high")]
                    row["runs"] = m[name]["runs"]
            rows.append(row)
        rows += [{"dataset": dataset["name"], "kernel": r["kernel"], "seed": r["seed"], "failure": r["failure"]}
                 for r in dataset["runs"] if r["failure"]]
        rows += [{"dataset": dataset["name"], "kernel": r["kernel"], "seed": r["seed"]} |
                 {name: round(r["blending"][name], digits) for name, digits in BLENDING.items()}
                 for r in dataset["runs"] if r.get("blending")]
    return {"device": report["driver"] if "driver" in report else report["device"], "settings": report["settings"],
            "median_low_high": rows}


def spread(row, name, form):
    if name not in row:
        return "-"
    median, low, high = row[name]
    return form.format(median) + (f" ({form.format(low)} to {form.format(high)})" if low != high else "")


def table(title, figures):
    rows = [r for r in figures["median_low_high"] if "iteration" in r]
    steps = sorted({r["iteration"] for r in rows})
    lines = [f"**{title}** {figures['settings']}", "",
             "| data set | kernel | " + " | ".join(f"PSNR dB, SSIM at {n:,}" for n in steps) +
             " | splats | seconds |", "|---|---|" + "---|" * (len(steps) + 2)]
    before = None
    for name, kernel in dict.fromkeys((r["dataset"], r["kernel"]) for r in rows):
        at = {r["iteration"]: r for r in rows if (r["dataset"], r["kernel"]) == (name, kernel)}
        cells = [name if name != before else "", kernel]
        for step in steps:
            known = [r["psnr_db"][0] for r in rows
                     if r["dataset"] == name and r["iteration"] == step and "psnr_db" in r]
            row = at.get(step, {})
            mark = "**" if "psnr_db" in row and row["psnr_db"][0] == max(known) else ""
            cells.append(f"{mark}{spread(row, 'psnr_db', '{:.2f}')}{mark}, {spread(row, 'ssim', '{:.4f}')}"
                         if "psnr_db" in row else "-")
        last = at[max(at)]
        cells += [spread(last, "splats", "{:,.0f}"), spread(last, "training_s", "{:.0f}")]
        lines.append("| " + " | ".join(cells) + " |")
        before = name
    failed = [f"{r['dataset']}, {r['kernel']}, seed {r['seed']}: {r['failure']}"
              for r in figures["median_low_high"] if "failure" in r]
    return "\n".join(lines + ([""] + failed if failed else []))


def blending_table(title, figures):
    """The first run of each kernel, with a column for each data set; nothing where none was measured."""
    rows = [r for r in figures["median_low_high"] if "blended_per_pixel" in r]
    sets, kernels = (list(dict.fromkeys(r[key] for r in rows)) for key in ("dataset", "kernel"))
    lines = [f"**{title}**", "", "| blended per pixel, intersections per splat, ms | " + " | ".join(sets) + " |",
             "|---|" + "---|" * len(sets)]
    for kernel in kernels:
        cells = {r["dataset"]: f"{r['blended_per_pixel']:.1f}, {r['pairs_per_splat']:.2f}, {r['blend_ms']:.1f}"
                 for r in reversed(rows) if r["kernel"] == kernel}
        lines.append(f"| {kernel} | " + " | ".join(cells.get(name, "-") for name in sets) + " |")
    return "\n".join(lines) if rows else ""


def replaced(page, name, tables):
    """The page with these tables between its markers of this name."""
    begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
    if begin not in page or end not in page:
        sys.exit(f"{PAGE}: has no {begin.strip()} before {end}; put both back")
    return page[:page.index(begin) + len(begin)] + "\n\n".join(t for t in tables if t) + "\n" + page[page.index(end):]


def main():
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(__doc__.strip())
        return 0
    figures = {}
    if os.path.exists(FIGURES):
        with open(FIGURES, encoding="utf-8") as file:
            figures = json.load(file)
    for argument in sys.argv[1:]:
        title, found, path = argument.partition("=")
        if not found:
            sys.exit(__doc__)
        with open(path, encoding="utf-8") as file:
            figures[title] = kept(json.load(file))
    with open(PAGE, encoding="utf-8") as file:
        page = file.read()
    page = replaced(page, "the tables of blending", [blending_table(*item) for item in figures.items()])
    page = replaced(page, "the tables of the data sets", [table(*item) for item in figures.items()])
    results.write(FIGURES, figures)
    with open(PAGE, "w", encoding="utf-8") as file:
        file.write(page)


if __name__ == "__main__":
    main()
