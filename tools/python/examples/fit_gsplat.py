#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fits random splats to one picture with gsplat's call and PyTorch.

    fit_gsplat.py [PICTURE.png] [-o FOLDER] [--splats N] [--steps N] [--size PX]

Nothing in fit() is darb's own: with gsplat and CUDA it runs as it stands, if the import below says
`from gsplat import rasterization`.
"""

import argparse
import math
import pathlib

import numpy as np
import torch
from darb.gsplat import rasterization

import darb


def fit(target, count, steps, seed=0):
    """target [H, W, 3] -> the picture of `count` splats after `steps` of Adam, and the losses."""
    height, width = target.shape[:2]
    torch.manual_seed(seed)
    raw = {
        "means": torch.rand(count, 3) * 2 - 1,
        "quats": torch.randn(count, 4),
        "log_scales": torch.full((count, 3), math.log(1.2 / math.sqrt(count))),
        "logits": torch.zeros(count),
        "colors": torch.randn(count, 3) * 0.3,
    }
    raw = {name: value.to(target.device).requires_grad_() for name, value in raw.items()}
    distance = 4.0
    view = torch.eye(4, device=target.device)[None]
    view[0, 2, 3] = distance
    focal = distance / 2 * max(width, height)
    K = torch.tensor([[[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]]], device=target.device)
    optimizer = torch.optim.Adam([
        {"params": [raw["means"], raw["log_scales"]], "lr": 0.01},
        {"params": [raw["quats"], raw["logits"], raw["colors"]], "lr": 0.03}])
    losses = []
    for _ in range(steps):
        colors, _, _ = rasterization(
            raw["means"], raw["quats"], raw["log_scales"].exp(), torch.sigmoid(raw["logits"]),
            torch.sigmoid(raw["colors"]), view, K, width, height, packed=False)
        loss = (colors[0] - target).square().mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        losses.append(float(loss))
    return colors[0].detach(), losses


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
    else:  # a disc before a slope
        y, x = np.mgrid[0:given.size, 0:given.size].astype(np.float32) / given.size
        target = np.stack([0.3 + 0.5 * x, 0.3 + 0.3 * y, 0.7 - 0.4 * x], -1)
        target[(x - 0.4) ** 2 + (y - 0.45) ** 2 < 0.06] = (0.9, 0.75, 0.2)
    image, losses = fit(torch.from_numpy(target), given.splats, given.steps)
    print(f"{-10 * math.log10(losses[0]):.2f} dB at first, {-10 * math.log10(losses[-1]):.2f} dB "
          f"after {given.steps} steps of {given.splats} splats")
    given.output.mkdir(parents=True, exist_ok=True)
    darb.write_png(given.output / "fit_gsplat.png", np.concatenate([target, image.numpy()], 1))


if __name__ == "__main__":
    main()
