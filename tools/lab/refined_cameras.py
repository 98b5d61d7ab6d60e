#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Disturbs the cameras of a COLMAP project, and measures how far other cameras are from the original ones.

    refined_cameras.py disturb DATASET OUT PX [--seed N] [--no-tracks]
    refined_cameras.py measure DATASET CAMERAS.json [--trained] [--json FILE]

disturb  writes OUT, a project with the same photos and other poses. Each camera is turned and moved at random, with half
         of the shift from either, until the points that it sees are shifted by PX on average. The points follow: each is
         placed anew where the disturbed cameras see it best. --no-tracks leaves out where photos saw points, so that only
         the pictures can tell; the points then stay where they are, with noise of as many pixels.
measure  compares the cameras of a run with those of DATASET. Both are aligned by the similarity (turn, move, scale) under
         which the points are drawn nearest to each other. The error of a camera is the root mean square over its points, in
         px of the photos as CAMERAS.json has them. Prints median, largest and mean over the cameras. --trained leaves out
         every 8th camera, which `darb train --eval` holds out.

It takes binary models of pinholes, and needs nothing but Python's standard library.
"""

import argparse
import json
import math
import os
import pathlib
import random
import statistics
import struct


def matmul(a, b):
    return [[sum(x * y for x, y in zip(row, col)) for col in zip(*b)] for row in a]


def apply(m, v):
    return [sum(x * y for x, y in zip(row, v)) for row in m]


def transpose(m):
    return [list(row) for row in zip(*m)]


def add(a, b):
    return [x + y for x, y in zip(a, b)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def exp_rotation(w):
    angle = math.sqrt(sum(x * x for x in w))
    k = [[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]]
    a = math.sin(angle) / angle if angle > 1e-9 else 1.0
    b = (1 - math.cos(angle)) / angle**2 if angle > 1e-9 else 0.5
    kk = matmul(k, k)
    return [[(i == j) + a * k[i][j] + b * kk[i][j] for j in range(3)] for i in range(3)]


def rotation_of(q):
    n = math.sqrt(sum(x * x for x in q))
    w, x, y, z = (v / n for v in q)
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def quaternion_of(r):
    w = math.sqrt(max(0.0, 1 + r[0][0] + r[1][1] + r[2][2])) / 2
    x = math.sqrt(max(0.0, 1 + r[0][0] - r[1][1] - r[2][2])) / 2
    y = math.sqrt(max(0.0, 1 - r[0][0] + r[1][1] - r[2][2])) / 2
    z = math.sqrt(max(0.0, 1 - r[0][0] - r[1][1] + r[2][2])) / 2
    x = math.copysign(x, r[2][1] - r[1][2])
    y = math.copysign(y, r[0][2] - r[2][0])
    z = math.copysign(z, r[1][0] - r[0][1])
    return [w, x, y, z]


def solve(a, b):
    n = len(b)
    m = [list(row) + [v] for row, v in zip(a, b)]
    for i in range(n):
        best = max(range(i, n), key=lambda r: abs(m[r][i]))
        m[i], m[best] = m[best], m[i]
        for r in range(i + 1, n):
            f = m[r][i] / m[i][i]
            for c in range(i, n + 1):
                m[r][c] -= f * m[i][c]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (m[i][n] - sum(m[i][c] * x[c] for c in range(i + 1, n))) / m[i][i]
    return x


class Camera:
    """Rotation and translation from world to camera, and a pinhole."""

    def __init__(self, rotation, translation, fx, fy, cx, cy, width):
        self.rotation, self.translation = rotation, translation
        self.fx, self.fy, self.cx, self.cy, self.width = fx, fy, cx, cy, width

    def place(self, x):
        return add(apply(self.rotation, x), self.translation)

    def pixel(self, x):
        p = self.place(x)
        if p[2] <= 0:
            return None
        return self.fx * p[0] / p[2] + self.cx, self.fy * p[1] / p[2] + self.cy

    def moved(self, turn, move):
        r = exp_rotation(turn)
        return Camera(matmul(r, self.rotation), add(apply(r, self.translation), move), self.fx, self.fy, self.cx,
                      self.cy, self.width)


class Model:
    """A binary COLMAP model."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        data = (self.folder / "cameras.bin").read_bytes()
        count, = struct.unpack_from("<Q", data, 0)
        at, pinholes = 8, {}
        for _ in range(count):
            number, kind, width, _height = struct.unpack_from("<IiQQ", data, at)
            at += 24
            floats = {0: 3, 1: 4}[kind]
            p = struct.unpack_from(f"<{floats}d", data, at)
            at += 8 * floats
            pinholes[number] = (p[0], p[0], p[1], p[2], width) if kind == 0 else (*p, width)
        data = (self.folder / "images.bin").read_bytes()
        count, = struct.unpack_from("<Q", data, 0)
        at, self.images = 8, {}
        for _ in range(count):
            number, *pose = struct.unpack_from("<I7d", data, at)
            camera, = struct.unpack_from("<I", data, at + 60)
            end = data.index(b"\0", at + 64)
            name = data[at + 64:end].decode()
            seen, = struct.unpack_from("<Q", data, end + 1)
            at = end + 9
            observations = [struct.unpack_from("<ddq", data, at + 24 * k) for k in range(seen)]
            at += 24 * seen
            self.images[number] = {"name": name, "camera_id": camera, "observed": observations,
                                   "camera": Camera(rotation_of(pose[:4]), pose[4:], *pinholes[camera])}
        data = (self.folder / "points3D.bin").read_bytes()
        count, = struct.unpack_from("<Q", data, 0)
        at, self.points = 8, {}
        for _ in range(count):
            number, x, y, z = struct.unpack_from("<Qddd", data, at)
            rest = data[at + 32:at + 43]
            track, = struct.unpack_from("<Q", data, at + 43)
            at += 51
            elements = [struct.unpack_from("<II", data, at + 8 * k) for k in range(track)]
            at += 8 * track
            self.points[number] = {"at": [x, y, z], "rest": rest, "track": elements}

    def points_of(self, most=120):
        """image -> places of points that it saw, spread over them."""
        seen = {number: [] for number in self.images}
        for point in self.points.values():
            for image, _ in point["track"]:
                if image in seen:
                    seen[image].append(point["at"])
        if not any(seen.values()):  # no photo names its points, so those within the frame count
            for number, image in self.images.items():
                for point in self.points.values():
                    at = image["camera"].pixel(point["at"])
                    if at and 0 <= at[0] < 2 * image["camera"].cx and 0 <= at[1] < 2 * image["camera"].cy:
                        seen[number].append(point["at"])
        return {n: s[::max(1, len(s) // most)] for n, s in seen.items()}

    def write(self, folder, tracks):
        folder.mkdir(parents=True)
        (folder / "cameras.bin").write_bytes((self.folder / "cameras.bin").read_bytes())
        out = struct.pack("<Q", len(self.images))
        for number, image in self.images.items():
            c = image["camera"]
            out += struct.pack("<I7dI", number, *quaternion_of(c.rotation), *c.translation, image["camera_id"])
            out += image["name"].encode() + b"\0"
            seen = image["observed"] if tracks else []
            out += struct.pack("<Q", len(seen)) + b"".join(struct.pack("<ddq", *o) for o in seen)
        (folder / "images.bin").write_bytes(out)
        parts = [struct.pack("<Q", len(self.points))]
        for number, point in self.points.items():
            track = point["track"] if tracks else []
            parts.append(struct.pack("<Qddd", number, *point["at"]) + point["rest"] + struct.pack("<Q", len(track)))
            parts += [struct.pack("<II", *element) for element in track]
        (folder / "points3D.bin").write_bytes(b"".join(parts))


def shift(a, b, points):
    """The root mean square distance between two cameras' pixels of the points."""
    squares = []
    for x in points:
        p, q = a.pixel(x), b.pixel(x)
        if p and q:
            squares.append((p[0] - q[0])**2 + (p[1] - q[1])**2)
    return math.sqrt(sum(squares) / len(squares)) if squares else float("nan")


def mean_shift(a, b, points):
    values = []
    for x in points:
        p, q = a.pixel(x), b.pixel(x)
        if p and q:
            values.append(math.hypot(p[0] - q[0], p[1] - q[1]))
    return sum(values) / len(values) if values else float("nan")


def disturbed(camera, points, px, rng):
    turn = [rng.gauss(0, 1) for _ in range(3)]
    move = [rng.gauss(0, 1) for _ in range(3)]
    one = 1e-4
    by_turn = mean_shift(camera, camera.moved([one * x for x in turn], [0, 0, 0]), points) / one
    depth = statistics.median(camera.place(x)[2] for x in points)
    by_move = mean_shift(camera, camera.moved([0, 0, 0], [one * depth * x for x in move]), points) / one
    size = 1.0
    for _ in range(20):  # turning and moving together is not the sum of both
        t = [size * px * x / by_turn for x in turn]
        m = [size * px * depth * x / by_move for x in move]
        size *= px / mean_shift(camera, camera.moved(t, m), points)
    return camera.moved([size * px * x / by_turn for x in turn], [size * px * depth * x / by_move for x in move])


def triangulated(at, seen):
    """seen: [(camera, pixel)]. Damped Gauss-Newton; returns the start where it does not help."""
    def cost(x):
        sum_ = 0.0
        for camera, pixel in seen:
            p = camera.pixel(x)
            if not p:
                return float("inf")
            sum_ += (p[0] - pixel[0])**2 + (p[1] - pixel[1])**2
        return sum_
    x, now = list(at), cost(at)
    for _ in range(8):
        a, b = [[0.0] * 3 for _ in range(3)], [0.0] * 3
        for camera, pixel in seen:
            p = camera.place(x)
            if p[2] <= 0:
                continue
            r = camera.rotation
            for f, k, c, target in ((camera.fx, 0, camera.cx, pixel[0]), (camera.fy, 1, camera.cy, pixel[1])):
                row = [f * (r[k][j] - p[k] / p[2] * r[2][j]) / p[2] for j in range(3)]
                error = f * p[k] / p[2] + c - target
                for i in range(3):
                    b[i] -= row[i] * error
                    for j in range(3):
                        a[i][j] += row[i] * row[j]
        for i in range(3):
            a[i][i] *= 1.001
            a[i][i] += 1e-12
        new = add(x, solve(a, b))
        after = cost(new)
        if not after < now:
            break
        x, now = new, after
    return x


def disturb(args):
    source = pathlib.Path(args.dataset)
    model = Model(source / "sparse/0")
    rng = random.Random(args.seed)
    seen = model.points_of()
    true = {number: image["camera"] for number, image in model.images.items()}
    for number, image in model.images.items():
        if len(seen[number]) > 0 and args.px > 0:
            image["camera"] = disturbed(image["camera"], seen[number], args.px, rng)
    shifts = [mean_shift(true[n], model.images[n]["camera"], seen[n]) for n in true if seen[n]]
    tracks = not args.no_tracks
    if args.px > 0:
        for point in model.points.values():
            if tracks and len(point["track"]) > 1:
                where = [(model.images[i]["camera"], model.images[i]["observed"][k][:2]) for i, k in point["track"]
                         if i in model.images]
                point["at"] = triangulated(point["at"], where)
            else:
                camera = next(iter(true.values()))
                size = args.px * abs(camera.place(point["at"])[2]) / camera.fx
                point["at"] = [x + rng.gauss(0, size) / math.sqrt(3) for x in point["at"]]
    out = pathlib.Path(args.out)
    model.write(out / "sparse/0", tracks)
    os.symlink((source / "images").resolve(), out / "images")
    print(f"{len(shifts)} cameras shifted by {statistics.mean(shifts):.3f} px in the mean")


def similarity_steps(pairs):
    """Camera of the run -> the same camera after a similarity of its world that minimises the distance in pixels. pairs: [(true,
    got, points)]; the points are those of the true world."""
    # x_got = scale turn x + move, at first from the centres, then by Gauss-Newton over pixels.
    def centre(c):
        return [-v for v in apply(transpose(c.rotation), c.translation)]
    turn, move, scale = [[float(i == j) for j in range(3)] for i in range(3)], [0.0] * 3, 1.0

    def residuals(turn, move, scale):
        out = []
        for true, got, points in pairs:
            for x in points:
                p = true.pixel(x)
                q = got.pixel(add([scale * v for v in apply(turn, x)], move))
                if p and q:
                    out += [q[0] - p[0], q[1] - p[1]]
                else:
                    out += [0.0, 0.0]
        return out

    def moved(step):
        return matmul(exp_rotation(step[:3]), turn), add(move, step[3:6]), scale * math.exp(step[6])

    middle = [statistics.mean(centre(t)[k] for t, _, _ in pairs) for k in range(3)]
    reach = max(math.dist(centre(t), middle) for t, _, _ in pairs) or 1.0
    for _ in range(12):
        base = residuals(turn, move, scale)
        columns = []
        for k in range(7):
            step = [0.0] * 7
            one = 1e-6 * (reach if 3 <= k < 6 else 1)
            step[k] = one
            columns.append([(a - b) / one for a, b in zip(residuals(*moved(step)), base)])
        a = [[sum(x * y for x, y in zip(p, q)) for q in columns] for p in columns]
        for i in range(7):
            a[i][i] *= 1 + 1e-9
        step = solve(a, [-sum(x * y for x, y in zip(p, base)) for p in columns])
        turn, move, scale = moved(step)
        if max(abs(v) for v in step) < 1e-10:
            break
    return turn, move, scale


def aligned_shifts(model, listed):
    seen = model.points_of(60)
    pairs, names = [], []
    for number, image in model.images.items():
        record = listed.get(image["name"])
        if record is None or len(seen[number]) < 3:
            continue
        to_world = record["rotation"]  # rows of camera to world
        rotation = transpose(to_world)
        translation = [-v for v in apply(rotation, record["position"])]
        share = record["width"] / image["camera"].width
        c = image["camera"]
        true = Camera(c.rotation, c.translation, c.fx * share, c.fy * share, c.cx * share, c.cy * share, c.width)
        got = Camera(rotation, translation, record["fx"], record["fy"], record.get("cx", record["width"] / 2),
                     record.get("cy", record["height"] / 2), record["width"])
        pairs.append((true, got, seen[number]))
        names.append(image["name"])
    turn, move, scale = similarity_steps(pairs)
    shifts = []
    for true, got, points in pairs:
        # `got` sees x_got = scale turn x + move; this makes it a camera of the true world, up to scale.
        rotation = matmul(got.rotation, turn)
        translation = [v / scale for v in add(apply(got.rotation, move), got.translation)]
        same = Camera(rotation, translation, got.fx, got.fy, got.cx, got.cy, got.width)
        shifts.append(shift(true, same, points))
    return dict(zip(names, shifts))


def measure(args):
    model = Model(pathlib.Path(args.dataset) / "sparse/0")
    with open(args.cameras, encoding="utf-8") as file:
        records = json.load(file)
    if args.trained:
        records = [record for i, record in enumerate(records) if i % 8]
    listed = {record["img_name"]: record for record in records}
    shifts = aligned_shifts(model, listed)
    values = sorted(shifts.values())
    result = {"cameras": len(values), "median_px": statistics.median(values), "largest_px": values[-1],
              "mean_px": statistics.mean(values)}
    print(f"{result['cameras']} cameras: median {result['median_px']:.3f} px, mean {result['mean_px']:.3f}, "
          f"largest {result['largest_px']:.3f}")
    if args.json:
        pathlib.Path(args.json).write_text(json.dumps({**result, "px": shifts}, indent=1) + "\n", encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    command = commands.add_parser("disturb")
    command.add_argument("dataset")
    command.add_argument("out")
    command.add_argument("px", type=float)
    command.add_argument("--seed", type=int, default=0)
    command.add_argument("--no-tracks", action="store_true")
    command.set_defaults(run=disturb)
    command = commands.add_parser("measure")
    command.add_argument("dataset")
    command.add_argument("cameras")
    command.add_argument("--trained", action="store_true")
    command.add_argument("--json")
    command.set_defaults(run=measure)
    args = parser.parse_args()
    args.run(args)


if __name__ == "__main__":
    main()
