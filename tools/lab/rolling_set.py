#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Makes a data set whose photos have a rolling shutter, from pictures of a scene of splats. Each row is drawn as a
picture of its own, one pixel high, by the pose that the camera has at that moment: nothing of the effect is used.
Every --hold-out-th photo is still and is set aside, so that it judges the scene alone.

    PYTHONPATH=build/python tools/lab/rolling_set.py SCENE CAMERAS.json OUT [--degrees 1] [--say read|none]
"""
from __future__ import annotations

import argparse
import json
import pathlib

try:
    import darb
    import numpy as np
except ImportError:
    darb = np = None

OPENGL = np and np.diag([1.0, -1.0, -1.0])
SECONDS = 0.02  # of a read-out


def rotation_about(vector: np.ndarray) -> np.ndarray:
    angle = np.linalg.norm(vector)
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = vector / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def row_views(world_to_camera: np.ndarray, centre: np.ndarray, turn: np.ndarray, move: np.ndarray, height: int):
    """turn and move: of the camera over the read-out, along its own axes at the middle row."""
    views = np.tile(np.eye(4), (height, 1, 1))
    for y in range(height):
        time = (y + 0.5) / height - 0.5
        rotation = rotation_about(-time * turn) @ world_to_camera
        views[y, :3, :3] = rotation
        views[y, :3, 3] = -rotation @ (centre + time * world_to_camera.T @ move)
    return views


def write_points(scene: darb.Scene, path: pathlib.Path, random: np.random.Generator, most: int = 2000) -> None:
    """Some centres of splats, in grey, as a run's start."""
    places = np.asarray(scene.means)
    some = places[random.permutation(len(places))[:most]]
    header = ("ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
              "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n")
    lines = [f"{x:.5f} {y:.5f} {z:.5f} 128 128 128\n" for x, y, z in some]
    path.write_text(header.format(len(some)) + "".join(lines))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene"), parser.add_argument("cameras"), parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--degrees", type=float, default=1, help="deviation of a read-out's turn about each axis")
    parser.add_argument("--move", type=float, default=0.01, help="deviation of its move, as a share of the distance")
    parser.add_argument("--hold-out", type=int, default=8)
    parser.add_argument("--say", choices=["read", "none"], default="read", help="whether transforms.json has the motion")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    if np is None:
        parser.error("numpy or the module darb is missing: build it, and set PYTHONPATH=build/python")
    random = np.random.default_rng(args.seed)
    scene = darb.Scene.read(args.scene)
    cameras = json.load(open(args.cameras))
    middle = np.mean([c["position"] for c in cameras], axis=0)
    distance = np.mean([np.linalg.norm(np.array(c["position"]) - middle) for c in cameras])
    (args.out / "images").mkdir(parents=True)
    frames, held_out = [], []
    for number, c in enumerate(cameras):
        width, height = c["width"], c["height"]
        k = np.array([[c["fx"], 0, c.get("cx", width / 2)], [0, c["fy"], c.get("cy", height / 2)], [0, 0, 1.0]])
        to_world, centre = np.array(c["rotation"]), np.array(c["position"])
        turn = np.radians(args.degrees) * random.normal(size=3)
        move = args.move * distance * random.normal(size=3)
        if number % args.hold_out == 0:
            turn, move = np.zeros(3), np.zeros(3)
        ks = np.tile(k, (height, 1, 1))
        ks[:, 1, 2] -= np.arange(height)
        image, _, _ = scene.render(row_views(to_world.T, centre, turn, move, height), ks, width, 1)
        name = f"images/{number:03d}.png"
        darb.write_png(str(args.out / name), np.asarray(image)[:, 0])
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = to_world @ OPENGL, centre
        frame = {"file_path": name, "transform_matrix": pose.tolist()}
        if args.say == "read":
            frame |= {"camera_angular_velocity": (OPENGL @ turn / SECONDS).tolist(),
                      "camera_linear_velocity": (OPENGL @ move / SECONDS).tolist()}
        frames.append(frame)
        if number % args.hold_out == 0:
            held_out.append(name)
    names = [f["file_path"] for f in frames]
    listing = {"w": width, "h": height, "fl_x": c["fx"], "fl_y": c["fy"], "cx": k[0, 2], "cy": k[1, 2],
               "train_filenames": [n for n in names if n not in held_out], "test_filenames": held_out, "frames": frames}
    if args.say == "read":
        listing["rolling_shutter_time"] = SECONDS
    write_points(scene, args.out / "sparse_pc.ply", random)
    (args.out / "transforms.json").write_text(json.dumps(listing, indent=1) + "\n")


if __name__ == "__main__":
    main()
