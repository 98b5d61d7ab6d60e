#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Compares two results of `darb bench --json`: which cases became faster or slower, and which differences are noise.

    tools/lab/bench_compare.py BEFORE.json AFTER.json [--passes] [--least PERCENT] [--json FILE]

A difference counts as one when the middle halves of the samples (the quartiles) do not overlap and the medians are
more than PERCENT apart (default 2); a rank test over all samples (Mann-Whitney, two-sided) must agree at p < 0.01
where both sides have 8 samples or more. Everything else is noise. A case during which other processes held more than
a tenth of a core is marked "busy": its times are too long, by how much nobody knows.

--passes: also every pass and yardstick, judged by quartiles alone. Exit code: 0, also where something became slower.
"""

import argparse
import json
import math
import sys

BUSY_CORES = 0.1


def read(path):
    try:
        with open(path, encoding="utf-8") as file:
            data = json.load(file)
        return data["context"], {case["name"]: case for case in data["benchmarks"]}
    except (OSError, ValueError, KeyError, TypeError) as error:
        sys.exit(f"bench_compare.py: {path}: no result of darb bench --json ({error})")


def rank_test(a, b):
    """Two-sided p of Mann-Whitney's U by its normal approximation with ties; None where samples are too few."""
    if min(len(a), len(b)) < 8:
        return None
    both = sorted(a + b)
    ranks, ties, i = {}, 0.0, 0
    while i < len(both):
        j = i
        while j < len(both) and both[j] == both[i]:
            j += 1
        ranks[both[i]] = (i + 1 + j) / 2
        ties += (j - i) ** 3 - (j - i)
        i = j
    n, m, count = len(a), len(b), len(both)
    u = sum(ranks[x] for x in a) - n * (n + 1) / 2
    variance = n * m / 12 * (count + 1 - ties / (count * (count - 1)))
    if variance <= 0:
        return 1.0
    z = max(abs(u - n * m / 2) - 0.5, 0) / math.sqrt(variance)
    return math.erfc(z / math.sqrt(2))


def quartiles(spread):
    return spread["quartile_low"], spread["median"], spread["quartile_high"]


def judge(before, after, least, samples=None):
    """-> (change of the median in percent, verdict)"""
    (low_a, a, high_a), (low_b, b, high_b) = before, after
    if a <= 0:
        return 0.0, "no time"
    change = 100 * (b / a - 1)
    apart = high_a < low_b or high_b < low_a
    p = rank_test(*samples) if samples else None
    if not apart or abs(change) < least or (p is not None and p >= 0.01):
        return change, "noise"
    return change, "slower" if change > 0 else "faster"


def half_width(spread):
    low, middle, high = spread
    return 50 * (high - low) / middle if middle > 0 else 0.0


def compare_case(a, b, least):
    before = (a["quartile_low"], a["real_time"], a["quartile_high"])
    after = (b["quartile_low"], b["real_time"], b["quartile_high"])
    change, verdict = judge(before, after, least, (a["samples"], b["samples"]))
    return {"name": a["name"], "before_ms": before[1], "after_ms": after[1], "change_percent": change,
            "spread_before_percent": half_width(before), "spread_after_percent": half_width(after),
            "verdict": verdict, "busy": max(a["beside_cores"], b["beside_cores"]) > BUSY_CORES,
            "same_work": all(a.get(key) == b.get(key) for key in ("splats", "pairs", "pixels"))}


def compare_parts(a, b, least):
    rows = []
    for kind, key in (("", None), ("native ", "native_ms")):
        parts = ("yardsticks" if key else "passes")
        for name, one in a[parts].items():
            other = b[parts].get(name)
            if other is None:
                continue
            before, after = (quartiles(x[key] if key else x) for x in (one, other))
            change, verdict = judge(before, after, least)
            rows.append({"name": f"  {kind}{name}", "before_ms": before[1], "after_ms": after[1],
                         "change_percent": change, "spread_before_percent": half_width(before),
                         "spread_after_percent": half_width(after), "verdict": verdict})
    return rows


def print_row(row):
    marks = [row["verdict"]]
    if row.get("busy"):
        marks.append("busy")
    if not row.get("same_work", True):
        marks.append("other work (splats, pairs or pixels differ)")
    print(f"{row['name']:<40} {row['before_ms']:>11.3f} {row['spread_before_percent']:>6.1f} "
          f"{row['after_ms']:>11.3f} {row['spread_after_percent']:>6.1f} {row['change_percent']:>+8.1f} %  "
          f"{', '.join(marks)}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before")
    parser.add_argument("after")
    parser.add_argument("--passes", action="store_true", help="also every pass and yardstick")
    parser.add_argument("--least", type=float, default=2, metavar="PERCENT", help="what is too little to count")
    parser.add_argument("--json", metavar="FILE", help="write the comparison to this file")
    options = parser.parse_args()
    (context_a, before), (context_b, after) = read(options.before), read(options.after)
    for key in ("device", "driver", "processor", "num_cpus", "scheduling"):
        if context_a.get(key) != context_b.get(key):
            print(f"note: {key} differs: {context_a.get(key)} and {context_b.get(key)}")
    print(f"before {context_a.get('commit')} of {context_a.get('date')}, "
          f"after {context_b.get('commit')} of {context_b.get('date')}")
    print(f"{'':<40} {'before ms':>11} {'+- %':>6} {'after ms':>11} {'+- %':>6} {'change':>10}")
    rows = []
    for name, case in before.items():
        if name not in after:
            print(f"{name:<40} only in {options.before}")
            continue
        rows.append(compare_case(case, after[name], options.least))
        print_row(rows[-1])
        if options.passes:
            parts = compare_parts(case, after[name], options.least)
            rows[-1]["passes"] = parts
            for part in parts:
                print_row(part)
    for name in after:
        if name not in before:
            print(f"{name:<40} only in {options.after}")
    counted = {verdict: sum(row["verdict"] == verdict for row in rows) for verdict in ("faster", "slower", "noise")}
    print(", ".join(f"{count} {verdict}" for verdict, count in counted.items()))
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump({"before": context_a, "after": context_b, "rows": rows}, file, indent=1)
            file.write("\n")


if __name__ == "__main__":
    main()
