#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""darb.Trainer: the bits of `darb train`, a loss of one's own, checkpoints; studies and plans."""

import json
import os
import pathlib
import signal
import subprocess
import tempfile
import threading
import unittest

import support

try:
    import numpy as np

    import darb
except ModuleNotFoundError as error:  # one that is there and does not load fails the test
    support.skip(f"the module is not here: {error}")

SCENE = support.SHIPPED
OPTIONS = {"resolution": 32, "iterations": 24, "sh_degree": 1, "densify_from_iter": 5,
           "densification_interval": 5, "max_splats": 3000, "effects": "+exposure", "seed": 3}


# Of every option that a Trainer takes, but start_checkpoint, a value that is not its default.
OTHER = {
    "schedule": "3dgs", "preset": "preview", "resolution": 40, "eval": True,
    "hold_out": "every:5,arc:3", "images": "./images", "lens": "undistort", "depth_scale": 2.5,
    "kernel": "raised_cosine", "strategy": "mcmc", "start": "random", "effects": "-lens",
    "antialiasing": True, "refine_cameras": "on", "evaluation": "polynomial4",
    "footprint": "exact", "alpha_cutoff": "1/1024", "transmittance_stop": "1e-6",
    "storage": "float16", "depth_order": "centre16", "splat_projection": "auto",
    "arithmetic": "fast16", "iterations": 6, "batch": 2, "seed": 7,
    "max_splats": 900, "max_memory": "1.5GB", "sh_degree": 1, "depth_weight": 0.25,
    "surface_from": 0.25, "distortion_weight": 0.5, "flatness_weight": 0.5,
    "camera_lr": 0.5, "camera_from": 0.25, "camera_anchor": 0.5, "exposure_grid": True,
    "exposure_lr_init": 0.002, "exposure_lr_final": 0.0005, "white_background": True,
    "random_background": False, "resolution_ramp": "off", "lambda_dssim": 0.25,
    "position_lr_init": 0.0003, "position_lr_final": 0.00001, "scaling_lr": 0.004,
    "rotation_lr": 0.002, "opacity_lr": 0.04, "shape_lr": 0.003, "learn_kernel": 3, "kernel_lr": 0.3, "feature_lr": 0.003,
    "sh_rest_every": 2, "average_from": 0.5, "densify_from_iter": 1, "densify_until_iter": 5,
    "densification_interval": 2, "densify_grad_threshold": 0.0003, "percent_dense": 0.02,
    "prune_opacity": 0.01, "opacity_reset_interval": 4, "noise_lr": 1000.0,
    "morton_order": True, "opacity_reg": 0.02, "scale_reg": 0.03, "largest_scale": 0.5,
    "clearance": 0.25, "random_points": 700, "roi": "subject:1.5"}


def words(options):
    return [f"--{name.replace('_', '-')}={value}" for name, value in options.items()]


