#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fits splats to one picture with a kernel of your own.

    fit_picture.py [PICTURE.png] [-o FOLDER] [--splats N] [--steps N] [--kernel NAME]

Without a picture it makes one. Adam is written out, so that numpy is all that is needed;
docs/python.md has the same with an optimizer of torch's.
"""

import argparse
import pathlib

import numpy as np

import darb


def made_picture(size):
    """Discs, a grating and a gradient: edges, waves and smooth parts. [size, size, 3]."""
    y, x = np.mgrid[0:size, 0:size].astype(np.float32) / size
    image = np.stack([0.3 + 0.5 * x, 0.35 + 0.3 * y, 0.7 - 0.4 * x], -1)
    for cx, cy, r, colour in ((0.32, 0.36, 0.2, (0.9, 0.75, 0.2)), (0.68, 0.6, 0.24, (0.8, 0.2, 0.25)),
                              (0.62, 0.25, 0.1, (0.95, 0.95, 0.9))):
        image[(x - cx) ** 2 + (y - cy) ** 2 < r * r] = colour
    wave = (y > 0.75) & (np.sin(40 * x) > 0)
    image[wave] = 0.15
    return image.astype(np.float32)


def own_kernel():
    """Flat in the middle, 0 from 2.5 standard deviations on: a soft disc."""
    return darb.Kernel(lambda q: (1 - q / 6.25) ** 2 * (1 + 2 * q / 6.25), support=6.25,
                       name="soft_disc")


def start(count, rng):
    return {
        "means": np.concatenate([rng.uniform(-1, 1, (count, 2)), np.zeros((count, 1))], 1),
        "quats": rng.normal(size=(count, 4)),
        "scales": np.full((count, 3), 1.2 / np.sqrt(count)),
        "opacities": np.full(count, 0.6),
        "colors": rng.uniform(0.3, 0.7, (count, 3)),
    }


def fit(target, count, steps, kernel, seed=0):
    """-> the picture of `count` splats after `steps` of Adam on the mean square error, and the losses."""
    size = target.shape[0]
    splats = start(count, np.random.default_rng(seed))
    rates = {"means": 0.01, "quats": 0.02, "scales": 0.004, "opacities": 0.02, "colors": 0.02}
    first = {name: np.zeros_like(value) for name, value in splats.items()}
    second = {name: np.zeros_like(value) for name, value in splats.items()}
    view = np.eye(4)[None]
    view[0, 2, 3] = 4
    camera = {"viewmats": view, "Ks": np.array([[[2 * size, 0, size / 2], [0, 2 * size, size / 2],
                                                 [0, 0, 1.0]]]),
              "width": size, "height": size, "kernel": kernel}
    losses = []
    for step in range(1, steps + 1):
        given = {name: value.astype(np.float32) for name, value in splats.items()}
        image, _, info = darb.rasterize(**given, **camera)
        difference = image[0] - target
        losses.append(float(np.square(difference).mean()))
        d_image = (2 / difference.size * difference)[None].astype(np.float32)
        d = darb.rasterize_backward(d_image, **given, **camera, picture=info["picture"])
        for name, value in splats.items():
            g = d[name].astype(np.float64)
            first[name] += 0.1 * (g - first[name])
            second[name] += 0.01 * (g * g - second[name])
            scale = np.sqrt(second[name] / (1 - 0.99**step)) + 1e-12
            value -= rates[name] * first[name] / (1 - 0.9**step) / scale
        splats["opacities"] = splats["opacities"].clip(0.01, 1)
        splats["scales"] = splats["scales"].clip(0.004, 1)
    return image[0], losses


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("picture", nargs="?")
    parser.add_argument("-o", "--output", default=".", type=pathlib.Path)
    parser.add_argument("--splats", type=int, default=400)
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--size", type=int, default=160)
    given = parser.parse_args()
    if given.picture:
        from PIL import Image
        target = np.float32(Image.open(given.picture).convert("RGB").resize((given.size,) * 2)) / 255
    else:
        target = made_picture(given.size)
    kernels = {"gaussian": "gaussian", "raised cosine": "raised_cosine", "own": own_kernel()}
    pictures = [target]
    for name, kernel in kernels.items():
        image, losses = fit(target, given.splats, given.steps, kernel)
        psnr = -10 * np.log10(losses[-1])
        print(f"{name}: {psnr:.2f} dB after {given.steps} steps of {given.splats} splats")
        pictures.append(image)
    given.output.mkdir(parents=True, exist_ok=True)
    darb.write_png(given.output / "fit_picture.png", np.concatenate(pictures, 1))


if __name__ == "__main__":
    main()
