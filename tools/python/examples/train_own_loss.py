#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Trains a data set step by step with a loss of your own.

    train_own_loss.py [DATASET] [-o FOLDER] [--iterations N] [--resolution N]

DATASET: by default the scene in the source tree; elsewhere it must be given.

The loss gets the picture as an array and returns its gradient. Here it is a robust one, Charbonnier's
sqrt(d^2 + e^2), which forgives pixels that are far off. The built-in loss is trained beside it.
"""

import argparse
import pathlib

import numpy as np

import darb

SHIPPED = pathlib.Path(__file__).resolve().parents[3] / "assets" / "scene"


def charbonnier(image, view, e=0.03):
    """dL/d(image) of the mean of sqrt(d^2 + e^2)."""
    rgb, alpha = np.float32(view["photo"][..., :3]) / 255, np.float32(view["photo"][..., 3:]) / 255
    d = image - (rgb * alpha + view["background"] * (1 - alpha))
    return d / np.sqrt(d * d + e * e) / d.size


def train(data, iterations, loss, every):
    trainer = darb.Trainer(data, iterations=iterations)
    trainer.on_round = lambda r: print(f"  {r['iteration']}: {r['before']} -> {r['after']} splats")
    while not trainer.step(every, loss=loss)["done"]:
        measured = trainer.evaluate()
        print(f"{trainer.iteration}: {measured['psnr']:.2f} dB held out, {len(trainer)} splats")
    return trainer


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset", nargs="?", default=SHIPPED)
    parser.add_argument("-o", "--output", default=".", type=pathlib.Path)
    parser.add_argument("--iterations", type=int, default=600)
    parser.add_argument("--resolution", type=int, default=100)
    given = parser.parse_args()
    if given.dataset == SHIPPED and not SHIPPED.exists():
        parser.error("give a DATASET: this is not the source tree, which has one in assets/scene")
    data = darb.Dataset.read(given.dataset, resolution=given.resolution, eval=True)
    test = next(i for i in range(len(data)) if data.view(i)["is_test"])
    view, photo = data.view(test), np.float32(data.photo(test)) / 255
    rows = [photo[..., :3] * photo[..., 3:]]
    for name, loss in (("built in", None), ("charbonnier", charbonnier)):
        print(name)
        trainer = train(data, given.iterations, loss, max(given.iterations // 4, 1))
        scene = trainer.scene()
        print(f"{name}: {trainer.evaluate()['psnr']:.2f} dB, {len(scene)} splats")
        rows.append(scene.render(view["viewmat"][None], view["K"][None], view["width"],
                                 view["height"])[0][0])
    given.output.mkdir(parents=True, exist_ok=True)
    darb.write_png(given.output / "train_own_loss.png",
                   np.concatenate(rows, 1).astype(np.float32))


if __name__ == "__main__":
    main()
