#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The page of tools/gpu_report.sh: gpu_report_page.py FOLDER [PHOTOS] writes FOLDER/index.html from what the steps left.

Paths of this machine are removed from the steps' texts, and text from files is escaped.
"""

import html
import json
import os
import pathlib
import sys

import gpu_model

ROOT = pathlib.Path(__file__).resolve().parents[2]
STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:64rem;margin:2rem auto;padding:0 1rem;color:#222}
table{border-collapse:collapse;margin:1rem 0}td,th{padding:.2rem .8rem;border-bottom:1px solid #ddd;text-align:left}
td+td,th+th{text-align:right}pre{background:#f6f6f6;padding:1rem;overflow:auto;font-size:12px}img{max-width:100%}
.bad{color:#b00020}summary{cursor:pointer;font-weight:600;margin:.6rem 0}"""


def read(path):
    return path.read_text(encoding="utf-8", errors="replace") if path.exists() else ""


def table(head, rows):
    cells = "".join(f"<th>{html.escape(cell)}</th>" for cell in head)
    body = "".join("<tr>" + "".join(f"<td>{html.escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><tr>{cells}</tr>{body}</table>"


def steps_table(folder):
    rows = [line.split("\t") for line in read(folder / "steps.txt").splitlines()]
    return table(("step", "result", "seconds"), rows)


def clean(folder, photos):
    """Replaces folders of the machine by names."""
    for path in (*folder.glob("*.txt"), *folder.glob("*.json")):
        text = read(path)
        for place, name in ((str(folder), "REPORT"), (photos, "PHOTOS"), (str(ROOT), "DARB"), (os.path.expanduser("~"), "HOME")):
            if len(place) > 1:
                text = text.replace(place, name)
        path.write_text(text, encoding="utf-8")


def measured_passes(folder):
    """Pass -> (ms, counts) for the case that the model estimates, or for the largest frame."""
    files = [folder / name for name in ("filled.json", "bench.json") if (folder / name).exists()]
    cases = [case for file in files for case in json.loads(read(file))["benchmarks"]
             if case.get("passes") and case["name"].startswith(("train/filled", "render/"))]
    if not cases:
        return {}, None
    case = max(cases, key=lambda one: (one["name"].startswith("train/"), one["pixels"]))
    return {name: row["median"] for name, row in case["passes"].items()}, case


def predicted_and_measured(folder):
    """The model with the counts of the measured case, for the GPUs that it knows, beside what was measured."""
    ms, case = measured_passes(folder)
    if not case or not (folder / "passes.json").exists():
        return ""
    report = json.loads(read(folder / "passes.json"))
    report = gpu_model.scaled(report, {"splats": case["visible"], "pixels": case["pixels"], "intersections": case["pairs"]})
    work = report["iteration"]
    work["passes"] = [row for row in work["passes"] if row["pass"] in ms]
    forms = gpu_model.chosen(report)
    columns = {key: dict((name, time) for name, time, _ in gpu_model.estimate(report, gpu, forms))
               for key, gpu in gpu_model.GPUS.items()}
    rows = [(name, f"{ms[name]:.3f}", *(f"{columns[key][name]:.3f}" for key in columns)) for name in ms if name in columns["h200"]]
    rows.append(("all", f"{sum(ms.values()):.3f}", *(f"{sum(columns[key].values()):.3f}" for key in columns)))
    return (f"<h2>Measured here, and what the model says of other GPUs</h2><p>Case {html.escape(case['name'])}, ms of the device."
            " The model's columns are estimates: compare the one nearest to this device.</p>"
            + table(("pass", "measured", *(gpu[0] for gpu in gpu_model.GPUS.values())), rows))


def main():
    if len(sys.argv) not in (2, 3) or sys.argv[1] in ("-h", "--help"):
        print(__doc__)
        return 0 if len(sys.argv) == 2 else 2
    folder = pathlib.Path(sys.argv[1]).resolve()
    clean(folder, os.path.abspath(sys.argv[2]) if len(sys.argv) > 2 else "")
    parts = [f"<!doctype html><html lang=en><meta charset=utf-8><title>darb on a GPU</title><style>{STYLE}</style>",
             "<h1>darb on this device</h1>", steps_table(folder), f"<pre>{html.escape(read(folder / 'devices.txt'))}</pre>",
             predicted_and_measured(folder)]
    pictures = sorted(folder.glob("scene/held_out/**/*.png"))[:1]
    parts += [f"<h2>The shipped scene after 300 iterations, a view held out</h2><img alt='photo and picture' src='{html.escape(str(p.relative_to(folder)))}'>"
              for p in pictures]
    for line in read(folder / "steps.txt").splitlines():
        name, state, _ = line.split("\t")
        parts.append(f"<details{'' if state == 'ok' else ' open'}><summary class={'ok' if state == 'ok' else 'bad'}>"
                     f"{html.escape(name)}: {html.escape(state)}</summary><pre>{html.escape(read(folder / (name + '.txt')))}</pre></details>")
    (folder / "index.html").write_text("".join(parts) + "</html>\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
