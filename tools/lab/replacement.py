#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What another kernel makes of splats that were trained as Gaussians: dB against the original's own pictures, and time.

    replacement.py run OUT FILE...      draws each scene from six sides, replaces its kernel, and measures
    replacement.py show [FILE.json]     prints the tables of the page

Each kernel comes twice: with the scene's covariances and opacities as they are (psi included), and with those that make
its splat the nearest to the Gaussian, which is what `darb convert --kernel gaussian` does the other way round. Results
go to assets/results/replacement_lavapipe.json; a row that is there is not measured again. DARB= names another program.
"""

import array
import json
import math
import os
import pathlib
import re
import resource
import subprocess
import sys

import results  # beside this file

ROOT = pathlib.Path(__file__).resolve().parents[2]
FIGURES = ROOT / "assets/results/replacement_lavapipe.json"
DARB = os.environ.get("DARB", str(ROOT / "build/darb"))
KERNELS = ["gaussian", "raised_cosine", "half_cosine_squared", "sinc", "inverse_quadratic", "cosine", "squared_raised_cosine",
           "inverse_multiquadric", "parabolic"]
CAMERAS, WIDTH, HEIGHT = 6, 640, 480
MOST_OPAQUE = 0.999
MORE = 3  # renderings of the six against one: what these take more is the time of the frames alone


def call(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"replacement.py: {' '.join(map(str, command))} ended with {done.returncode}\n{done.stderr}")
    return done.stdout + done.stderr


class Ply:
    """A PLY file of splats as darb writes it: a header, and float32 rows."""

    def __init__(self, path):
        data = pathlib.Path(path).read_bytes()
        end = data.index(b"end_header\n") + len(b"end_header\n")
        self.header = data[:end].decode()
        self.names = re.findall(r"^property float (\S+)$", self.header, re.MULTILINE)
        self.values = array.array("f")
        self.values.frombytes(data[end:])

    def column(self, name):
        return self.values[self.names.index(name)::len(self.names)]

    def set_column(self, name, column):
        self.values[self.names.index(name)::len(self.names)] = array.array("f", column)

    def write(self, path, kernel):
        header = re.sub(r"^comment SplatKernel: \S+$", f"comment SplatKernel: {kernel}", self.header, flags=re.MULTILINE)
        header = re.sub(r"^comment SplatFootprint: \S+$", "comment SplatFootprint: psi", header, flags=re.MULTILINE)
        pathlib.Path(path).write_bytes(header.encode() + self.values.tobytes())


def replaced(ply_path, kernel, factors):
    """The splats with covariances divided by the first factor, and opacities by the second."""
    covariance, opacity = factors
    ply = Ply(ply_path)
    for axis in range(3):
        ply.set_column(f"scale_{axis}", [s - 0.5 * math.log(covariance) for s in ply.column(f"scale_{axis}")])
    logits = []
    for logit in ply.column("opacity"):
        o = min(1 / (1 + math.exp(-logit)) / opacity, MOST_OPAQUE)
        logits.append(math.log(o / (1 - o)) if o > 0 else -50.0)
    ply.set_column("opacity", logits)
    target = ply_path.with_name(f"{kernel}_nearest.ply")
    ply.write(target, kernel)
    return target


def write_cameras(ply, folder):
    """Six cameras around the vertical axis, 20 degrees above and below in turn, that see nine tenths of the centres."""
    axes = [sorted(ply.column(name)) for name in "xyz"]
    centre = [axis[len(axis) // 2] for axis in axes]
    distances = sorted(math.dist(p, centre) for p in zip(*(ply.column(name) for name in "xyz")))
    away = 2.4 * distances[9 * len(distances) // 10]
    frames = []
    for i in range(CAMERAS):
        turn, tilt = 2 * math.pi * i / CAMERAS, math.radians(20 if i % 2 else -20)
        back = [math.cos(tilt) * math.sin(turn), math.sin(tilt), math.cos(tilt) * math.cos(turn)]
        right = [math.cos(turn), 0.0, -math.sin(turn)]
        up = [back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2],
              back[0] * right[1] - back[1] * right[0]]
        rows = [[right[k], up[k], back[k], centre[k] + away * back[k]] for k in range(3)]
        frames.append({"file_path": f"side_{i}.png", "transform_matrix": rows + [[0, 0, 0, 1]]})
    folder.mkdir(parents=True, exist_ok=True)
    cameras = {"w": WIDTH, "h": HEIGHT, "fl_x": WIDTH, "fl_y": WIDTH, "cx": WIDTH / 2, "cy": HEIGHT / 2, "frames": frames}
    (folder / "transforms.json").write_text(json.dumps(cameras))


def factors_of(ply_path, kernel):
    """How much wider and more opaque than the kernel's splat its nearest Gaussian is."""
    if kernel == "gaussian":
        return 1.0, 1.0
    said = call(DARB, "convert", ply_path, ply_path.with_name("unused.ply"), "--kernel", "gaussian", "--no-measure", "--force")
    return tuple(float(v) for v in re.search(r"covariance x ([\d.]+), opacity x ([\d.]+)", said).groups())


