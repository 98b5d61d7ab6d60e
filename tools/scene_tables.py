#!/usr/bin/env python3
"""Keeps what `darb compare` found on data sets in assets/results/scenes_lavapipe.json and writes its tables into
docs/paper.md.

    tools/scene_tables.py TITLE=COMPARE.json...     takes these comparisons, one table each; others stay
    tools/scene_tables.py                           only writes the page again
"""

import json
import os
import re
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
FIGURES = os.path.join(ROOT, "assets/results/scenes_lavapipe.json")
PAGE = os.path.join(ROOT, "docs/paper.md")
KEPT = {"psnr_db": 3, "ssim": 4, "lpips": 4, "model_mb": 3, "splats": 0, "training_s": 1}


def kept(report):
    """The medians of a report, with the runs they come from; curves and views stay in the report."""
    rows = []
    for dataset in report["datasets"]:
        for m in dataset["medians"]:
            row = {"dataset": dataset["name"], "kernel": m["kernel"], "iteration": m["iteration"]}
            for name, digits in KEPT.items():
                if m[name] is not None:
                    row[name] = [round(m[name][k], digits) for k in ("median", "low", "high")]
                    row["runs"] = m[name]["runs"]
            rows.append(row)
        rows += [{"dataset": dataset["name"], "kernel": r["kernel"], "seed": r["seed"], "failure": r["failure"]}
                 for r in dataset["runs"] if r["failure"]]
    return {"device": report["driver"] if "driver" in report else report["device"], "settings": report["settings"],
            "median_low_high": rows}


def spread(values, form):
    median, low, high = values
    return form.format(median) + (f" ({form.format(low)} to {form.format(high)})" if low != high else "")


def table(title, figures):
    rows = [r for r in figures["median_low_high"] if "failure" not in r]
    steps = sorted({r["iteration"] for r in rows})
    lines = [f"**{title}** {figures['settings']}", "",
             "| data set | kernel | " + " | ".join(f"PSNR dB, SSIM at {n:,}" for n in steps) +
             " | splats | seconds |", "|---|---|" + "---|" * (len(steps) + 2)]
    before = None
    for name, kernel in dict.fromkeys((r["dataset"], r["kernel"]) for r in rows):
        at = {r["iteration"]: r for r in rows if (r["dataset"], r["kernel"]) == (name, kernel)}
        cells = [name if name != before else "", kernel]
        for step in steps:
            best = max(r["psnr_db"][0] for r in rows if r["dataset"] == name and r["iteration"] == step)
            mark = "**" if step in at and at[step]["psnr_db"][0] == best else ""
            cells.append(f"{mark}{spread(at[step]['psnr_db'], '{:.2f}')}{mark}, "
                         f"{spread(at[step]['ssim'], '{:.4f}')}" if step in at else "-")
        last = at[max(at)]
        cells += [spread(last["splats"], "{:,.0f}"), spread(last["training_s"], "{:.0f}")]
        lines.append("| " + " | ".join(cells) + " |")
        before = name
    failed = [f"{r['dataset']}, {r['kernel']}, seed {r['seed']}: {r['failure']}"
              for r in figures["median_low_high"] if "failure" in r]
    return "\n".join(lines + ([""] + failed if failed else []))


def main():
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
    with open(FIGURES, "w", encoding="utf-8") as file:  # a row a line
        text = json.dumps(figures, indent=1)
        file.write(re.sub(r"\[\s+([^\[\]{}]*?)\s+\]", lambda m: "[" + re.sub(r"\s+", " ", m[1]) + "]", text) + "\n")
    with open(PAGE, encoding="utf-8") as file:
        page = file.read()
    begin, end = "<!-- tables of the data sets -->\n", "<!-- end of the tables -->"
    tables = "\n\n".join(table(title, of) for title, of in figures.items())
    with open(PAGE, "w", encoding="utf-8") as file:
        file.write(page[:page.index(begin) + len(begin)] + tables + "\n" + page[page.index(end):])


if __name__ == "__main__":
    main()
