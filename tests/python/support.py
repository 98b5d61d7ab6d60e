# SPDX-License-Identifier: MIT
"""What the tests of the Python package share: small scenes, cameras, and central differences."""

import os
import pathlib
import sys

SKIP = 77  # what ctest takes for skipped


def skip(reason):
    print(f"skipped: {reason}")
    sys.exit(SKIP)


try:
    import numpy as np
except ModuleNotFoundError as error:
    skip(f"numpy is not here: {error}")

SOURCE = pathlib.Path(__file__).resolve().parents[2]
SHIPPED = SOURCE / "assets" / "scene"
COMMAND = os.environ.get("DARB_COMMAND", str(SOURCE / "build" / "darb"))


def camera(count=1, width=40, height=32, focal=45.0):
    """C cameras 4 units before the origin, each turned a little more about the vertical."""
    viewmats = np.zeros((count, 4, 4), np.float32)
    for c in range(count):
        angle = 0.15 * c
        viewmats[c] = [[np.cos(angle), 0, np.sin(angle), 0], [0, 1, 0, 0.1 * c],
                       [-np.sin(angle), 0, np.cos(angle), 4], [0, 0, 0, 1]]
    K = np.array([[focal, 0, width / 2 - 0.7], [0, focal * 1.1, height / 2 + 0.4], [0, 0, 1]],
                 np.float32)
    return {"viewmats": viewmats, "Ks": np.repeat(K[None], count, 0), "width": width,
            "height": height}


def splats(count=24, seed=1, sh=None):
    """Arrays as rasterize takes them; sh: the number of coefficients, or colours."""
    rng = np.random.default_rng(seed)
    arrays = {
        "means": rng.uniform(-1, 1, (count, 3)),
        "quats": rng.normal(size=(count, 4)),
        "scales": np.exp(rng.uniform(-2.2, -0.9, (count, 3))),
        "opacities": rng.uniform(0.2, 0.9, count),
    }
    if sh is None:
        arrays["colors"] = rng.uniform(0.05, 1, (count, 3))
    else:
        arrays["sh"] = rng.normal(size=(count, sh, 3)) * 0.25
    return {name: value.astype(np.float32) for name, value in arrays.items()}


def shapes(count=24, seed=6):
    """[N] of the kernel beta: exponents from about 1.5 to 11."""
    return np.random.default_rng(seed).uniform(-1, 1, count).astype(np.float32)


def weights(pictures, seed=2):
    """Random dL/d(image) [C, H, W, 3] and dL/d(alpha) [C, H, W] for a loss of one's own."""
    rng = np.random.default_rng(seed)
    c = len(pictures["viewmats"])
    size = (c, pictures["height"], pictures["width"])
    return (rng.uniform(-1, 1, (*size, 3)).astype(np.float32),
            rng.uniform(-1, 1, size).astype(np.float32))


def rms(a):
    return float(np.sqrt(np.mean(np.square(np.asarray(a, np.float64))))) if np.size(a) else 0.0


def relative(got, want):
    """The root mean square of the difference over that of what is wanted."""
    return rms(np.asarray(got, np.float64) - np.asarray(want, np.float64)) / max(rms(want), 1e-12)


def resident_bytes():
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
