# SPDX-License-Identifier: MIT
"""The valid inputs from which the parts start: data sets of four small photos, written here, and what darb makes of them."""

import gzip
import io
import json
import os
import random
import shutil
import struct
import zipfile

import encode

WIDTH, HEIGHT, FOCAL = 24, 18, 26.0  # px
VIEWS = 4


def photo_name(i):
    return f"view_{i}.{'jpg' if i % 2 else 'png'}"


def write(path, content):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "wb") as file:
        file.write(content if isinstance(content, bytes) else content.encode())


def write_photos(folder, name=photo_name):
    for i in range(VIEWS):
        def pixel(x, y, i=i):
            return ((9 * x + 40 * i) % 256, (11 * y + 90) % 256, (5 * (x + y)) % 256, 255)
        kind = name(i).rsplit(".", 1)[-1]
        picture = encode.png(WIDTH, HEIGHT, pixel) if kind == "png" else \
            encode.jpeg(WIDTH, HEIGHT, pixel, progressive=i == 3)
        write(f"{folder}/{name(i)}", picture)


def write_masks(folder):
    for i in range(VIEWS):
        mask = encode.png(WIDTH, HEIGHT, lambda x, y: [255 if x > 2 else 0], channels=1)
        write(f"{folder}/{os.path.splitext(photo_name(i))[0]}.png", mask)


def points():
    rng = random.Random(5)
    return [([rng.uniform(-1, 1) for _ in range(3)], [rng.randrange(256) for _ in range(3)]) for _ in range(40)]


def colmap_binary(folder, name=photo_name):
    cameras = struct.pack("<QIiQQ4d", 1, 1, 1, WIDTH, HEIGHT, FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2)
    images = struct.pack("<Q", VIEWS)
    for i in range(VIEWS):
        images += struct.pack("<I7dI", i + 1, 1, 0, 0, 0, 0.3 * i - 0.5, 0.1 * i, 4, 1) + name(i).encode() + b"\0"
        images += struct.pack("<Q", 2) + struct.pack("<ddq", 3, 4, 1) + struct.pack("<ddq", 5, 6, -1)
    cloud = struct.pack("<Q", len(points()))
    for k, (at, colour) in enumerate(points()):
        cloud += struct.pack("<Q3d3Bd", k + 1, *at, *colour, 0.5) + struct.pack("<Q", 2)
        cloud += struct.pack("<IIII", 1, 0, 2, 0)
    for file, content in (("cameras", cameras), ("images", images), ("points3D", cloud)):
        write(f"{folder}/{file}.bin", content)


def colmap_text(folder, name=photo_name):
    write(f"{folder}/cameras.txt", "# cameras\n1 OPENCV {} {} {} {} {} {} 0.01 0 0 0\n".format(
        WIDTH, HEIGHT, FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2))
    write(f"{folder}/images.txt", "".join(
        f"{i + 1} 1 0 0 0 {0.3 * i - 0.5} {0.1 * i} 4 1 {name(i)}\n3 4 1 5 6 -1\n" for i in range(VIEWS)))
    write(f"{folder}/points3D.txt", "".join(
        "{} {} {} {} {} {} {} 0.5 1 0 2 0\n".format(k + 1, *at, *colour) for k, (at, colour) in enumerate(points())))


def transforms(folder, name=photo_name, masks=True, with_points=True):
    frames = []
    for i in range(VIEWS):
        frame = {"file_path": f"images/{name(i)}",
                 "transform_matrix": [[1, 0, 0, 0.3 * i - 0.5], [0, 1, 0, 0.1 * i], [0, 0, 1, 4], [0, 0, 0, 1]]}
        if masks:
            frame["mask_path"] = f"masks/{os.path.splitext(photo_name(i))[0]}.png"
        frames.append(frame)
    document = {"w": WIDTH, "h": HEIGHT, "fl_x": FOCAL, "fl_y": FOCAL, "cx": WIDTH / 2, "cy": HEIGHT / 2, "k1": 0.01,
                "test_filenames": [f"images/{name(0)}"], "frames": frames}
    if with_points:
        document["ply_file_path"] = "points.ply"
        header = [f"property float {axis}" for axis in "xyz"] + [f"property uchar {c}" for c in ("red", "green", "blue")]
        rows = ["{} {} {} {} {} {}".format(*at, *colour) for at, colour in points()]
        write(f"{folder}/points.ply", "\n".join(
            ["ply", "format ascii 1.0", f"element vertex {len(rows)}", *header, "end_header", *rows, ""]))
    write(f"{folder}/transforms.json", json.dumps(document, indent=1))


def old_spz(version):
    """Versions 1 to 3: 16 bytes of header, the attributes of five splats of degree 0, in gzip."""
    count = 5
    stride = (6 if version == 1 else 9) + 1 + 3 + 3 + (3 if version < 3 else 4)
    body = b"NGSP" + struct.pack("<II4B", version, count, 0, 12, 0, 0)
    body += bytes((40 + 7 * i) % 120 for i in range(count * stride))
    return gzip.compress(body, mtime=0)