@unittest.skipUnless(SCENE.exists(), "the shipped scene is not in the tree")
class Training(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = pathlib.Path(self.folder.name)

    def trained(self, **options):
        trainer = darb.Trainer(SCENE, **{**OPTIONS, **options})
        return trainer

    def bytes_of(self, trainer, name="mine.ply"):
        trainer.scene().write(self.path / name)
        return (self.path / name).read_bytes()

    def test_a_budget_that_is_too_small_is_no_room(self):
        with self.assertRaises(darb.NoRoom) as caught:
            self.trained(max_memory="1MB")
        self.assertIsInstance(caught.exception, darb.Error)
        self.assertIsInstance(caught.exception, MemoryError)
        self.assertFalse(issubclass(darb.DeviceLost, MemoryError))
        self.assertTrue(issubclass(darb.DeviceLost, RuntimeError))
        self.assertTrue(caught.exception.hint)

    @unittest.skipUnless(os.path.exists(support.COMMAND), "the command is not built")
    def test_a_run_has_the_bytes_of_darb_train_and_resumes_bit_by_bit(self):
        subprocess.run([support.COMMAND, "train", str(SCENE), "-o", str(self.path / "run"), "-q",
                        "--eval", "--no-report", "--kernel=raised_cosine",
                        *words(OPTIONS)], check=True, capture_output=True)
        want = (self.path / "run/point_cloud/iteration_24/point_cloud.ply").read_bytes()
        rounds = []
        trainer = self.trained(eval=True, kernel="raised_cosine")
        trainer.on_round = rounds.append
        trainer.step(10)
        trainer.checkpoint(self.path / "ten.darb")
        last = trainer.step(100)
        self.assertTrue(last["done"])
        self.assertEqual(last["iteration"], 24)
        self.assertEqual(self.bytes_of(trainer), want)
        self.assertTrue(rounds and rounds[0]["after"] == rounds[0]["before"] +
                        rounds[0]["grown"] - rounds[0]["pruned"], rounds)
        measured = trainer.evaluate()
        self.assertGreater(measured["psnr"], 8)
        self.assertGreater(len(measured["views"]), 1)
        resumed = self.trained(eval=True, kernel="raised_cosine",
                               start_checkpoint=self.path / "ten.darb")
        self.assertEqual(resumed.iteration, 10)
        resumed.step(100)
        self.assertEqual(self.bytes_of(resumed), want)

    @unittest.skipUnless(os.path.exists(support.COMMAND), "the command is not built")
    def test_a_batch_has_the_bytes_of_darb_train(self):
        options = {**OPTIONS, "batch": 4, "iterations": 12}
        subprocess.run([support.COMMAND, "train", str(SCENE), "-o", str(self.path / "run"), "-q",
                        "--no-report", "--kernel=beta", *words(options)], check=True,
                       capture_output=True)
        want = (self.path / "run/point_cloud/iteration_12/point_cloud.ply").read_bytes()
        trainer = darb.Trainer(SCENE, **options, kernel="beta")
        self.assertEqual(trainer.step(5)["iteration"], 8)  # iterations count views
        trainer.checkpoint(self.path / "eight.darb")
        self.assertTrue(trainer.step(4)["done"])
        self.assertEqual(self.bytes_of(trainer), want)
        self.assertGreater(float(np.abs(trainer.scene().shapes).max()), 0)
        resumed = darb.Trainer(SCENE, **options, kernel="beta",
                               start_checkpoint=self.path / "eight.darb")
        resumed.step(4)
        self.assertEqual(self.bytes_of(resumed), want)
        single = darb.Trainer(SCENE, **{**options, "batch": 1}, kernel="beta")
        single.step(12)
        self.assertNotEqual(self.bytes_of(single), want)

    def test_a_loss_of_ones_own_sees_each_view_of_a_batch(self):
        trainer = self.trained(batch=2, iterations=6)
        seen = []

        def loss(image, view):
            seen.append((view["iteration"], view["name"]))
            return np.zeros_like(image)

        trainer.step(3, loss=loss)
        self.assertEqual([i for i, _ in seen], [1, 2, 3, 4])
        self.assertEqual(len({name for _, name in seen}), 4)

    def test_a_loss_of_ones_own_takes_the_place_of_the_built_in_one(self):
        data = darb.Dataset.read(SCENE, resolution=32)
        options = {name: value for name, value in OPTIONS.items() if name != "resolution"}
        trainer = darb.Trainer(data, **options)
        seen = []

        def loss(image, view):
            photo = np.float32(view["photo"][..., :3]) / 255
            self.assertEqual(image.shape, photo.shape)
            seen.append((view["iteration"], float(np.square(image - photo).mean())))
            return 2 / image.size * (image - photo)

        trainer.step(24, loss=loss)
        steps = [i for i, _ in seen]
        self.assertEqual(sorted(set(steps)), list(range(1, 25)))
        self.assertLess(np.mean([m for _, m in seen[-5:]]), np.mean([m for _, m in seen[:5]]))
        trainer = darb.Trainer(data, **options)
        trainer.step(3)
        before = self.bytes_of(trainer)

        def fail(image, view):
            raise KeyError("mine")

        with self.assertRaisesRegex(KeyError, "mine"):
            trainer.step(1, loss=fail)
        self.assertEqual(trainer.iteration, 3)
        self.assertEqual(self.bytes_of(trainer), before)
        with self.assertRaisesRegex(darb.Error, "the loss's gradient: has the shape"):
            trainer.step(1, loss=lambda image, view: image[:3])
        with self.assertRaisesRegex(darb.Error, "a step is under way"):
            trainer.step(1, loss=lambda image, view: trainer.scene())
        trainer.step(1, loss=lambda image, view: np.zeros_like(image))
        self.assertEqual(trainer.iteration, 4)

    @unittest.skipUnless(os.path.exists(support.COMMAND), "the command is not built")
    def test_every_option_comes_to_what_the_command_makes_of_it(self):
        usual = darb.Trainer(SCENE, resolution=32).options
        self.assertEqual(set(OTHER) | {"render_scale", "start_checkpoint", "points"}, set(usual))
        switches = {"random_background": "--fixed-background"}
        for strategy, left_out in (("adc", {"noise_lr", "exposure_grid"}),
                                   ("mcmc", {"schedule", "densify_grad_threshold", "percent_dense",
                                             "opacity_reset_interval"})):
            options = {**OTHER, "strategy": strategy}
            options = {name: v for name, v in options.items() if name not in left_out}
            given = words({n: v for n, v in options.items() if not isinstance(v, bool)})
            given += [switches.get(n, "--" + n.replace("_", "-")) for n, v in options.items()
                      if isinstance(v, bool)]
            out = self.path / strategy
            subprocess.run([support.COMMAND, "train", str(SCENE), "-o", str(out), "-q",
                            "--no-report", *given], check=True, capture_output=True)
            request = json.loads((out / "request.json").read_text())
            saved = {n.replace("-", "_"): v for part in ("accuracy", None, "data", "train")
                     for n, v in (request[part] if part else request).items()
                     if not isinstance(v, dict)}
            asked = darb.Trainer(SCENE, **options).options
            for name, value in asked.items():
                with self.subTest(name, strategy=strategy):
                    self.assertEqual(value, saved[name])
            changed = {name for name in options if asked[name] != usual[name]}
            self.assertEqual(set(options) - changed,
                             {"strategy"} if strategy == "adc" else set())

    def test_a_switch_is_turned_off_by_false_and_an_option_left_out_by_none(self):
        options = self.trained(eval=False, random_background=False, kernel=None).options
        self.assertIs(options["eval"], False)
        self.assertIs(options["random_background"], False)
        self.assertEqual(options["kernel"], "gaussian")

    def test_a_kernel_of_ones_own_trains(self):
        cubic = darb.Kernel(lambda q: (1 - q / 9) ** 3, support=9, name="trained_cubic")
        trainer = self.trained(kernel=cubic)
        first = trainer.step(1)["loss"]
        last = trainer.step(23)
        self.assertTrue(np.isfinite([first, last["loss"]]).all())
        self.assertEqual(trainer.scene().kernel, "trained_cubic")

    def test_ctrl_c_ends_a_step_between_two_iterations(self):
        trainer = self.trained(iterations=30000)
        trainer.step(2)
        threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
        with self.assertRaises(KeyboardInterrupt):
            trainer.step(29000)
        at = trainer.iteration
        self.assertTrue(2 < at < 29000)
        self.assertEqual(trainer.step(1)["iteration"], at + 1)

    def test_points_of_a_file_are_where_it_starts(self):
        few = self.path / "few.ply"
        start = self.trained().scene()
        place = start.means[:5] + np.array(start.origin)
        few.write_text("ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
                       "property float z\nend_header\n"
                       + "".join("{} {} {}\n".format(*p) for p in place))
        self.assertEqual(len(self.trained(points=few).scene()), 5)
        read = darb.Dataset.read(SCENE, resolution=32)
        self.assertEqual(len(darb.Trainer(read, points=few).scene()), 5)
        with self.assertRaisesRegex(darb.Error, "none.ply"):
            self.trained(points=self.path / "none.ply")

    def test_mistakes_are_errors_of_the_command(self):
        for text, options in (("--kernel foo: no such kernel", {"kernel": "foo"}),
                              ("--iterations", {"iterations": -5}),
                              ("--no-such: is no option of training", {"no_such": 1}),
                              ("output: is an option of the command alone", {"output": "x"}),
                              ("model_path: is an option of the command", {"model_path": "x"}),
                              ("view: is an option of the command alone", {"view": True}),
                              ("drop_outside: is an option of the command alone",
                               {"roi": "subject", "drop_outside": True}),
                              ("clean_haze: is an option of the command", {"clean_haze": "0.1,5"}),
                              ("kernel: is of the type bool", {"kernel": True}),
                              ("--seed: has an empty value", {"seed": ""}),
                              ("strategy", {"strategy": "none"}),
                              ("noise.lr.*means nothing", {"noise_lr": 3.0}),
                              ("iterations: is of the type numpy.ndarray, no whole number",
                               {"iterations": np.zeros((2, 3))}),
                              ("lambda_dssim: is of the type object", {"lambda_dssim": object()})):
            with self.subTest(text), self.assertRaisesRegex(darb.Error, text):
                self.trained(**options)
        with self.assertRaisesRegex(darb.Error, "nowhere"):
            darb.Trainer("nowhere")
        data = darb.Dataset.read(SCENE, resolution=32)
        with self.assertRaisesRegex(darb.Error, "resolution: is given beside a Dataset"):
            darb.Trainer(data, resolution=4)
        with self.assertRaisesRegex(darb.Error, "no view is held out"):
            darb.Trainer(data, iterations=5).evaluate()


@unittest.skipUnless(SCENE.exists(), "the shipped scene is not in the tree")
class Data(unittest.TestCase):
    def test_a_data_set_has_cameras_photos_and_points(self):
        data = darb.Dataset.read(SCENE, resolution=64, eval=True)
        self.assertEqual(data.viewmats.shape, (len(data), 4, 4))
        self.assertEqual(data.Ks.shape, (len(data), 3, 3))
        view, photo = data.view(0), data.photo(0)
        self.assertEqual(photo.shape, (view["height"], view["width"], 4))
        self.assertEqual(photo.dtype, np.uint8)
        self.assertEqual(data.points.shape, data.point_colors.shape)
        self.assertGreater(sum(data.view(i)["is_test"] for i in range(len(data))), 1)
        np.testing.assert_array_equal(data.view(-1)["viewmat"], data.viewmats[-1])
        with self.assertRaisesRegex(darb.Error, "view: is 1000"):
            data.photo(1000)

    def test_a_plan_says_which_effects_are_called_for(self):
        rows = darb.plan(SCENE, resolution=32)
        self.assertTrue(any(row["on"] for row in rows))
        self.assertTrue(all(row["reason"] for row in rows))
        with self.assertRaisesRegex(darb.Error, "fog"):
            darb.plan(SCENE, effects="+fog")


class Studies(unittest.TestCase):
    def test_psi_is_the_ratio_of_moments(self):
        result = darb.psi(["gaussian", "raised_cosine"], samples=2, cells=16)
        self.assertAlmostEqual(result["kernels"][0]["exact"], 1, places=9)
        self.assertLess(result["kernels"][1]["exact"], 1)
        with self.assertRaisesRegex(darb.Error, "kernels foo"):
            darb.psi("foo")

    def test_sim1d_fits_signals(self):
        result = darb.sim1d(signals="gaussian", kernels=["gaussian", "generalised_exponential"],
                            primitives=[1, 2], seeds=2, steps=200, samples=64)
        self.assertEqual([r["primitives"] for r in result["rows"]], [1, 2, 1, 2])
        self.assertLess(result["rows"][0]["loss"]["median"], 0.05)
        own = darb.Kernel(lambda q: (1 - q / 9) ** 2, support=9, name="own_of_sim1d")
        rows = darb.sim1d(signals="parabolic", kernels=[own, "beta", "generalised_exponential"],
                          primitives=1, seeds=2, steps=400, samples=64)["rows"]
        self.assertEqual([r["kernel"] for r in rows],
                         ["own_of_sim1d", "beta", "generalised_exponential"])
        self.assertEqual(len({r["loss"]["median"] for r in rows}), 3)
        self.assertLess(max(r["loss"]["median"] for r in rows), 0.1)
        with self.assertRaisesRegex(darb.Error, "seeds: is 0"):
            darb.sim1d(seeds=0)

    def test_devices_are_listed(self):
        devices = darb.devices()
        self.assertTrue(any(d["usable"] for d in devices))
        self.assertIn(darb.device().name, [d["name"] for d in devices])


if __name__ == "__main__":
    unittest.main(verbosity=1)
