#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Estimates the time of one training iteration on a GPU from what its compiler reports about the passes.

    gpu_model.py PASSES.json [--gpu NAME]     PASSES.json: of `darb devices --passes --json`, or gpu_compilers.py run
    gpu_model.py --gpus                       the GPUs that it knows, and their rates

This is an estimate, not a measurement. Each pass takes the longest of three times: to issue its instructions, to move its
bytes, and to process its longest tile by one workgroup. A launch for each dispatch and a wait for each barrier are added.
Bytes, dispatches and barriers are those of the command; instructions are the compiler's. For a pass with loops over
splats, LOOPS has the instructions of its loop for one splat and the pixels of a subgroup.
"""

import argparse
import json
import sys

# cores; instructions of one subgroup that a core issues per cycle, for subgroups of `lanes`; GHz; GB/s of memory. The
# figures are the vendors' published ones. An instruction that waits for the one before takes WAIT cycles.
GPUS = {
    "rtx4090": ("RTX 4090", 128, 4, 32, 2.52, 1008),
    "h200": ("H200", 132, 4, 32, 1.98, 4800),
    "rx7900xtx": ("RX 7900 XTX", 96, 1, 64, 2.5, 960),
    "a770": ("Arc A770", 32, 4, 32, 2.1, 560),
    "m1": ("M1", 8, 4, 32, 1.28, 68),
    "radeon780m": ("Radeon 780M", 12, 1, 64, 2.7, 90),
}
WAIT = 4.5                       # cycles
LAUNCH_US, BARRIER_US = 1.5, 2.5
REACHED_BYTES = 0.7  # share of the memory's rate that scattered accesses of 16 bytes and more reach
TILE_PIXELS, TOUCHED = 256, 0.6  # share of a tile's blocks that a splat touches
WALKED = 0.7  # share of these before all of a block's pixels are opaque
LONGEST = 4  # the longest list relative to the mean one

# Shader -> instructions of the inner loop for one splat and 64 pixels: (Ada, RDNA 3), read off the listings of Mesa's
# compilers. The team's 240 are 214 of its loop and 26 of what it does for a chunk, if a splat touches TOUCHED of the
# blocks; its 107 are in proportion. "version_0.1" reduced each sum over the whole subgroup.
LOOPS = {"blend": (98, 42), "version_0.1": (364, 161), "blend_backward": (224, 100), "blend_backward_team": (240, 107)}
ZEROED_BYTES = 36  # per intersection, before a backward blend that adds to its slots
# Pass of an iteration -> its shader, and what each of its threads handles.
THREADS = {"project": ("project", "splats"), "emit": ("emit", "splats"), "project backward": ("project_backward", "splats"),
           "loss": ("loss", "strips")}
LOSS_ROWS = 3 * 1.6 / 2  # channels, rows and columns computed twice, columns of a thread
SUBGROUP_SERIAL = {"version_0.1": 4, "blend_backward": 4, "blend_backward_team": 1, "blend": 1}  # blocks that a subgroup walks in turn


def instructions(report, shader):
    """Instructions of the form with the most harmonics, as the report has the pass; None where the driver does not tell."""
    rows = [row["instructions"] for row in report["passes"] if row["shader"] == shader and "instructions" in row]
    return max(rows) if rows else None


def blend_time(shader, work, gpu):
    """(issue, longest tile) in ms."""
    _, cores, rate, lanes, clock, _ = gpu
    loop = LOOPS[shader][1 if lanes == 64 else 0]
    pairs = work["intersections"] * TOUCHED * WALKED * 4  # splat-blocks of 64 pixels
    issue = pairs * loop / (cores * rate * clock * 1e6)
    tiles = work["pixels"] / TILE_PIXELS
    longest = work["intersections"] / tiles * TOUCHED * WALKED * LONGEST
    return issue, longest * SUBGROUP_SERIAL[shader] * loop * WAIT / (clock * 1e6)


def pass_time(report, work, row, gpu, backward):
    """Milliseconds, and what limits the pass."""
    _, cores, rate, lanes, clock, memory = gpu
    times = {"bytes": row["bytes"] / (memory * 1e6 * REACHED_BYTES)}
    name = row["pass"]
    if name in ("blend", "blend backward"):
        times["issue"], times["longest tile"] = blend_time(backward if name == "blend backward" else "blend", work, gpu)
    elif name in THREADS:
        shader, of = THREADS[name]
        threads = work["pixels"] * LOSS_ROWS if of == "strips" else work[of]
        count = instructions(report, shader)
        if count is not None:
            times["issue"] = threads / lanes * count / (cores * rate * clock * 1e6)
    limit = max(times, key=times.get)
    zeroed = name == "blend backward" and backward != "blend_backward_team"
    return times[limit] + zeroed * work["intersections"] * ZEROED_BYTES / (memory * 1e6 * REACHED_BYTES), limit


def estimate(report, gpu, backward):
    """Rows (pass, ms, what limits it), followed by what launches and barriers take."""
    work = report["iteration"]
    rows = [(row["pass"], *pass_time(report, work, row, gpu, backward)) for row in work["passes"]]
    waits = sum(row["dispatches"] * LAUNCH_US + row["barriers"] * BARRIER_US for row in work["passes"]) / 1e3
    return [*rows, ("launches and barriers", waits, "latency")]


def chosen(report):
    """The backward blend with which the device begins."""
    shaders = {row["shader"] for row in report["passes"]}
    return "blend_backward_team" if "blend_backward_team" in shaders and "llvmpipe" not in report["driver"] else "blend_backward"


def print_estimate(report, names, backward):
    work = report["iteration"]
    print(f"One iteration, {work['splats']:,.0f} visible splats of degree 3, {work['pixels']:,.0f} pixels, "
          f"{work['intersections']:,.0f} intersections, ms (estimate):\n")
    print("| pass | " + " | ".join(GPUS[name][0] for name in names) + " |")
    print("|---" * (len(names) + 1) + "|")
    columns = [estimate(report, GPUS[name], backward) for name in names]
    for cells in zip(*columns):
        print(f"| {cells[0][0]} | " + " | ".join(f"{ms:.2f}, {limit}" for _, ms, limit in cells) + " |")
    print("| all | " + " | ".join(f"{sum(row[1] for row in column):.1f}" for column in columns) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("passes", nargs="?")
    parser.add_argument("--gpu", action="append", choices=sorted(GPUS))
    parser.add_argument("--gpus", action="store_true")
    parser.add_argument("--backward", choices=[name for name in LOOPS if name != "blend"])
    flags = parser.parse_args()
    if flags.gpus:
        for key, (name, cores, rate, lanes, clock, memory) in GPUS.items():
            print(f"{key:<12} {name:<14} {cores:>4} cores, {rate} x {lanes} lanes a cycle, {clock} GHz, {memory} GB/s")
        return 0
    if not flags.passes:
        parser.error("name the file of `darb devices --passes --json FILE`")
    try:
        with open(flags.passes, encoding="utf-8") as file:
            report = json.load(file)
        print_estimate(report, flags.gpu or list(GPUS), flags.backward or chosen(report))
    except (OSError, ValueError, KeyError) as error:
        print(f"gpu_model.py: {flags.passes}: {error!r}; make it with: darb devices --passes --json FILE", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
