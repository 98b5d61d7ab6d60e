#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The module as it was built: it loads, draws a picture and trains for some iterations, in seconds.

The other tests of the package take minutes and run apart; this one runs with every build.
"""

import unittest

import numpy as np

import darb
import support

OPTIONS = {"resolution": 25, "iterations": 6, "sh_degree": 1, "max_splats": 2000, "seed": 3}


class Module(unittest.TestCase):
    def test_it_is_the_one_that_was_built_and_draws(self):
        image, alpha, info = darb.rasterize(**support.splats(), **support.camera())
        self.assertEqual(image.shape, (1, 32, 40, 3))
        self.assertEqual(alpha.shape, (1, 32, 40))
        self.assertGreater(info["visible"].min(), 10)
        self.assertGreater(float(image.max()), 0.05)

    @unittest.skipUnless(support.SHIPPED.exists(), "the shipped scene is not in the tree")
    def test_it_trains_and_draws_what_it_trained(self):
        trainer = darb.Trainer(support.SHIPPED, **OPTIONS)
        first = trainer.step(1)
        last = trainer.step(5)
        self.assertEqual((first["iteration"], last["iteration"], last["done"]), (1, 6, True))
        self.assertTrue(np.isfinite(last["loss"]))
        scene = trainer.scene()
        self.assertGreater(len(scene), 100)
        image, _, _ = scene.render(**support.camera())
        self.assertTrue(np.isfinite(image).all())


if __name__ == "__main__":
    unittest.main()
