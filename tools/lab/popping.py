#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Measures popping: how much a picture changes while the camera turns, beyond what the camera explains.

    popping.py DARB SCENE CAMERAS OUT [--view I] [--degrees 12] [--pan] [--frames 61] [--width 300]

DARB draws a film of SCENE twice, with splats sorted by their centres and with each pixel's own order. The camera of
view I of CAMERAS (a cameras.json) goes around the point in front of it or, with --pan, turns on the spot. Each frame is compared with an earlier one that
the scene's depth moves onto it, as StopThePop does (Radl et al., 2024) with optical flow and a perceptual difference;
here the flow is exact, and the difference is the root mean square of the colours, 0 to 255. Pixels whose depth does not
agree, as where one thing hides another, are left out. Prints JSON.
"""
import argparse
import json
import math
import os
import struct
import subprocess
import zlib

STEPS = (1, 7)  # frames between two that are compared, as in the paper
AGREES = 0.02   # of the depth


def read_png(path):
    """Width, height and rows of RGB bytes of an 8-bit PNG."""
    data = open(path, "rb").read()
    at, packed, width, height, channels = 8, b"", 0, 0, 3
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
            channels = {2: 3, 6: 4}[colour]
            assert depth == 8
        if kind == b"IDAT":
            packed += body
        at += 12 + size
    raw, stride = zlib.decompress(packed), width * channels
    rows, before = [], bytearray(stride)
    for y in range(height):
        kind = raw[y * (stride + 1)]
        row = bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride):
            left = row[i - channels] if i >= channels else 0
            up, corner = before[i], before[i - channels] if i >= channels else 0
            if kind == 1:
                row[i] = (row[i] + left) & 255
            elif kind == 2:
                row[i] = (row[i] + up) & 255
            elif kind == 3:
                row[i] = (row[i] + (left + up) // 2) & 255
            elif kind == 4:
                guess = left + up - corner
                a, b, c = abs(guess - left), abs(guess - up), abs(guess - corner)
                row[i] = (row[i] + (left if a <= b and a <= c else up if b <= c else corner)) & 255
        rows.append(row)
        before = row
    return width, height, channels, rows


def read_npy(path):
    data = open(path, "rb").read()
    begin = 10 + struct.unpack("<H", data[8:10])[0]
    return struct.unpack(f"<{(len(data) - begin) // 4}f", data[begin:])


def turned(camera, pivot, axis, angle):
    """The camera, turned about an axis through the pivot."""
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = axis
    turn = [[c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s],
            [y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s],
            [z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)]]
    away = [camera["position"][k] - pivot[k] for k in range(3)]
    moved = dict(camera)
    moved["position"] = [pivot[i] + sum(turn[i][k] * away[k] for k in range(3)) for i in range(3)]
    moved["rotation"] = [[sum(turn[i][k] * camera["rotation"][k][j] for k in range(3)) for j in range(3)]
                         for i in range(3)]
    return moved


def film_cameras(camera, frames, degrees, width, depth):
    scale = width / camera["width"]
    camera = dict(camera, width=width, height=round(camera["height"] * scale), fx=camera["fx"] * scale,
                  fy=camera["fy"] * scale)
    for key in ("cx", "cy"):
        if key in camera:
            camera[key] *= scale
    forward = [row[2] for row in camera["rotation"]]
    down = [row[1] for row in camera["rotation"]]
    pivot = [camera["position"][k] + depth * forward[k] for k in range(3)]
    list_ = []
    for i in range(frames):
        angle = math.radians(degrees) * (i / (frames - 1) - 0.5)
        list_.append(dict(turned(camera, pivot, down, angle), id=i, img_name=f"frame_{i:03d}"))
    return list_


def draw(args, cameras, order, out, depth):
    os.makedirs(out, exist_ok=True)
    listed = os.path.join(args.out, "film.json")
    json.dump(cameras, open(listed, "w"))
    command = [args.darb, "render", args.scene, "--cameras", listed, "-o", out, "--depth-order", order, "-q", "--force"]
    subprocess.run(command + (["--depth", "npy"] if depth else []), check=True, stdout=subprocess.DEVNULL)


def compare(frames, depths, cameras, step, args):
    """Sums of squared differences, of pixels, and of those that change by args.jump or more."""
    squares = pixels = jumps = 0
    for t in range(step, len(frames)):
        width, height, channels, now = frames[t]
        before = frames[t - step][3]
        a, b = cameras[t], cameras[t - step]
        cx, cy = a.get("cx", width / 2), a.get("cy", height / 2)
        ra, rb, pa, pb = a["rotation"], b["rotation"], a["position"], b["position"]
        # From the camera now to the one before: p' = m p + v.
        m = [[sum(rb[k][i] * ra[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
        v = [sum(rb[k][i] * (pa[k] - pb[k]) for k in range(3)) for i in range(3)]
        fx, fy = a["fx"], a["fy"]
        for y in range(0, height, args.every):
            for x in range(0, width, args.every):
                z = depths[t][y * width + x]
                if not z > 0:
                    continue
                px, py = (x + 0.5 - cx) / fx * z, (y + 0.5 - cy) / fy * z
                qx = m[0][0] * px + m[0][1] * py + m[0][2] * z + v[0]
                qy = m[1][0] * px + m[1][1] * py + m[1][2] * z + v[1]
                qz = m[2][0] * px + m[2][1] * py + m[2][2] * z + v[2]
                if qz <= 0:
                    continue
                u, w = fx * qx / qz + cx - 0.5, fy * qy / qz + cy - 0.5
                if u < 0 or w < 0 or u >= width - 1 or w >= height - 1:
                    continue
                i, j = int(u), int(w)
                near = depths[t - step][round(w) * width + round(u)]
                if abs(near - qz) > AGREES * qz:
                    continue
                s, r = u - i, w - j
                one, two, at = before[j], before[j + 1], channels * i
                most = 0
                for k in range(3):
                    was = ((1 - r) * ((1 - s) * one[at + k] + s * one[at + channels + k]) +
                           r * ((1 - s) * two[at + k] + s * two[at + channels + k]))
                    change = now[y][channels * x + k] - was
                    squares += change * change
                    most = max(most, abs(change))
                pixels += 1
                jumps += most >= args.jump
    return squares, pixels, jumps


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("darb", "scene", "cameras", "out"):
        parser.add_argument(name)
    parser.add_argument("--view", type=int, default=0)
    parser.add_argument("--degrees", type=float, default=12)
    parser.add_argument("--pan", action="store_true", help="turn on the spot")
    parser.add_argument("--frames", type=int, default=61)
    parser.add_argument("--width", type=int, default=300, help="px")
    parser.add_argument("--jump", type=float, default=8, help="of 255: pixels that change by so much are counted")
    parser.add_argument("--every", type=int, default=2, help="of the pixels of a row, and of the rows")
    args = parser.parse_args()
    os.makedirs(args.out, exist_ok=True)
    camera = json.load(open(args.cameras))[args.view]
    still = film_cameras(camera, 3, 0, args.width, 1)[:1]
    draw(args, still, "centre", os.path.join(args.out, "still"), True)
    first = read_npy(os.path.join(args.out, "still", "frame_000_depth.npy"))
    seen = sorted(z for z in first[:still[0]["width"] * still[0]["height"]] if z > 0)
    cameras = film_cameras(camera, args.frames, args.degrees, args.width,
                           0 if args.pan else seen[len(seen) // 2])
    result = {"scene": os.path.basename(args.scene), "frames": args.frames, "degrees": args.degrees, "pan": args.pan,
              "width": args.width, "orders": {}}
    films = {}
    for order in ("centre", "pixel"):
        folder = os.path.join(args.out, order)
        draw(args, cameras, order, folder, order == "centre")
        films[order] = [read_png(os.path.join(folder, c["img_name"] + ".png")) for c in cameras]
    depths = [read_npy(os.path.join(args.out, "centre", c["img_name"] + "_depth.npy")) for c in cameras]
    for order, frames in films.items():
        row = result["orders"][order] = {}
        for step in STEPS:
            squares, pixels, jumps = compare(frames, depths, cameras, step, args)
            row[f"rms_{step}"] = round(math.sqrt(squares / (3 * pixels)), 4)
            row[f"jumps_{step}"] = round(jumps / pixels, 7)
            row["pixels"] = pixels
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
