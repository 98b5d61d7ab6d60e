#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Estimates the time of one training iteration on a GPU from what its compiler reports about the passes.

    gpu_model.py PASSES.json [--gpu NAME]     PASSES.json: of `darb devices --passes --json`, or gpu_compilers.py run
    gpu_model.py --gpus                       the GPUs that it knows, and their rates

    --trained                                 counts of a trained scene with some splats over the whole picture, in place
                                              of those of the file
    --backward FORM --emit FORM --sums FORM   forms of passes, as of darb's --tune; usual: those with which GPUs begin

This is an estimate, not a measurement. Each pass takes the longest of three times: to issue its instructions, to move its
bytes, and to process its longest tile by one workgroup. A launch for each dispatch and a wait for each barrier are added.
Bytes, dispatches and barriers are those of the command; instructions are the compiler's. For a pass with loops over
splats, LOOPS has the instructions of its loop for one splat and the pixels of a subgroup. With --trained, a fourth time
is that of the thread of project backward whose splat has the most tiles. Emit by splats is taken for one tile a splat: what
its threads wait for the splats with many was not counted.
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
# A round of a loop that waits for memory, cycles: what project backward took on the H200 for castle_p30, 0.58 ms, if one
# thread walked the 6,700 tiles of a splat over the whole picture meanwhile.
ROUND = 171
# About the counts of `darb bench train/trained_400k`, by the areas of its ellipses; largest: tiles of the largest splat.
TRAINED = {"splats": 123e3, "pixels": 1595 * 1064, "intersections": 1.3e6, "largest": 6700}
SUM_CHUNK = 64   # shaders/shared/render_args.h
SLOT_BYTES = 12  # what partial_chunks.comp reads of an intersection that it does not add
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


def scaled(report, work):
    """The report with other counts of splats, pixels and intersections, and bytes in proportion."""
    old, of_splats = report["iteration"], ("project", "compact", "depth sort", "project backward")
    rows = []
    for row in old["passes"]:
        of = "pixels" if row["pass"] == "loss" else "splats" if row["pass"] in of_splats else "intersections"
        rows.append(row | {"bytes": row["bytes"] * work[of] / old[of]})
    return report | {"iteration": old | work | {"passes": rows}}


def largest_splat(name, work, clock, forms):
    """Milliseconds of the thread that has the splat with the most tiles; 0 where a pass has none such."""
    rounds = work.get("largest", 0)
    if name != "project backward":
        return 0
    if forms["sums"] == "chunks" and rounds > SUM_CHUNK:
        rounds = max(SUM_CHUNK, rounds / SUM_CHUNK)
    return rounds * ROUND / (clock * 1e6)


def blend_time(shader, work, gpu):
    """(issue, longest tile) in ms."""
    _, cores, rate, lanes, clock, _ = gpu
    loop = LOOPS[shader][1 if lanes == 64 else 0]
    pairs = work["intersections"] * TOUCHED * WALKED * 4  # splat-blocks of 64 pixels
    issue = pairs * loop / (cores * rate * clock * 1e6)
    tiles = work["pixels"] / TILE_PIXELS
    longest = work["intersections"] / tiles * TOUCHED * WALKED * LONGEST
    return issue, longest * SUBGROUP_SERIAL[shader] * loop * WAIT / (clock * 1e6)


def pass_time(report, work, row, gpu, forms):
    """Milliseconds, and what limits the pass."""
    _, cores, rate, lanes, clock, memory = gpu
    name, backward = row["pass"], forms["backward"]
    moved = row["bytes"]
    if name == "project backward" and forms["sums"] == "chunks":
        moved += work["intersections"] * SLOT_BYTES
    times = {"bytes": moved / (memory * 1e6 * REACHED_BYTES), "largest splat": largest_splat(name, work, clock, forms)}
    if name in ("blend", "blend backward"):
        times["issue"], times["longest tile"] = blend_time(backward if name == "blend backward" else "blend", work, gpu)
    elif name in THREADS:
        shader, of = ("emit_slots", "intersections") if name == "emit" and forms["emit"] == "slots" else THREADS[name]
        threads = work["pixels"] * LOSS_ROWS if of == "strips" else work[of]
        count = instructions(report, shader)
        if count is not None:
            times["issue"] = threads / lanes * count / (cores * rate * clock * 1e6)
    limit = max(times, key=times.get)
    zeroed = name == "blend backward" and backward != "blend_backward_team"
    return times[limit] + zeroed * work["intersections"] * ZEROED_BYTES / (memory * 1e6 * REACHED_BYTES), limit


def estimate(report, gpu, forms):
    """Rows (pass, ms, what limits it), followed by what launches and barriers take."""
    work = report["iteration"]
    rows = [(row["pass"], *pass_time(report, work, row, gpu, forms)) for row in work["passes"]]
    waits = sum(row["dispatches"] * LAUNCH_US + row["barriers"] * BARRIER_US for row in work["passes"]) / 1e3
    return [*rows, ("launches and barriers", waits, "latency")]


def chosen(report):
    """The forms with which the device begins."""
    shaders = {row["shader"] for row in report["passes"]}
    team = "blend_backward_team" in shaders and "llvmpipe" not in report["driver"]
    return {"backward": "blend_backward_team" if team else "blend_backward", "emit": "splats", "sums": "splats"}


def print_estimate(report, names, forms):
    work = report["iteration"]
    print(f"One iteration, {work['splats']:,.0f} visible splats of degree 3, {work['pixels']:,.0f} pixels, "
          f"{work['intersections']:,.0f} intersections, ms (estimate):\n")
    print("| pass | " + " | ".join(GPUS[name][0] for name in names) + " |")
    print("|---" * (len(names) + 1) + "|")
    columns = [estimate(report, GPUS[name], forms) for name in names]
    for cells in zip(*columns):
        print(f"| {cells[0][0]} | " + " | ".join(f"{ms:.2f}, {limit}" for _, ms, limit in cells) + " |")
    print("| all | " + " | ".join(f"{sum(row[1] for row in column):.1f}" for column in columns) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("passes", nargs="?")
    parser.add_argument("--gpu", action="append", choices=sorted(GPUS))
    parser.add_argument("--gpus", action="store_true")
    parser.add_argument("--trained", action="store_true")
    parser.add_argument("--backward", choices=[name for name in LOOPS if name != "blend"])
    parser.add_argument("--emit", choices=("splats", "slots"))
    parser.add_argument("--sums", choices=("splats", "chunks"))
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
        forms = chosen(report) | {name: form for name in ("backward", "emit", "sums") if (form := getattr(flags, name))}
        print_estimate(scaled(report, TRAINED) if flags.trained else report, flags.gpu or list(GPUS), forms)
    except (OSError, ValueError, KeyError) as error:
        print(f"gpu_model.py: {flags.passes}: {error!r}; make it with: darb devices --passes --json FILE", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