def quality(scene, dataset):
    """dB and SSIM of the scene's pictures against those of the original."""
    figures = dataset.parent / "eval.json"
    call(DARB, "eval", scene, dataset, "--split", "all", "--effects", "none", "--json", figures, "-q")
    mean = json.loads(figures.read_text())["mean"]
    return {"psnr_db": round(mean["psnr_db"], 2), "ssim": round(mean["ssim"], 4)}


def frame_time(scene, dataset):
    """CPU ms of a frame: what more of them take, so that start and files do not count."""
    few, many = (cpu_seconds(scene, dataset.parent / f"times_{n}.json", dataset, n) for n in (1, MORE))
    return {"cpu_ms": round(1000 * (many - few) / (CAMERAS * (MORE - 1)), 1)}


def cpu_seconds(scene, cameras, dataset, times):
    """What drawing the six pictures that many times takes of all cores, start and files included."""
    known = json.loads((dataset / "transforms.json").read_text())
    known["frames"] = [f | {"file_path": f"{k}_{f['file_path']}"} for k in range(times) for f in known["frames"]]
    cameras.write_text(json.dumps(known))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    call(DARB, "render", scene, "--cameras", cameras, "-o", dataset.parent / "frames", "--effects", "none", "--force")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def prepare(folder, file):
    """The scene as a PLY, and a data set of its pictures."""
    dataset, original = folder / "set", folder / "gaussian.ply"
    folder.mkdir(parents=True, exist_ok=True)
    call(DARB, "convert", file, original, "--no-measure", "--force")
    write_cameras(Ply(original), dataset)
    for old in dataset.glob("*.png"):
        old.unlink()
    call(DARB, "render", original, "--cameras", dataset / "transforms.json", "-o", dataset, "--effects", "none", "--force")


def scenes_of(folder, kernel):
    """How the kernel takes the splats over, and the factors of covariance and opacity."""
    as_they_are = folder / "as_they_are.ply"
    Ply(folder / "gaussian.ply").write(as_they_are, kernel)
    yield "as they are", as_they_are, None
    if kernel != "gaussian":
        factors = factors_of(as_they_are, kernel)
        yield "nearest", replaced(folder / "gaussian.ply", kernel, factors), factors


def run(out, files):
    figures = json.loads(FIGURES.read_text()) if FIGURES.exists() else {"rows": []}
    rows = {(r["file"], r["kernel"], r["splats_are"]): r for r in figures["rows"]}
    for measured, measure in (("psnr_db", quality), ("cpu_ms", frame_time)):
        for file in map(pathlib.Path, files):
            folder = out / file.name
            if not (folder / "set" / f"side_{CAMERAS - 1}.png").exists():
                prepare(folder, file)
            for kernel in KERNELS:
                for how, scene, factors in scenes_of(folder, kernel):
                    row = rows.setdefault((file.name, kernel, how), {"file": file.name, "kernel": kernel, "splats_are": how})
                    if measured in row:
                        continue
                    row |= {"covariance": factors[0], "opacity": factors[1]} if factors else {}
                    row |= measure(scene, folder / "set")
                    results.write(FIGURES, figures | {"rows": list(rows.values())})
                    print(row, flush=True)


def show(path):
    rows = json.loads(path.read_text())["rows"]
    files = list(dict.fromkeys(r["file"] for r in rows))
    cell = {(r["file"], r["kernel"], r["splats_are"]): r for r in rows}
    for name, form in (("psnr_db", "{:.1f}"), ("cpu_ms", "{:.0f}")):
        print(f"\n{name}: nearest, and in brackets as they are.\n\n| kernel | " + " | ".join(files) + " |\n|---|" + "---|" * len(files))
        for kernel in KERNELS:
            texts = []
            for file in files:
                near, same = (cell.get((file, kernel, how), {}).get(name) for how in ("nearest", "as they are"))
                known = [form.format(v) if v is not None else "" for v in (near, same)]
                texts.append(f"{known[0]} ({known[1]})".strip() if known[1] else "-")
            print(f"| {kernel} | " + " | ".join(texts) + " |")


def main():
    words = sys.argv[1:]
    if words[:1] == ["run"] and len(words) > 2:
        run(pathlib.Path(words[1]), words[2:])
    elif words[:1] == ["show"] and len(words) < 3:
        show(pathlib.Path(words[1]) if len(words) == 2 else FIGURES)
    elif words and words[0] in ("-h", "--help"):
        print(__doc__.strip())
    else:
        sys.exit(__doc__.strip())


if __name__ == "__main__":
    main()
