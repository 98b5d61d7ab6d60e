#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Hashes of what short training runs, pictures and converted files produce. A change that only moves code keeps them all.

    safety_net.py record FILE [--darb PATH] [--quick] [--only TEXT]
    safety_net.py compare FILE [--darb PATH] [--quick] [--only TEXT]

record   runs every case with the command and writes the hashes and the device to FILE.
compare  runs them again and names each case and file that differs; exit code 1 where one does.
--darb   the command to run; default: build/darb of this checkout.
--quick  a third of the runs, and the pictures and files that come from them: about a minute.
--only   cases whose names contain TEXT, and those that they need.

The hashes hold for one machine, driver and set of device settings: record them there, before the first change.
All cases train on the shipped scene at 100 px, so nothing outside the checkout is needed.
"""

import argparse
import concurrent.futures
import hashlib
import json
import pathlib
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENE = ROOT / "assets" / "scene"
TRAIN = ["--eval", "--no-report", "-q"]
USUAL = {"-r": "100", "--tune": "backward=subgroup"}  # options of a run that does not say otherwise
KERNELS = ["gaussian", "raised_cosine", "half_cosine_squared", "sinc", "inverse_quadratic"]

# name: options. Each leaves a PLY and the held-out pictures. A checkpoint holds seconds, so resumed runs show what it
# keeps.
RUNS = {f"{kernel}_{footprint}": ["--kernel", kernel, "--footprint", footprint, "--iterations", "160"]
        for kernel in KERNELS for footprint in ("psi", "exact")}
RUNS |= {
    "mcmc": ["--strategy", "mcmc", "--max-splats", "5000", "--iterations", "200"],
    "mcmc_sinc": ["--strategy", "mcmc", "--max-splats", "4500", "--kernel", "sinc", "--iterations", "200"],
    "budget": ["--strategy", "budget", "--max-splats", "5000", "--iterations", "400"],
    "antialias": ["--effects", "+antialias", "--iterations", "200"],
    "exposure": ["--effects", "+exposure", "--iterations", "120"],
    "exposure_grid": ["--exposure-grid", "--iterations", "120"],
    "colour": ["--effects", "+sh", "--sh-degree", "3", "--iterations", "1000", "-r", "50"],
    "probe": ["--sh-degree", "1", "--iterations", "500", "-r", "50"],
    "3dgs": ["--schedule", "3dgs", "--iterations", "700", "-r", "50"],
    "rings": ["--kernel", "raised_cosine", "--pulses", "2", "--morton-order", "--iterations", "160"],
    "buckets": ["--tune", "backward=buckets", "--iterations", "160"],
    "limits": ["--max-splats", "4200", "--white-background", "--fixed-background", "--clearance", "0",
               "--largest-scale", "0.5", "--resolution-ramp", "off", "--iterations", "160"],
    "random_start": ["--random-points", "2000", "--iterations", "160", "--average-from", "1"],
    "every_effect": ["--effects", "all", "--seed", "3", "--iterations", "160"],
}
RESUMED = {"resumed": ("gaussian_psi", "80"), "resumed_mcmc": ("mcmc", "100"), "resumed_budget": ("budget", "150")}

# name: (the run whose scene it draws, options). Each leaves three pictures.
PICTURES = {f"draw_{run}": (run, []) for run in RUNS if run != "buckets"}
PICTURES |= {f"draw_accuracy_{choice}": ("gaussian_psi", ["--accuracy", choice]) for choice in ("fast", "exact")}
PICTURES |= {
    "draw_builtin": ("sinc_psi", ["--evaluation", "builtin"]),
    "draw_polynomial2": ("raised_cosine_psi", ["--evaluation", "polynomial2"]),
    "draw_pixel_order": ("raised_cosine_exact", ["--depth-order", "pixel"]),
    "draw_half": ("budget", ["--storage", "float16", "--render-scale", "1/2"]),
    "draw_depth": ("gaussian_psi", ["--depth", "png", "--white-background"]),
    "draw_depth_npy": ("inverse_quadratic_exact", ["--depth", "npy", "--near", "1.5"]),
    "draw_no_colour": ("colour", ["--sh-degree", "1"]),
    "draw_effects_none": ("antialias", ["--effects", "none"]),
}

# name: (run, ending, options)
FILES = {f"file_{run}_{ending}": (run, ending, [])
         for run in ("colour", "raised_cosine_psi", "mcmc")
         for ending in ("ply", "compressed.ply", "splat", "spz")}
FILES |= {
    "file_gaussians": ("sinc_psi", "ply", ["--kernel", "gaussian"]),
    "file_gaussians_exact": ("half_cosine_squared_exact", "spz", ["--kernel", "gaussian"]),
    "file_turned": ("colour", "ply", ["--rotate", "10,20,30", "--scale", "2", "--translate", "1,2,3"]),
    "file_up": ("colour", "splat", ["--up", "z"]),
    "file_cropped": ("gaussian_psi", "ply", ["--crop", "-1,-1,-1,1,1,1"]),
    "file_pruned": ("gaussian_psi", "ply", ["--prune-opacity", "0.2"]),
    "file_degree": ("colour", "compressed.ply", ["--max-sh", "1"]),
    "file_rings": ("rings", "ply", ["--max-sh", "0"]),
}
QUICK = {"gaussian_psi", "raised_cosine_exact", "mcmc", "budget", "antialias", "3dgs", "resumed"}


def run(darb, arguments):
    command = [str(darb), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}\nexit code {done.returncode}\n{done.stderr.strip()[-2000:]}")


def train_options(name):
    given = RUNS[name]
    return TRAIN + given + [word for option, value in USUAL.items() if option not in given for word in (option, value)]


def hashes(folder, endings):
    return {str(file.relative_to(folder)): hashlib.sha256(file.read_bytes()).hexdigest()[:16]
            for file in sorted(folder.rglob("*")) if file.is_file() and file.name.endswith(endings)}


class Net:
    def __init__(self, darb, folder):
        self.darb, self.folder = darb, folder

    def train(self, name):
        out = self.folder / name
        run(self.darb, ["train", SCENE, "-o", out, *train_options(name)])
        return hashes(out, (".ply", ".png"))

    def resume(self, name):
        source, at = RESUMED[name]
        out = self.folder / name
        first = self.folder / f"{name}_first"
        run(self.darb, ["train", SCENE, "-o", first, *train_options(source), "--checkpoint-iterations", at])
        start = next(first.rglob(f"*{at}*.darb"))
        run(self.darb, ["train", SCENE, "-o", out, *train_options(source), "--start-checkpoint", start])
        found = hashes(out, (".ply",))
        straight = hashes(self.folder / source, (".ply",))
        if found.items() - straight.items():
            raise RuntimeError(f"{name}: a resumed run differs from {source}")
        return found

    def draw(self, name):
        source, options = PICTURES[name]
        out = self.folder / name
        run(self.darb, ["render", self.folder / source, "--cameras", SCENE / "transforms_test.json", "-o", out,
                        "-r", "100", *options])
        return hashes(out, (".png", ".npy"))

    def convert(self, name):
        source, ending, options = FILES[name]
        out = self.folder / name
        out.mkdir()
        run(self.darb, ["convert", "--force", self.folder / source, out / f"scene.{ending}", *options])
        return hashes(out, (ending,))


def stages(net, quick, only):
    """The cases to run, as stages that need those before them: [(function, names)]."""
    wanted = lambda name, source: (source in QUICK or not quick) and (only in name or only in source)
    runs = [n for n in RUNS if (n in QUICK or not quick) and only in n]
    resumed = [n for n in RESUMED if (n in QUICK or not quick) and only in n]
    pictures = [n for n, (source, _) in PICTURES.items() if wanted(n, source)]
    files = [n for n, (source, _, _) in FILES.items() if wanted(n, source)]
    sources = {RESUMED[n][0] for n in resumed} | {PICTURES[n][0] for n in pictures} | {FILES[n][0] for n in files}
    runs += sorted(sources - set(runs))
    return [(net.train, runs), (net.resume, resumed), (net.draw, pictures), (net.convert, files)]


def device_line(darb):
    done = subprocess.run([str(darb), "devices"], capture_output=True, text=True, check=False)
    wanted = ("chosen", "driver")
    return [line.strip() for line in done.stdout.splitlines() if line.strip().startswith(wanted)]


def measure(darb, quick, only):
    found, failed = {}, []
    with tempfile.TemporaryDirectory(prefix="safety_net_") as folder:
        net = Net(darb, pathlib.Path(folder))
        for function, names in stages(net, quick, only):
            begun = time.monotonic()
            with concurrent.futures.ThreadPoolExecutor(2) as pool:
                for name, future in [(name, pool.submit(function, name)) for name in names]:
                    try:
                        found[name] = future.result()
                    except (RuntimeError, StopIteration) as error:
                        failed.append(name)
                        print(f"{name}: {error}", file=sys.stderr)
            print(f"{function.__name__}: {len(names)} cases, {time.monotonic() - begun:.0f} s", flush=True)
    return found, failed


def compare(before, after):
    """Prints what differs and returns the number of cases that do."""
    differing = 0
    for name in sorted(after):
        if name not in before:
            print(f"{name}: not in the record")
            continue
        files = [file for file in sorted(before[name].keys() | after[name].keys())
                 if before[name].get(file) != after[name].get(file)]
        if files:
            differing += 1
            print(f"{name}: {len(files)} of {len(before[name])} files differ: {', '.join(files[:4])}")
    return differing


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=("record", "compare"))
    parser.add_argument("file", type=pathlib.Path)
    parser.add_argument("--darb", type=pathlib.Path, default=ROOT / "build" / "darb")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    if not options.darb.is_file():
        parser.error(f"{options.darb}: no such command; build it, or name one with --darb")
    device = device_line(options.darb)
    record = {}
    if options.action == "compare":
        try:
            record = json.loads(options.file.read_text())
        except (OSError, ValueError) as error:
            parser.error(f"{options.file}: {error}")
        if record.get("device") != device:
            print(f"another device or driver than the record's: {record.get('device')}, now {device}", file=sys.stderr)
    found, failed = measure(options.darb, options.quick, options.only)
    files = sum(map(len, found.values()))
    if options.action == "record":
        options.file.write_text(json.dumps({"device": device, "cases": found}, indent=1) + "\n")
        print(f"recorded {len(found)} cases, {files} files; {len(failed)} failed")
        return 1 if failed else 0
    differing = compare(record["cases"], found)
    print(f"{len(found)} cases, {files} files: {differing} cases differ, {len(failed)} failed")
    return 1 if failed or differing else 0


if __name__ == "__main__":
    sys.exit(main())
