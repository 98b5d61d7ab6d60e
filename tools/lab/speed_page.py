#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Writes the tables of docs/speed.md from results of `darb bench`: every case with its most expensive passes and their
shares of the roofline and, where there is a result of `darb bench --growth`, time against splats, pixels and intersections.

    tools/lab/speed_page.py          from assets/results/bench_lavapipe.json and growth_lavapipe.json
"""

import json
import os
import re
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
RESULTS = os.path.join(ROOT, "assets/results")
PAGE = os.path.join(ROOT, "docs/speed.md")
SHOWN = 4  # passes shown for each case


def ms(value):
    return f"{value:.1f}" if value < 100 else f"{value:.0f}"


def cases_table(report):
    context = report["context"]
    lines = [f"{context['driver']}, {context['num_cpus']} cores; {context['note']}; commit {context['commit']}; copies "
             f"{context['copy_bytes_per_s'] / 1e9:.1f} GB/s, {context['fma_per_s'] / 1e9:.1f} billion multiply-adds a second.",
             "", "| case | ms (quartiles) | share | the most expensive passes: ms, share of the roofline | times native |",
             "|---|---|---|---|---|"]
    for case in report["benchmarks"]:
        passes = sorted(case.get("passes", {}).items(), key=lambda p: -p[1]["median"])[:SHOWN]
        named = ", ".join(f"{name} {ms(p['median'])}" +
                          (f" ({100 * p['roofline']:.0f} %)" if p.get("roofline") else "") for name, p in passes)
        native = ", ".join(f"{name} {y['times_native']:.1f}" for name, y in case.get("yardsticks", {}).items())
        share = f"{100 * case['roofline']:.0f} %" if case["roofline"] else ""
        lines.append(f"| {case['name']} | {ms(case['real_time'])} ({ms(case['quartile_low'])} to "
                     f"{ms(case['quartile_high'])}) | {share} | {named} | {native} |")
    return "\n".join(lines)


def growth_table(report):
    lines = []
    for curve in report["growth"]:
        lines += [f"**One {curve['name']} by {curve['by']}**: ms = a {curve['by']}^{curve['exponent']:.2f} over the last "
                  f"decade, by intersections {curve['exponent_by_pairs']:.2f}", "", "| splats | pixels | intersections | ms |", "|---|---|---|---|"]
        lines += [f"| {p['splats']:,.0f} | {p['pixels']:,.0f} | {p['pairs']:,.0f} | {ms(p['ms'])} |" for p in curve["points"]]
        lines.append("")
    return "\n".join(lines)


def write_between(page, name, text):
    begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
    if begin not in page:
        raise SystemExit(f"{PAGE}: no {begin}")
    return re.sub(re.escape(begin) + ".*?" + re.escape(end), lambda _: f"{begin}\n{text}\n{end}", page, flags=re.S)


def main():
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(__doc__.strip())
        return 0
    with open(PAGE, encoding="utf-8") as file:
        page = file.read()
    for name, path, table in (("cases", "bench_lavapipe.json", cases_table), ("growth", "growth_lavapipe.json", growth_table)):
        path = os.path.join(RESULTS, path)
        if os.path.exists(path):
            with open(path, encoding="utf-8") as file:
                page = write_between(page, name, table(json.load(file)))
    with open(PAGE, "w", encoding="utf-8") as file:
        file.write(page)


if __name__ == "__main__":
    main()