def sog():
    count, book = 6, [-3 + 0.5 * k for k in range(16)]

    def picture(scale, limit=256):
        return encode.webp(3, 2, lambda x, y: [(x * 37 + y * 11 + c * 5) * scale % limit for c in range(3)])
    meta = {"version": 2, "count": count, "means": {"mins": [-1, 0, 0], "maxs": [1, 2, 4], "files": ["l", "u"]},
            "scales": {"codebook": book, "files": ["s"]}, "quats": {"files": ["q"]},
            "sh0": {"codebook": book, "files": ["c"]}}
    archive = io.BytesIO()
    # quats: alpha 255 means that the last component is the largest
    files = {"meta.json": json.dumps(meta).encode(), "l": picture(3), "u": picture(7), "s": picture(1, 16),
             "q": picture(5), "c": picture(1, 16)}
    with zipfile.ZipFile(archive, "w") as zip_file:
        for name, content in files.items():
            zip_file.writestr(zipfile.ZipInfo(name), content)
    return archive.getvalue()


def ksplat():
    """Version 0.1, level 0, degree 0: a section of three splats."""
    count, data = 3, b""
    for i in range(count):
        data += struct.pack("<10f4B", 0.3 * i, -0.2 * i, 1 + 0.1 * i, 0.1, 0.2, 0.3, 1, 0.5 * i, 0, 0, 200, 90 * i, 30, 250)
    head = bytearray(4096 + 1024)
    head[1] = 1
    struct.pack_into("<4I", head, 4, 1, 1, count, count)
    struct.pack_into("<3I", head, 4096, count, count, 1)
    return bytes(head) + data


def safetensors():
    header = json.dumps({"features.0.weight": {"dtype": "F32", "shape": [2, 3], "data_offsets": [0, 24]},
                         "lin0.model.1.weight": {"dtype": "F16", "shape": [4], "data_offsets": [24, 32]}}).encode()
    return struct.pack("<Q", len(header)) + header + struct.pack("<6f", *range(6)) + b"\0\x3c" * 4


def camera_path():
    keys = [{"seconds": 0.04 * i, "eye": [0.2 * i, 0, -4], "orientation": [1, 0, 0.05 * i, 0], "fov_y_degrees": 50}
            for i in range(3)]
    return json.dumps({"key_frames": keys}, indent=1)


TRAIN = ["--iterations", "6", "--checkpoint-interval", "2", "--densify-from-iter", "1", "--densification-interval",
         "2", "--test-iterations", "3", "6", "-q"]


def make_half(folder, run):
    """A run as a kill after its fourth iteration leaves it, from which --resume goes on."""
    run(["train", "colmap", "-o", "half", *TRAIN, "--checkpoint-iterations", "4"])
    os.replace(f"{folder}/half/chkpnt4.darb", f"{folder}/half/checkpoint.darb")
    shutil.rmtree(f"{folder}/half/point_cloud")
    for name in ("metrics.json", "report.html"):
        os.remove(f"{folder}/half/{name}")


def make(folder, run):
    """Makes all of them in `folder`; run(arguments) runs darb there and must succeed."""
    for name in ("colmap", "text", "frames", "bare"):
        write_photos(f"{folder}/{name}/images")
        write_masks(f"{folder}/{name}/masks")
    colmap_binary(f"{folder}/colmap/sparse/0")
    colmap_text(f"{folder}/text/sparse/0")
    transforms(f"{folder}/frames")
    transforms(f"{folder}/bare", with_points=False)
    for version in (1, 2, 3):
        write(f"{folder}/scenes/version_{version}.spz", old_spz(version))
    write(f"{folder}/scenes/scene.sog", sog())
    write(f"{folder}/scenes/scene.ksplat", ksplat())
    write(f"{folder}/path.json", camera_path())
    write(f"{folder}/weights.safetensors", safetensors())
    run(["train", "colmap", "-o", "run", *TRAIN])
    make_half(folder, run)
    scene = f"{folder}/run/point_cloud/iteration_6/point_cloud.ply"
    with open(scene, "rb") as file:
        write(f"{folder}/scenes/scene.ply", file.read())
    for name in ("scene.compressed.ply", "scene.splat", "scene.spz", "scene.glb", "gltf.gltf", "lod/lod-meta.json"):
        run(["convert", "scenes/scene.ply", f"scenes/{name}"])
    with open(f"{folder}/run/cameras.json", "rb") as file:
        write(f"{folder}/cameras.json", file.read())
    run(["compare", "colmap", "-o", "compared", "--kernels", "gaussian", "--iterations", "4", "-q",
         "--blending-views", "0"])
