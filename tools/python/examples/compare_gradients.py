#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Compares what the gradients of kernels tell about the place and the size of a splat.

    compare_gradients.py [-o FOLDER] [--size N]

One splat is moved across a picture of itself. For each kernel the script plots the loss (left) and
its slope by the gradient (right), and prints how far the integral of the slope is off the loss. It
is far off for inverse_quadratic, whose profile ends in a jump: a jump has no gradient.
"""

import argparse
import pathlib

import numpy as np

import darb

KERNELS = {
    "gaussian": ("red", (0.9, 0.3, 0.2)),
    "raised_cosine": ("blue", (0.2, 0.55, 0.9)),
    "half_cosine_squared": ("green", (0.2, 0.7, 0.35)),
    "sinc": ("brown", (0.75, 0.5, 0.1)),
    "inverse_quadratic": ("violet", (0.6, 0.35, 0.8)),
}


def camera(size):
    view = np.eye(4)[None]
    view[0, 2, 3] = 4
    K = np.array([[[1.6 * size, 0, size / 2], [0, 1.6 * size, size / 2], [0, 0, 1]]])
    return {"viewmats": view, "Ks": K, "width": size, "height": size, "accuracy": "exact"}


def splat(x):
    return {"means": np.float32([[x, 0, 0]]), "quats": np.float32([[1, 0, 0, 0]]),
            "scales": np.float32([[0.15, 0.15, 0.15]]), "opacities": np.float32([0.9]),
            "colors": np.float32([[1, 1, 1]])}


def slopes(kernel, offsets, view):
    """The loss at each offset, and dL/dx by the gradient."""
    target = darb.rasterize(**splat(0), **view, kernel=kernel)[0]
    losses, gradients = [], []
    for x in offsets:
        image, _, info = darb.rasterize(**splat(x), **view, kernel=kernel)
        losses.append(float(np.square(np.float64(image - target)).sum()))
        d = darb.rasterize_backward(2 * (image - target), **splat(x), **view, kernel=kernel,
                                    picture=info["picture"])
        gradients.append(float(d["means"][0, 0]))
    return np.array(losses), np.array(gradients)


def plot(curves, size=(360, 240)):
    """Curves in [-1, 1] over their index, one colour each. [H, W, 3]."""
    width, height = size
    image = np.ones((height, width, 3), np.float32)
    image[height // 2] = 0.8
    image[:, width // 2] = 0.8
    for curve, (_, colour) in zip(curves, KERNELS.values()):
        at = np.interp(np.linspace(0, len(curve) - 1, 4 * width), np.arange(len(curve)), curve)
        rows = np.clip(((1 - at) / 2 * (height - 3)).astype(int) + 1, 1, height - 2)
        columns = np.repeat(np.arange(width), 4)
        for d in (-1, 0, 1):
            image[rows + d, columns] = colour
    return image


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", default=".", type=pathlib.Path)
    parser.add_argument("--size", type=int, default=96)
    parser.add_argument("--points", type=int, default=41)
    given = parser.parse_args()
    offsets = np.linspace(-0.8, 0.8, given.points)
    losses, gradients = [], []
    view = camera(given.size)
    for kernel, (colour, _) in KERNELS.items():
        loss, gradient = slopes(kernel, offsets, view)
        # Its integral is the loss again, which is a check without a step size to choose.
        pieces = np.diff(offsets) * (gradient[1:] + gradient[:-1]) / 2
        integral = np.concatenate([[0], np.cumsum(pieces)])
        apart = np.abs(integral - (loss - loss[0])).max() / loss.max()
        pull = np.abs(offsets[np.abs(gradient) > 0.01 * np.abs(gradient).max()]).max()
        print(f"{kernel:20s} {colour:7s} pulls from {pull:.2f} on; "
              f"integral of the gradient off the loss by {apart:.1%}")
        losses.append(2 * loss / loss.max() - 1)
        gradients.append(gradient / np.abs(gradient).max())
    given.output.mkdir(parents=True, exist_ok=True)
    darb.write_png(given.output / "compare_gradients.png",
                   np.concatenate([plot(losses), plot(gradients)], 1))


if __name__ == "__main__":
    main()
