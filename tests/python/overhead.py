#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What a call of darb.rasterize takes beyond its frame: the table of docs/python.md.

    PYTHONPATH=build-python/python python3 tests/python/overhead.py [SPLATS]
"""
import statistics
import sys
import time

import numpy as np

import darb

CALLS = 60


def splats(n, generator):
    return {"means": generator.uniform(-1, 1, (n, 3)).astype(np.float32),
            "quats": generator.normal(size=(n, 4)).astype(np.float32),
            "scales": np.full((n, 3), 0.001, np.float32),
            "opacities": generator.uniform(0.1, 0.9, n).astype(np.float32)}


def overhead(call):
    """Milliseconds: median and fastest of the calls after the first few."""
    beyond = []
    for _ in range(CALLS):
        begin = time.perf_counter()
        info = call()[2]
        beyond.append((time.perf_counter() - begin) * 1e3 - info["frame_ms"])
    return statistics.median(beyond[3:]), min(beyond[3:])


def main():
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    generator = np.random.default_rng(0)
    arrays = splats(n, generator)
    colors = generator.uniform(0, 1, (n, 3)).astype(np.float32)
    sh = generator.normal(size=(n, 16, 3)).astype(np.float32)
    rows = {"a Scene": {"means": darb.Scene.from_arrays(**arrays, sh=sh)},
            "arrays with colors": {**arrays, "colors": colors},
            "arrays with sh of degree 3": {**arrays, "sh": sh}}
    print(f"{n} splats, milliseconds beyond the frame: median (fastest) of {CALLS} calls")
    for size in (64, 640):
        viewmat = np.eye(4, dtype=np.float32)[None]
        viewmat[0, 2, 3] = 4
        k = np.array([[[size, 0, size / 2], [0, size, size / 2], [0, 0, 1]]], np.float32)
        for name, given in rows.items():
            median, fastest = overhead(lambda: darb.rasterize(
                **given, viewmats=viewmat, Ks=k, width=size, height=size))
            print(f"  {size:3}x{size:3} {name:28} {median:6.2f} ({fastest:.2f})")


main()
