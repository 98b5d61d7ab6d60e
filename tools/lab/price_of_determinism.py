#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What it costs that training repeats bit by bit: gradients of a splat-tile intersection have a slot of their own and are
summed in order. In a copy of the sources (build-atomics) this builds the other way, float atomics into one sum per splat,
trains both in turn on the shipped scene, and prints the milliseconds of the two passes that differ.

    tools/lab/price_of_determinism.py [OUT.json] [ROUNDS]      default 5 rounds of 300 iterations, median of the rounds
    tools/lab/price_of_determinism.py --check                  only whether the changes still fit the sources
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile

from changed_copy import ROOT, built_copy, changed_texts

PASSES = ("blend backward", "project backward")

# file, old text, text with atomics
CHANGES = [
    ("shaders/lib/partials.glsl", "partials0[at] PARTIALS_PUT value;", "atomicAdd(partials0[at], value);"),
    ("shaders/backward/blend_backward_team.comp", "#extension GL_KHR_shader_subgroup_arithmetic : require",
     "#extension GL_KHR_shader_subgroup_arithmetic : require\n#extension GL_EXT_shader_atomic_float : require"),
    ("shaders/backward/blend_backward.comp", "partial_rest[RESTS * slot] += rest;", "atomicAdd(partial_rest[RESTS * slot], rest);"),
    ("shaders/backward/blend_backward.comp", "#extension GL_KHR_shader_subgroup_arithmetic : require",
     "#extension GL_KHR_shader_subgroup_arithmetic : require\n#extension GL_EXT_shader_atomic_float : require"),
    ("shaders/backward/blend_backward.comp", "return intersection_from_sorted[j];",
     "return splat_from_intersection[intersection_from_sorted[j]] & INTERSECTION_SPLAT_MASK;"),
    ("shaders/backward/project_backward.comp", "uint e = first_intersection[i];", "uint e = i;"),
    ("shaders/backward/project_backward.comp", "const uint end = e + intersection_count[i];",
     "const uint end = e + min(intersection_count[i], 1u);"),
    ("engine/raster/backward.cpp", "blend_.reserve(intersections, records);",
     "blend_.reserve(std::max(splats, intersections), records);"),
]


def train(darb, folder):
    subprocess.run([darb, "train", os.path.join(ROOT, "assets/scene"), "-o", folder, "-q", "--eval", "--iterations", "300",
                    "--densify-until-iter", "0", "--test-iterations", "300", "--save-iterations", "300"],
                   check=True, stdout=subprocess.DEVNULL)
    with open(os.path.join(folder, "metrics.json"), encoding="utf-8") as file:
        metrics = json.load(file)
    with open(os.path.join(folder, "point_cloud/iteration_300/point_cloud.ply"), "rb") as file:
        scene = file.read()
    times = {p["name"]: p["ms"] for p in metrics["passes_ms"]}
    return {**{name: times[name] for name in PASSES}, "all passes": sum(times.values())}, scene, metrics


def main():
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(__doc__.strip())
        return 0
    texts = changed_texts("tools/lab/price_of_determinism.py", CHANGES)
    if "--check" in sys.argv[1:]:
        print(f"atomics: {len(texts)} files, the changes fit")
        return 0
    rounds = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    commands = {"deterministic": os.path.join(ROOT, "build/darb"), "atomics": built_copy("build-atomics", texts)}
    times = {name: [] for name in commands}
    scenes = {name: set() for name in commands}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(rounds):
            for name, darb in commands.items():
                ms, scene, metrics = train(darb, os.path.join(folder, name))
                times[name].append(ms)
                scenes[name].add(scene)
    result = {"device": metrics["start"]["device"], "driver": metrics["start"]["driver"],
              "scene": "assets/scene, 200 x 150 px", "iterations": 300, "rounds": rounds}
    for name in commands:
        result[name] = {"ms": {p: round(statistics.median(t[p] for t in times[name]), 3)
                               for p in (*PASSES, "all passes")},
                        "ms_least": {p: round(min(t[p] for t in times[name]), 3) for p in (*PASSES, "all passes")},
                        "different_scenes": len(scenes[name])}
    price = [sum(result[name]["ms"][p] for p in PASSES) for name in commands]
    result["price_ms"] = round(price[0] - price[1], 3)
    result["price_of_an_iteration"] = round((price[0] - price[1]) / result["atomics"]["ms"]["all passes"], 4)
    text = json.dumps(result, indent=2) + "\n"
    print(text, end="")
    if len(sys.argv) > 1:
        with open(sys.argv[1], "w", encoding="utf-8") as file:
            file.write(text)
    return 0 if len(scenes["deterministic"]) == 1 else 1


if __name__ == "__main__":
    sys.exit(main())
