#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""How near surfaces out of splats are to the truth, by kernel and by reading of the depth.

    surface_table.py run OUT [--seeds N] [--scenes NAME...]   makes the generated scenes, and trains, reads and meshes
                                                              each kernel
    surface_table.py show OUT|FILE.json                       prints the tables of the page

A run of OUT/results.json is not made again, so a call that was stopped goes on where it ended. Seeds come last: one seed
of all kernels is there before the next begins. DARB=, MAKE_SCENE= and DEPTH_READINGS= name other programs than those of
build/ (the preset `lab`).
"""

import argparse
import json
import os
import pathlib
import resource
import shutil
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
KERNELS = ["gaussian", "raised_cosine", "half_cosine_squared", "sinc", "inverse_quadratic", "cosine", "squared_raised_cosine",
           "inverse_multiquadric", "parabolic"]
READINGS = ["front", "solid", "line", "plane", "expected"]
# How each scene is made, and its mesh: voxel and thresholds in world units, and the box that the reference has points in.
SCENES = {
    "still_life": {"photos": ["depths", "PHOTOS"], "truth": ["surface", "TRUTH"], "step": 4, "iterations": 400, "voxel": 0.04,
                   "thresholds": [0.028, 0.056], "bounds": "-2.6,-2.6,-0.2,2.6,2.6,3"},
    "town": {"photos": ["town-depths", "PHOTOS", "6", "0.6"], "truth": ["town-surface", "TRUTH", "6"], "step": 2, "iterations": 1600, "voxel": 0.1,
             "thresholds": [0.085, 0.17], "bounds": "-15,-15,-1,15,15,5"},
}


def program(name):
    return os.environ.get(name.upper(), str(ROOT / "build" / name))


def call(*command):
    """The command's output, and the CPU seconds that it took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit(f"surface_table.py: {' '.join(command)} ended with {done.returncode}\n{done.stderr}")
    return done.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def make_scenes(out, scenes):
    for name in scenes:
        scene = SCENES[name]
        for what in ("photos", "truth"):
            folder = out / f"{name}_{what}"
            if folder.exists():
                continue
            part = folder.with_suffix(".part")
            shutil.rmtree(part, ignore_errors=True)
            call(program("make_scene"), *[str(part) if word.isupper() else word for word in scene[what]])
            part.rename(folder)


def measure(out, name, kernel, seed):
    scene, run, photos = SCENES[name], out / "run", out / f"{name}_photos"
    iterations = scene["iterations"]
    shutil.rmtree(run, ignore_errors=True)
    _, training = call(program("darb"), "train", str(photos), "-o", str(run), "--kernel", kernel, "--seed", str(seed),
                       "--iterations", str(iterations), "--eval", "-q")
    metrics = json.loads((run / "metrics.json").read_text())
    splats = run / f"point_cloud/iteration_{iterations}/point_cloud.ply"
    depths, _ = call(program("depth_readings"), str(splats), str(photos), str(scene["step"]))
    _, meshing = call(program("darb"), "mesh", str(run), "-o", str(out / "mesh.ply"), "--voxel", str(scene["voxel"]),
                      "--bounds", scene["bounds"], "--texture", "none", "--reference",
                      str(out / f"{name}_truth/surface.ply"), "--thresholds", ",".join(map(str, scene["thresholds"])),
                      "--json", str(out / "mesh.json"), "-q", "--force")
    return {"scene": name, "kernel": kernel, "seed": seed, "iterations": iterations, "psnr": metrics["evaluations"][-1]["psnr_db"],
            "splats": metrics["splats"], "training_cpu_s": round(training, 1), "meshing_cpu_s": round(meshing, 1),
            "depths": json.loads(depths), "mesh": json.loads((out / "mesh.json").read_text())}


def results_of(out):
    path = out if out.suffix == ".json" else out / "results.json"
    return json.loads(path.read_text()) if path.exists() else []


def run(out, seeds, scenes):
    out.mkdir(parents=True, exist_ok=True)
    make_scenes(out, scenes)
    for seed in range(seeds):
        for kernel in KERNELS:
            for name in scenes:
                results = results_of(out)
                if any((r["scene"], r["kernel"], r["seed"]) == (name, kernel, seed) for r in results):
                    continue
                results.append(measure(out, name, kernel, seed))
                part = out / "results.part"
                part.write_text(json.dumps(results, indent=1) + "\n")
                part.rename(out / "results.json")
                print(name, kernel, seed, flush=True)


def cell(values, digits):
    """Mean, and half of what lies between the least and the largest of the seeds."""
    middle = statistics.mean(values)
    if len(values) == 1:
        return f"{middle:.{digits}f}"
    return f"{middle:.{digits}f} ± {(max(values) - min(values)) / 2:.{digits}f}"


def show(out):
    results = results_of(out)
    for name in SCENES:
        rows = [r for r in results if r["scene"] == name]
        if not rows:
            continue
        print(f"\n{name}: median error of depths in mm (bias of the median), by reading; {len(rows)} runs\n")
        print("| kernel | seeds | " + " | ".join(READINGS) + " |\n|" + "---|" * (len(READINGS) + 2))
        for kernel in KERNELS:
            own = [r for r in rows if r["kernel"] == kernel]
            if own:
                print(f"| {kernel} | {len(own)} | " + " | ".join(
                    cell([1000 * r["depths"][d]["median"] for r in own], 1) +
                    f" ({statistics.mean(1000 * r['depths'][d]['bias'] for r in own):+.1f})" for d in READINGS) + " |")
        print("\n| kernel | accuracy, median mm | completeness, median mm | F, small | F, large | PSNR dB | splats | "
              "CPU s, training | CPU s, mesh |\n|" + "---|" * 9)
        for kernel in KERNELS:
            own = [r for r in rows if r["kernel"] == kernel]
            if not own:
                continue
            comparison = [r["mesh"]["comparison"] for r in own]
            print(f"| {kernel} | " + " | ".join([
                cell([1000 * c["accuracy"]["median"] for c in comparison], 1),
                cell([1000 * c["completeness"]["median"] for c in comparison], 1),
                cell([c["f_scores"][0]["f"] for c in comparison], 3), cell([c["f_scores"][1]["f"] for c in comparison], 3),
                cell([r["psnr"] for r in own], 2), f"{statistics.mean(r['splats'] for r in own):,.0f}",
                cell([r["training_cpu_s"] for r in own], 0), cell([r["meshing_cpu_s"] for r in own], 0)]) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["run", "show"])
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--scenes", nargs="+", choices=list(SCENES), default=list(SCENES))
    arguments = parser.parse_args()
    if arguments.what == "run":
        run(arguments.out, arguments.seeds, arguments.scenes)
    show(arguments.out)


if __name__ == "__main__":
    main()
