# SPDX-License-Identifier: MIT
"""Part 1: every kind of input file, damaged, into the commands that read it."""

import filecmp
import os

import mutate

WEIGHT = 5  # share of the day

SCENE = ["info {f}", "info {f} --json out/facts.json", "convert {f} out/a.ply", "convert {f} out/a.splat",
         "convert {f} out/a.compressed.ply", "convert {f} out/a.spz", "convert {f} out/a.glb", "convert {f} out/a.sog",
         "convert {f} out/lod/lod-meta.json", "convert {f} out/a.ply --up x --crop -1,-1,-1,1,1,1"]
DRAWN = ["render {f} --cameras in/cameras.json -o out", "view {f} --screenshot out/s.png --size 64x48", "plan {f} --no-price"]
SET = ["info {d}", "info {d} --json out/facts.json", "plan {d} --no-price"]
TRAINED = ["train {d} -o out/run --iterations 2 -q", "eval in/run {d} --split all", "render in/run --cameras {d} -o out"]
RUN = ["info in/run", "train --resume -o in/run -q", "train in/colmap --resume -o in/run -q --iterations 8",
       "plan in/run --no-price"]
DATA = ["colmap", "run", "cameras.json"]

# kind: samples to bring, files to damage, quick commands, slow ones, whether a checksum covers it all
KINDS = {
    "ply": (["cameras.json"], ["scenes/scene.ply"], SCENE, DRAWN, False),
    "compressed PLY": (["cameras.json"], ["scenes/scene.compressed.ply"], SCENE, DRAWN, False),
    "splat": (["cameras.json"], ["scenes/scene.splat"], SCENE, DRAWN, False),
    "SPZ": (["cameras.json"], [f"scenes/{n}.spz" for n in ("scene", "version_1", "version_2", "version_3")], SCENE, DRAWN,
            True),
    "SOG": (["cameras.json"], ["scenes/scene.sog"], SCENE, DRAWN, True),
    "glTF": (["cameras.json", "scenes/gltf.bin"], ["scenes/scene.glb", "scenes/gltf.gltf"], SCENE, DRAWN, False),
    "streamed SOG": (["cameras.json", "scenes/lod"], ["scenes/lod/lod-meta.json"], SCENE, DRAWN, False),
    "ksplat": (["cameras.json"], ["scenes/scene.ksplat"], SCENE, DRAWN, False),
    "COLMAP binary": (DATA, [f"colmap/sparse/0/{n}.bin" for n in ("cameras", "images", "points3D")], SET, TRAINED, False),
    "COLMAP text": (DATA + ["text"], [f"text/sparse/0/{n}.txt" for n in ("cameras", "images", "points3D")], SET, TRAINED,
                    False),
    "transforms": (DATA + ["frames"], ["frames/transforms.json"], SET, TRAINED, False),
    "points": (DATA + ["frames"], ["frames/points.ply"], SET, TRAINED, False),
    "cameras": (DATA, ["cameras.json"], ["info {f}"], ["render in/run --cameras {f} -o out", "convert in/run out/a.ply "
                                                      "--compare --cameras {f}"], False),
    "PNG": (DATA, ["colmap/images/view_0.png", "colmap/images/view_2.png"], SET, TRAINED, True),
    "JPEG": (DATA, ["colmap/images/view_1.jpg", "colmap/images/view_3.jpg"], SET, TRAINED, False),
    "mask": (DATA, ["colmap/masks/view_0.png", "colmap/masks/view_1.png"], SET, TRAINED, True),
    "checkpoint": (DATA, ["run/checkpoint.darb"], ["info in/run"],
                   ["train in/colmap --resume -o in/run -q", "train in/colmap --start-checkpoint {f} -o out/run -q"], True),
    "metrics": (DATA, ["run/metrics.json"], RUN[:1], RUN, False),
    "log": (DATA, ["run/run.jsonl"], RUN[:1], RUN, False),
    "request": (DATA, ["run/request.json"], RUN[:1], RUN[1:2], False),
    "cfg_args": (DATA, ["run/cfg_args"], RUN[:1], RUN + ["eval in/run in/colmap", "view in/run --screenshot out/s.png "
                                                        "--size 64x48"], False),
    "run's cameras": (DATA, ["run/cameras.json"], ["info in/run"], RUN[1:] + ["view in/run --screenshot out/s.png "
                                                                             "--size 64x48"], False),
    "camera path": (DATA + ["path.json"], ["path.json"], ["view in/run --path {f} --export out --size 16x16"], [], False),
    "comparison": (["colmap", "compared"], [f"compared/colmap/gaussian/seed0/{n}" for n in
                                            ("metrics.json", "run.jsonl", "checkpoint.darb", "cfg_args")] +
                   ["compared/compare.json"],
                   ["compare in/colmap -o in/compared --kernels gaussian --iterations 4 -q --blending-views 0"], [], False),
    "weights": (["colmap", "compared", "weights.safetensors"], ["weights.safetensors"],
                ["compare in/colmap -o in/compared --kernels gaussian --iterations 4 -q --lpips {f}"], [], False),
}
FORMAT_OF = {".json": mutate.damage_json, ".gltf": mutate.damage_json, ".jsonl": mutate.damage_json, ".txt": mutate.damage_text}


