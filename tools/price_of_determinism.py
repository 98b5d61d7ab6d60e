#!/usr/bin/env python3
"""What it costs that training repeats bit by bit: gradients of a splat-tile intersection have a slot of their own and are
summed in order. Builds, in a copy of the sources (build-atomics), the other way: float atomics into one sum a splat;
trains both in turn on the shipped scene, and prints the milliseconds of the two passes that differ.

    tools/price_of_determinism.py [OUT.json] [ROUNDS]      default 5 rounds of 300 iterations, median of the rounds
    tools/price_of_determinism.py --check                  only whether the changes still fit the sources
"""

import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
COPY = os.path.join(ROOT, "build-atomics")
PASSES = ("blend backward", "project backward")

# file, text, with atomics
CHANGES = [
    ("shaders/lib/partials.glsl", "partials0[at] PARTIALS_PUT value;", "atomicAdd(partials0[at], value);"),
    ("shaders/backward/blend_backward_team.comp", "#extension GL_KHR_shader_subgroup_arithmetic : require",
     "#extension GL_KHR_shader_subgroup_arithmetic : require\n#extension GL_EXT_shader_atomic_float : require"),
    ("shaders/backward/blend_backward.comp", "partial_rest[slot] += rest;", "atomicAdd(partial_rest[slot], rest);"),
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


def changed_texts():
    """The text of each file with its changes; ends where one does not fit the sources any more."""
    texts = {}
    for path, held, other in CHANGES:
        if path not in texts:
            with open(os.path.join(ROOT, path), encoding="utf-8") as file:
                texts[path] = file.read()
        if texts[path].count(held) != 1:
            sys.exit(f"tools/price_of_determinism.py: {path} holds '{held}' {texts[path].count(held)} times")
        texts[path] = texts[path].replace(held, other)
    return texts


def build_atomics():
    files = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, check=True,
                           capture_output=True, text=True).stdout
    for name in files.splitlines():
        old, new = os.path.join(ROOT, name), os.path.join(COPY, name)
        if os.path.isfile(old):
            os.makedirs(os.path.dirname(new), exist_ok=True)
            shutil.copy2(old, new)
    for path, text in changed_texts().items():
        with open(os.path.join(COPY, path), "w", encoding="utf-8") as file:
            file.write(text)
    os.environ.update(CCACHE_BASEDIR=COPY, CCACHE_NOHASHDIR="1")
    build = os.path.join(COPY, "build")
    for command in (["cmake", "-G", "Ninja", "-S", COPY, "-B", build, "-DCMAKE_BUILD_TYPE=Release"],
                    ["ninja", "-C", build, "darb"]):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return os.path.join(build, "darb")


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
    if "--check" in sys.argv[1:]:
        print(f"atomics: {len(changed_texts())} files, the changes fit")
        return 0
    rounds = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    commands = {"deterministic": os.path.join(ROOT, "build/darb"), "atomics": build_atomics()}
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