def data_folder(file):
    return next((name for name in ("colmap", "text", "frames") if file.startswith(name + "/")), "colmap")


def damage(case, file):
    """The damaged bytes of the sample; where there is a checksum, mostly one flipped bit."""
    with open(os.path.join(case.day.samples, file), "rb") as handle:
        data = handle.read()
    extension = os.path.splitext(file)[1]
    if case.random.random() < 0.15:
        return mutate.truncate(data, case.random)
    if extension in FORMAT_OF and case.random.random() < 0.75:
        return FORMAT_OF[extension](data, case.random)
    if extension == ".ply" and case.random.random() < 0.3:
        head, mark, body = data.partition(b"end_header\n")
        head, done = mutate.damage_text(head, case.random)
        return head + mark + body, done
    return mutate.damage_bytes(data, case.random, other=data[::-1])


def one(case):
    names = list(KINDS)
    kind = case.random.choice(names)
    samples, files, quick, slow, checksummed = KINDS[kind]
    file = case.random.choice(files)
    for sample in dict.fromkeys([*samples, file]):
        if not os.path.lexists(case.path("in", sample)):
            case.take(sample, f"in/{sample}")
    by_bit = checksummed and case.random.random() < 0.4
    data = case.read(f"in/{file}")
    data, done = mutate.flip_bit(data, case.random) if by_bit else damage(case, file)
    case.write(f"in/{file}", data)
    case.add_foreign()
    folder = f"in/{data_folder(file)}"
    choose_slow = slow and (not quick or case.random.random() < 0.4)
    command = case.random.choice(slow if choose_slow else quick)
    case.what = f"{kind}: {file}, {done}"
    names = [file, os.path.basename(folder), os.path.splitext(os.path.basename(file))[0], "in/run"]
    if "-o in/" in command:
        case.owned |= {"in/run", "in/compared"}
    case.guard()
    arguments = [word.format(f=f"in/{file}", d=folder) for word in command.split(" ")]
    if by_bit and kind in ("SPZ", "SOG"):
        arguments = ["convert", f"in/{file}", "out/a.ply"]
    result = case.run(arguments, names=names)
    outputs = [f"out/{name}" for name in os.listdir(case.path("out"))]
    case.check_kept(outputs)
    if by_bit and kind in ("SPZ", "SOG") and result.code == 0:
        check_same_splats(case, file)


def check_same_splats(case, file):
    """A flipped bit under a checksum must be refused or have no effect."""
    case.take(file, f"whole/{os.path.basename(file)}")
    case.run(["convert", f"whole/{os.path.basename(file)}", "whole/a.ply"])
    if not filecmp.cmp(case.path("whole/a.ply"), case.path("out/a.ply"), shallow=False):
        case.problem("damage accepted", f"{case.what}: other splats, exit code 0")
