#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""darb.rasterize and its gradients against the double reference; scenes; what is refused."""

import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
import unittest

import support

try:
    import numpy as np

    import darb
except ModuleNotFoundError as error:  # one that is there and does not load fails the test
    support.skip(f"the module is not here: {error}")
from support import camera, relative, rms, shapes, splats, weights

INPUTS = ("means", "quats", "scales", "opacities")


def reference(arrays, pictures, d_image, d_alpha, **options):
    names = dict.fromkeys(("colors", "sh", "shapes", "kernel", "footprint", "background",
                           "sh_degree", "antialiased"))
    settings = {"near": 0.2, "accuracy": "balanced", "depth": False}
    return darb._darb.reference({**names, **settings, **arrays, **pictures, **options}, d_image,
                                d_alpha)


class Rasterize(unittest.TestCase):
    def test_pictures_and_gradients_are_those_of_the_double_reference(self):
        for kernel, footprint, sh in (("gaussian", "psi", None), ("raised_cosine", "psi", 16),
                                      ("half_cosine_squared", "exact", 4)):
            with self.subTest(kernel=kernel, footprint=footprint):
                pictures, arrays = camera(count=2), splats(sh=sh)
                d_image, d_alpha = weights(pictures)
                options = {"kernel": kernel, "footprint": footprint,
                           "background": np.array([0.2, 0.5, 0.7], np.float32)}
                image, alpha, info = darb.rasterize(**arrays, **pictures, **options)
                self.assertEqual(image.shape, (2, 32, 40, 3))
                self.assertEqual(alpha.shape, (2, 32, 40))
                self.assertGreater(info["visible"].min(), 10)
                truth, true_alpha, d_true = reference(arrays, pictures, d_image, d_alpha, **options)
                self.assertLess(relative(image, truth), 2e-5)
                self.assertLess(relative(alpha, true_alpha), 2e-5)
                d = darb.rasterize_backward(d_image, d_alpha, **arrays, **pictures, **options)
                for name in INPUTS + ("backgrounds",) + (("shapes",) if kernel == "beta" else ()):
                    self.assertLess(relative(d[name], d_true[name]), 2e-3, name)
                colours = d["colors"] if sh is None else d["sh"][:, 0]
                self.assertLess(
                    relative(colours, d_true["colors" if sh is None else "sh_dc"]), 2e-3)
                self.assertEqual(d["not_finite"], 0)

    def test_gradients_are_central_differences_for_every_input(self):
        pictures, arrays = camera(), splats(count=12, sh=4)
        arrays["background"] = np.array([0.3, 0.6, 0.1], np.float32)
        d_image, d_alpha = weights(pictures)
        d = darb.rasterize_backward(d_image, d_alpha, **arrays, **pictures, camera=True)
        d["background"] = d["backgrounds"].sum(0)

        def loss(**changed):
            image, alpha, _ = darb.rasterize(**{**arrays, **pictures, **changed})
            return (np.float64(image) * d_image).sum() + (np.float64(alpha) * d_alpha).sum()

        rng = np.random.default_rng(5)
        for name, step in (("means", 4e-3), ("quats", 1e-2), ("scales", 4e-3), ("opacities", 1e-2),
                           ("sh", 1e-2), ("background", 1e-2)):
            # Along the gradient, where it is large against what leaves at a cut-off, and askew.
            value = arrays[name]
            u = d[name] / rms(d[name]) + 0.5 * rng.normal(size=value.shape)
            u = (u / rms(u) * step).astype(np.float32)
            difference = (loss(**{name: value + u}) - loss(**{name: value - u})) / 2
            wanted = float((np.float64(d[name]) * u).sum())
            self.assertLess(abs(difference - wanted), 0.03 * abs(wanted) + 0.02, name)
        self.camera_differences(pictures, d, loss)

    def test_gradients_of_shapes_are_central_differences(self):
        pictures = {**camera(), "kernel": "beta", "accuracy": "exact"}
        arrays = {**splats(count=12), "shapes": shapes(12)}
        d_image, d_alpha = weights(pictures)
        for footprint in ("psi", "exact"):
            d = darb.rasterize_backward(d_image, d_alpha, **arrays, **pictures, footprint=footprint)

            def loss(value):
                image, alpha, _ = darb.rasterize(**{**arrays, "shapes": value}, **pictures,
                                                 footprint=footprint)
                return (np.float64(image) * d_image).sum() + (np.float64(alpha) * d_alpha).sum()

            u = (d["shapes"] / rms(d["shapes"]) * 1e-2).astype(np.float32)
            difference = (loss(arrays["shapes"] + u) - loss(arrays["shapes"] - u)) / 2
            wanted = float((np.float64(d["shapes"]) * u).sum())
            self.assertLess(abs(difference - wanted), 0.02 * abs(wanted) + 1e-3, footprint)

    def test_shapes_are_0_where_none_are_given(self):
        pictures, arrays = camera(), splats()
        image = darb.rasterize(**arrays, **pictures, kernel="beta")[0]
        given = darb.rasterize(**arrays, **pictures, kernel="beta", shapes=np.zeros(24, np.float32))
        np.testing.assert_array_equal(image, given[0])
        self.assertGreater(relative(darb.rasterize(**arrays, **pictures, kernel="beta",
                                                   shapes=shapes())[0], image), 0.01)

    def camera_differences(self, pictures, d, loss):
        h = 2e-3
        for axis in range(3):
            generator = np.zeros((4, 4))
            j, k = (axis + 1) % 3, (axis + 2) % 3
            generator[k, j], generator[j, k] = 1, -1
            turned = []
            for sign in (1, -1):
                turn = np.eye(4)
                turn[j, j] = turn[k, k] = np.cos(h)
                turn[k, j], turn[j, k] = sign * np.sin(h), -sign * np.sin(h)
                turned.append(turn @ pictures["viewmats"])
            difference = (loss(viewmats=turned[0]) - loss(viewmats=turned[1])) / (2 * h)
            wanted = float((d["viewmats"] * (generator @ pictures["viewmats"])).sum())
            self.assertLess(abs(difference - wanted), 0.03 * abs(wanted) + 1.5, f"axis {axis}")
            moved = np.zeros((1, 4, 4))
            moved[0, axis, 3] = h
            difference = (loss(viewmats=pictures["viewmats"] + moved) -
                          loss(viewmats=pictures["viewmats"] - moved)) / (2 * h)
            wanted = float(d["viewmats"][0, axis, 3])
            self.assertLess(abs(difference - wanted), 0.03 * abs(wanted) + 1.5, f"along {axis}")
        for row, column in ((0, 0), (1, 1), (0, 2), (1, 2)):
            moved = np.zeros((1, 3, 3))
            moved[0, row, column] = 0.05
            difference = (loss(Ks=pictures["Ks"] + moved) - loss(Ks=pictures["Ks"] - moved)) / 0.1
            wanted = float(d["Ks"][0, row, column])
            self.assertLess(abs(difference - wanted), 0.03 * abs(wanted) + 0.3, f"K {row} {column}")

    def test_colours_are_taken_as_they_are(self):
        pictures, arrays = camera(), splats()
        image = darb.rasterize(**arrays, **pictures)[0]
        arrays["colors"] = -arrays["colors"]
        self.assertLess(relative(darb.rasterize(**arrays, **pictures)[0], -image), 1e-6)

    def test_several_cameras_are_the_single_ones(self):
        pictures, arrays = camera(count=3), splats()
        together = darb.rasterize(**arrays, **pictures, depth=True)
        for c in range(3):
            one = {**pictures, "viewmats": pictures["viewmats"][c:c + 1],
                   "Ks": pictures["Ks"][c:c + 1]}
            image, alpha, info = darb.rasterize(**arrays, **one, depth=True)
            np.testing.assert_array_equal(image[0], together[0][c])
            np.testing.assert_array_equal(alpha[0], together[1][c])
            np.testing.assert_array_equal(info["depth"][0], together[2]["depth"][c])
        depth = together[2]["depth"]
        self.assertTrue(((depth == 0) | ((depth > 2) & (depth < 6))).all())
        self.assertGreater((depth > 0).mean(), 0.2)

    def test_no_splats_are_the_background(self):
        none = {name: value[:0] for name, value in splats().items()}
        image, alpha, info = darb.rasterize(**none, **camera(), background=(0.25, 0.5, 1))
        self.assertEqual(info["visible"][0], 0)
        np.testing.assert_array_equal(image[0, 3, 4], np.float32([0.25, 0.5, 1]))
        self.assertEqual(float(alpha.max()), 0)

    def test_buffers_and_dlpack_are_taken_without_numpy(self):
        pictures, arrays = camera(), splats()
        image = darb.rasterize(**arrays, **pictures)[0]

        class Exporter:
            def __init__(self, array):
                self.array = array

            def __dlpack__(self, **_):
                return self.array.__dlpack__()

            def __dlpack_device__(self):
                return (1, 0)

        for wrap in (memoryview, Exporter):
            with self.subTest(wrap=wrap.__name__):
                given = {name: wrap(value) for name, value in arrays.items()}
                np.testing.assert_array_equal(darb.rasterize(**given, **pictures)[0], image)


class Scenes(unittest.TestCase):
    def scene(self, **options):
        arrays = splats(count=60, sh=4)
        return darb.Scene.from_arrays(**arrays, **options)

    def test_other_arrays_of_as_many_splats_are_drawn_as_given(self):
        for coefficients in (1, 4, 9, 16):
            for count in (1, 23, 4100):  # beyond a piece of what one thread writes
                for seed in (1, 2):
                    arrays = splats(count, seed, sh=coefficients)
                    drawn = darb.rasterize(**arrays, **camera())
                    of_model = darb.rasterize(darb.Scene.from_arrays(**arrays), **camera())
                    self.assertLess(relative(drawn[0], of_model[0]), 1e-3,
                                    f"{coefficients} coefficients, {count} splats, call {seed}")

    def test_a_scene_is_drawn_as_its_arrays_and_stays_on_the_device(self):
        scene, pictures = self.scene(), camera(count=2)
        image, alpha, _ = scene.render(**pictures)
        by_arrays = darb.rasterize(**splats(count=60, sh=4), **pictures)
        self.assertLess(relative(image, by_arrays[0]), 1e-5)
        self.assertLess(relative(alpha, by_arrays[1]), 1e-5)
        np.testing.assert_array_equal(image, darb.rasterize(scene, **pictures)[0])
        d_image, d_alpha = weights(pictures)
        d = darb.rasterize_backward(d_image, d_alpha, means=scene, **pictures)
        want = darb.rasterize_backward(d_image, d_alpha, **splats(count=60, sh=4), **pictures)
        self.assertLess(relative(d["means"], want["means"]), 1e-3)
        self.assertLess(relative(d["log_scales"], want["scales"] * np.exp(scene.log_scales)), 1e-3)

    def test_an_assigned_attribute_counts_from_the_next_picture_on(self):
        scene, pictures = self.scene(), camera()
        before = scene.render(**pictures)[0]
        looked_at = scene.means
        with self.assertRaises(ValueError):
            looked_at[0, 0] = 3
        scene.means = looked_at + np.float32(0.1)
        after = scene.render(**pictures)[0]
        self.assertGreater(relative(after, before), 0.01)
        scene.means = scene.means - np.float32(0.1)
        self.assertLess(relative(scene.render(**pictures)[0], before), 1e-4)
        scene.kernel = "raised_cosine"
        self.assertGreater(relative(scene.render(**pictures)[0], before), 0.001)
        del scene
        self.assertTrue(np.isfinite(looked_at).all(), "a look keeps the scene alive")

    def test_shapes_are_an_attribute_of_the_kernel_beta(self):
        given = splats(count=60, sh=4)
        scene = darb.Scene.from_arrays(**given, kernel="beta", shapes=shapes(60))
        pictures = camera()
        np.testing.assert_array_equal(scene.shapes, shapes(60))
        by_arrays = darb.rasterize(**given, shapes=shapes(60), kernel="beta", **pictures)[0]
        self.assertLess(relative(scene.render(**pictures)[0], by_arrays), 1e-5)
        scene.shapes = scene.shapes * 0
        start = darb.rasterize(**given, kernel="beta", **pictures)[0]
        self.assertLess(relative(scene.render(**pictures)[0], start), 1e-5)
        d_image, d_alpha = weights(pictures)
        d = darb.rasterize_backward(d_image, d_alpha, means=scene, **pictures)
        self.assertEqual(d["shapes"].shape, (60,))
        self.assertGreater(rms(d["shapes"]), 0)
        looked_at = scene.shapes
        with tempfile.TemporaryDirectory() as folder:
            scene.shapes = shapes(60)
            scene.write(f"{folder}/beta.ply")
            again = darb.Scene.read(f"{folder}/beta.ply")
            self.assertEqual(again.kernel, "beta")
            np.testing.assert_array_equal(again.shapes, shapes(60))
        scene.kernel = "gaussian"
        self.assertIsNone(scene.shapes)
        with self.assertRaisesRegex(darb.Error, "shapes: has no place in the kernel gaussian"):
            scene.shapes = shapes(60)
        scene.kernel = "beta"
        np.testing.assert_array_equal(scene.shapes, np.zeros(60, np.float32))
        np.testing.assert_array_equal(looked_at, scene.shapes, "a look stays one")
        self.assertLess(relative(scene.render(**pictures)[0], start), 1e-5)

    def test_files_come_back_as_they_were_written(self):
        scene = self.scene(kernel="raised_cosine")
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "scene.ply"
            scene.write(path)
            again = darb.Scene.read(str(path))
            for name in ("means", "log_scales", "quats", "opacity_logits", "sh_dc", "sh_rest"):
                np.testing.assert_array_equal(getattr(again, name), getattr(scene, name))
            self.assertEqual((again.kernel, again.footprint, again.sh_degree, len(again)),
                             ("raised_cosine", "psi", 1, 60))
            with self.assertRaisesRegex(darb.Error, "no splat file that can be written"):
                scene.write(pathlib.Path(folder) / "scene.txt")
        with self.assertRaisesRegex(darb.Error, "not_there"):
            darb.Scene.read("not_there.ply")

    def test_a_notebook_shows_a_picture(self):
        png = self.scene()._repr_png_()
        self.assertEqual(png[:8], b"\x89PNG\r\n\x1a\n")
        self.assertGreater(len(png), 1000)

    def test_a_frame_has_the_bits_of_darb_render(self):
        if not os.path.exists(support.COMMAND):
            self.skipTest("the command is not built")
        scene = self.scene()
        pictures = camera(width=64, height=48, focal=70.0)
        with tempfile.TemporaryDirectory() as folder:
            scene.write(f"{folder}/scene.ply")
            view = pictures["viewmats"][0].astype(np.float64)
            rotation, centre = view[:3, :3].T, -view[:3, :3].T @ view[:3, 3]
            import json
            K = pictures["Ks"][0].astype(np.float64)
            entry = {"id": 0, "img_name": "a", "width": 64, "height": 48,
                     "position": centre.tolist(), "rotation": rotation.tolist(),
                     "fx": K[0, 0], "fy": K[1, 1], "cx": K[0, 2], "cy": K[1, 2]}
            pathlib.Path(f"{folder}/cameras.json").write_text(json.dumps([entry]))
            views = darb.cameras(f"{folder}/cameras.json")
            for words, options in (
                    ((), {}), (("--accuracy", "exact", "-w"),
                               {"accuracy": "exact", "background": (1, 1, 1)}),
                    (("--accuracy", "fast", "--near", "3.6"), {"accuracy": "fast", "near": 3.6}),
                    (("--sh-degree", "0"), {"sh_degree": 0})):
                with self.subTest(words):
                    subprocess.run([support.COMMAND, "render", f"{folder}/scene.ply", "--cameras",
                                    f"{folder}/cameras.json", "-o", f"{folder}/out", *words],
                                   check=True, capture_output=True)
                    darb.write_png(f"{folder}/mine.png", scene.render(
                        views["viewmats"], views["Ks"], 64, 48, **options)[0][0])
                    self.assertEqual(pathlib.Path(f"{folder}/mine.png").read_bytes(),
                                     pathlib.Path(f"{folder}/out/a.png").read_bytes())


class Kernels(unittest.TestCase):
    def test_a_kernel_of_ones_own_is_drawn_as_its_profile(self):
        # The parabolic kernel of the family by its own profile: the same picture.
        own = darb.Kernel(lambda q: 1 - q / 5, support=5, name="own_parabola")
        self.assertAlmostEqual(own(2.5), 0.5, places=6)
        self.assertEqual((own.name, own.support), ("own_parabola", 5))
        self.assertLess(own.error, 1e-5)
        cubic = darb.Kernel(lambda q: (1 - q / 9) ** 3, support=9, name="own_cubic")
        pictures, arrays = camera(), splats()
        d_image, d_alpha = weights(pictures)
        image, _, _ = darb.rasterize(**arrays, **pictures, kernel=cubic)
        truth, _, d_true = reference(arrays, pictures, d_image, d_alpha, kernel=cubic)
        self.assertLess(relative(image, truth), 2e-4)
        d = darb.rasterize_backward(d_image, d_alpha, **arrays, **pictures, kernel=cubic)
        for name in INPUTS:
            self.assertLess(relative(d[name], d_true[name]), 3e-3, name)
        self.assertGreater(relative(image, darb.rasterize(**arrays, **pictures)[0]), 0.01)
        self.assertIn("own_cubic", darb.kernel_names())
        self.assertIn("beta", darb.kernel_names())
        np.testing.assert_array_equal(
            image, darb.rasterize(**arrays, **pictures, kernel="own_cubic")[0])
        scene = darb.Scene.from_arrays(**splats(sh=1), kernel=cubic)
        with tempfile.TemporaryDirectory() as folder:
            scene.write(f"{folder}/own.ply")
            self.assertEqual(darb.Scene.read(f"{folder}/own.ply").kernel, "own_cubic")

    def test_what_is_no_kernel_is_told(self):
        for text, profile, support in (
                ("profile: is of the type int", 3, 9), ("support: is -1", lambda q: 1 - q, -1),
                ("profile: is None, no number", lambda q: None, 9),
                ("", lambda q: q, 9), ("", lambda q: float("nan"), 9)):
            with self.subTest(text), self.assertRaisesRegex(darb.Error, text):
                darb.Kernel(profile, support)

        def fails(q):
            raise KeyError("mine")

        with self.assertRaisesRegex(KeyError, "mine"):
            darb.Kernel(fails, 9)


class Meshes(unittest.TestCase):
    """Scene.mesh, on a ball of flat splats that cameras look at from all sides."""

    COUNT = 1500

    @classmethod
    def setUpClass(cls):
        y = 1 - (2 * np.arange(cls.COUNT) + 1) / cls.COUNT
        a, r = 2.39996323 * np.arange(cls.COUNT), np.sqrt(1 - y * y)
        p = np.stack([r * np.cos(a), y, r * np.sin(a)], 1).astype(np.float32)
        length = np.sqrt(2 * (1 + p[:, 2]))
        quats = np.stack([(1 + p[:, 2]) / length, -p[:, 1] / length, p[:, 0] / length,
                          0 * length], 1).astype(np.float32)
        scales = np.tile(np.float32([0.05, 0.05, 0.002]), (cls.COUNT, 1))
        cls.scene = darb.Scene.from_arrays(p, quats, scales, np.full(cls.COUNT, 0.99, np.float32),
                                           sh=p[:, None, :])
        views = []
        for i in range(14):
            h = 1 - (2 * i + 1) / 14
            forward = -np.array([np.sqrt(1 - h * h) * np.cos(2.39996323 * i), h,
                                 np.sqrt(1 - h * h) * np.sin(2.39996323 * i)])
            right = np.cross([0.1, 1, 0.05], forward)
            right /= np.linalg.norm(right)
            view = np.eye(4)
            view[:3, :3] = [right, np.cross(forward, right), forward]
            view[2, 3] = 3.4
            views.append(view)
        K = np.array([[110.0, 0, 48], [0, 110, 48], [0, 0, 1]])
        cls.cameras = {"viewmats": np.array(views), "Ks": np.repeat(K[None], 14, 0), "width": 96,
                       "height": 96}

    def test_is_the_ball_and_has_its_colours(self):
        vertices, faces, colours, info = self.scene.mesh(**self.cameras, voxel=0.1, fill_holes=2)
        self.assertEqual(vertices.dtype, np.float64)
        self.assertEqual(faces.dtype, np.uint32)
        self.assertEqual(colours.shape, vertices.shape)
        self.assertEqual(len(faces), 2 * len(vertices) - 4, "closed")
        self.assertLess(np.abs(np.linalg.norm(vertices, axis=1) - 1).max(), 0.1)
        corners = vertices[faces]
        outwards = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self.assertGreater(((outwards * corners[:, 0]).sum(1) > 0).mean(), 0.99)
        expected = 255 * np.clip(0.5 + 0.2820948 * vertices, 0, 1)
        self.assertLess(np.median(np.abs(colours - expected)), 6)
        self.assertEqual((info["voxel"], info["views"]), (0.1, 14))
        self.assertEqual(info["normals"].shape, vertices.shape)

    def test_has_pages_or_no_colours_as_asked(self):
        _, faces, colours, info = self.scene.mesh(**self.cameras, voxel=0.1, texture="splats")
        self.assertIsNone(colours)
        self.assertEqual(info["uv"].shape, (len(faces), 3, 2))
        self.assertEqual(info["page"].max(), len(info["pages"]) - 1)
        self.assertTrue(0 <= info["uv"].min() and info["uv"].max() <= 1)
        _, few, colours, _ = self.scene.mesh(**self.cameras, voxel=0.1, texture="none",
                                             bounds=(0, -2, -2, 2, 2, 2))
        self.assertIsNone(colours)
        self.assertLess(len(few), 0.6 * len(faces))

    def test_a_collider_is_closed_and_a_file_is_a_reference(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "ball.obj"
            vertices, faces, _, info = self.scene.mesh(collider="object", voxel=0.05, faces=600,
                                                       output=path)
            self.assertTrue(info["closed"])
            self.assertLessEqual(len(faces), 600)
            _, _, _, info = self.scene.mesh(**self.cameras, voxel=0.1, texture="none",
                                            reference=path, align="similarity", thresholds=[0.1])
            self.assertEqual(info["alignment"].shape, (4, 4))
            self.assertLess(info["comparison"]["chamfer"], 0.05)
            self.assertGreater(info["comparison"]["f_scores"][0][3], 0.95)

    def test_what_is_wrong_is_told(self):
        for options, said in (({"depth": "deep"}, "no such reading"),
                              ({"texture": "photos"}, "there are no photos"),
                              ({"seams": "blend"}, "no such way"),
                              ({"texture": "splats", "seams": "keep"}, "only photos have seams"),
                              ({"bounds": (1, 1, 1, 0, 2, 2)}, "hold nothing"),
                              ({"bounds": (1, 2, 3)}, "has 3 numbers"),
                              ({"align": "rigid"}, "without a reference"),
                              ({"collider": "cave"}, "no such kind"),
                              ({"collider": "room"}, "a place within it"),
                              ({"output": "ball.stl"}, "no ending of a mesh"),
                              ({"viewmats": self.cameras["viewmats"]}, "is missing beside"),
                              ({"cameras": "nowhere"}, "nowhere")):
            with self.assertRaisesRegex(darb.Error, said):
                self.scene.mesh(**options)


class Refused(unittest.TestCase):
    """Every mistake is an exception that names the argument and the reason."""

    def refuse(self, text, **changed):
        with self.assertRaises(darb.Error) as caught:
            darb.rasterize(**{**splats(), **camera(), **changed})
        self.assertRegex(str(caught.exception), text)
        self.assertTrue(caught.exception.where and caught.exception.reason)
        self.assertIsInstance(caught.exception, ValueError)

    def test_of_splats(self):
        a = splats()
        nan = a["means"].copy()
        nan[3, 1] = np.nan
        strided = np.zeros((24, 8), np.float32)[:, ::2]
        unaligned = np.frombuffer(bytes(24 * 16 + 1), np.uint8)[1:].view(np.float32)
        for text, changed in (
                (r"means: has the shape \(24, 4\), not \(any, 3\)", {"means": a["quats"]}),
                (r"quats: has the shape \(10, 4\), not \(24, 4\)", {"quats": a["quats"][:10]}),
                ("means: is of float64, not float32", {"means": np.float64(a["means"])}),
                ("means: is of >f4", {"means": a["means"].astype(">f4")}),
                ("scales: is of int32", {"scales": np.ones((24, 3), np.int32)}),
                ("scales: is of object", {"scales": np.ones((24, 3), object)}),
                ("means: is not in C order", {"means": np.asfortranarray(a["means"])}),
                ("quats: is not in C order", {"quats": strided}),
                ("quats: is not in C order", {"quats": unaligned.reshape(24, 4)}),
                (r"means: is nan at \[3, 1\]", {"means": nan}),
                ("means: is of the type list, no array", {"means": [[0, 0, 0]]}),
                ("scales: is None, no array", {"scales": None}),
                (r"scales: is -1 at \[0, 0\]\n.*not logarithms", {"scales": -a["scales"] * 0 - 1}),
                (r"opacities: is 2 at \[0\]\n.*not logits", {"opacities": a["opacities"] * 0 + 2}),
                ("colors and sh: are both given", {"sh": np.zeros((24, 1, 3), np.float32)}),
                ("colors and sh: are both left out", {"colors": None}),
                ("shapes: are given to the kernel gaussian", {"shapes": shapes()}),
                (r"shapes: has the shape \(3,\), not \(24,\)", {"kernel": "beta",
                                                                "shapes": shapes(3)}),
                (r"shapes: is nan at \[5\]", {"kernel": "beta", "shapes": np.where(
                    np.arange(24) == 5, np.float32("nan"), shapes())}),
                ("sh: has 5 coefficients", {"colors": None,
                                            "sh": np.zeros((24, 5, 3), np.float32)})):
            with self.subTest(text):
                self.refuse(text, **changed)

    def test_of_values_in_a_later_call_where_they_are_checked_while_they_are_copied(self):
        for sh in (None, 9):
            arrays = splats(count=3000, seed=5, sh=sh)
            image = darb.rasterize(**arrays, **camera())[0]
            for name, wrong in (("means", np.nan), ("quats", np.inf), ("scales", -1e-9),
                                ("scales", np.nan), ("opacities", 1.0001), ("opacities", -1e-9),
                                ("sh" if sh else "colors", -np.inf),
                                ("sh" if sh else "colors", np.nan)):
                for at in (0, 128, 2999):
                    values = arrays[name].copy()
                    values.reshape(3000, -1)[at, -1] = wrong
                    with self.subTest(name, wrong=wrong, at=at):
                        with self.assertRaisesRegex(darb.Error, rf"{name}: is \S+ at \[{at}\b"):
                            darb.rasterize(**{**arrays, name: values}, **camera())
            np.testing.assert_array_equal(darb.rasterize(**arrays, **camera())[0], image)

    def test_of_cameras_and_settings(self):
        view, K = camera()["viewmats"], camera()["Ks"]
        mirror = view.copy()
        mirror[0, 0] *= -1
        for text, changed in (
                (r"viewmats: has the shape \(4, 4\)", {"viewmats": view[0]}),
                (r"viewmats\[0\]: is no rotation", {"viewmats": mirror}),
                (r"viewmats\[0\]: is no rotation", {"viewmats": view * 2}),
                ("viewmats: has inf", {"viewmats": view + np.inf}),
                ("viewmats: holds no camera", {"viewmats": view[:0], "Ks": K[:0]}),
                (r"Ks: has the shape \(1, 3, 3\), not \(2", {"viewmats": np.repeat(view, 2, 0)}),
                (r"Ks\[0\]: is no pinhole", {"Ks": -K}),
                ("width: is 0", {"width": 0}),
                ("width: is of the type float", {"width": 4.5}),
                ("height: is 99999999999", {"height": 99999999999}),
                ("frame of", {"width": 1 << 20, "height": 1 << 20}),
                ("kernel foo: no such kernel\n.*raised_cosine", {"kernel": "foo"}),
                ("kernel: is of the type int", {"kernel": 3}),
                ("footprint big: no such", {"footprint": "big"}),
                ("accuracy good: no such preset", {"accuracy": "good"}),
                ("near: is -1", {"near": -1}),
                ("sh_degree: is 7", {"sh_degree": 7}),
                ("antialiased: is of the type int", {"antialiased": 1}),
                (r"background: has the shape \(2,\)", {"background": np.zeros(2, np.float32)}),
                ("background: is of the type str, no number", {"background": ("a", 1, 2)}),
                ("depth: is not there with accuracy fast", {"depth": True, "accuracy": "fast"})):
            with self.subTest(text):
                self.refuse(text, **changed)
        with self.assertRaisesRegex(darb.Error, "nowhere"):
            darb.device("nowhere")
        with self.assertRaises(TypeError):
            darb.rasterize(**splats(), **camera(), colours=1)

    def test_of_other_devices_and_released_memory(self):
        class Elsewhere:
            def __dlpack__(self, **_):
                raise AssertionError("not asked for")

            def __dlpack_device__(self):
                return (2, 0)

        self.refuse("means: lies on another device", means=Elsewhere())
        released = memoryview(splats()["means"])
        released.release()
        self.refuse("means: .*released", means=released)

    def test_of_gradients(self):
        pictures, arrays = camera(), splats()
        d_image, d_alpha = weights(pictures)
        d_image[0, 3, 2, 1] = np.inf
        with self.assertRaisesRegex(darb.Error, r"inf at pixel \(2, 3\), channel 1"):
            darb.rasterize_backward(d_image, d_alpha, **arrays, **pictures)
        with self.assertRaisesRegex(darb.Error, "d_alpha: has the shape"):
            darb.rasterize_backward(d_image, d_alpha[:, :4], **arrays, **pictures)

    def test_a_scene_takes_no_arrays_beside_it(self):
        scene = darb.Scene.from_arrays(**splats(sh=1))
        with self.assertRaisesRegex(darb.Error, "quats: is given beside a Scene"):
            darb.rasterize(scene, splats()["quats"], **camera())
        with self.assertRaisesRegex(darb.Error, r"means: has the shape \(3, 3\), not \(24, 3\)"):
            scene.means = np.zeros((3, 3), np.float32)


class Processes(unittest.TestCase):
    def python(self, code, **options):
        return subprocess.run([sys.executable, "-c", textwrap.dedent(code)], text=True,
                              capture_output=True, timeout=300, check=False,
                              cwd=pathlib.Path(__file__).parent, **options)

    def test_threads_share_a_device(self):
        pictures, arrays = camera(), splats()
        want = darb.rasterize(**arrays, **pictures)[0]
        wrong = []

        def work():
            for _ in range(10):
                if not np.array_equal(darb.rasterize(**arrays, **pictures)[0], want):
                    wrong.append(1)

        threads = [threading.Thread(target=work) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])

    def test_a_forked_child_is_told(self):
        done = self.python("""
            import os, support, darb
            scene = darb.Scene.from_arrays(**support.splats(sh=1))
            scene.render(**support.camera())
            child = os.fork()
            if child == 0:
                try:
                    scene.render(**support.camera())
                except darb.Error as error:
                    os._exit(0 if "forked" in str(error) else 1)
                os._exit(2)
            print(os.waitpid(child, 0)[1])
            """)
        self.assertEqual(done.stdout.strip(), "0", done.stderr)

    def test_another_interpreter_is_told(self):
        done = self.python("""
            import darb
            import _xxsubinterpreters as interpreters
            other = interpreters.create()
            try:
                interpreters.run_string(other, "import darb")
            except interpreters.RunFailedError as error:
                print(error)
            """)
        self.assertIn("main interpreter alone", done.stdout + done.stderr)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_ctrl_c_ends_a_call_of_many_cameras(self):
        pictures, arrays = camera(count=64), splats(count=2000, seed=3)
        darb.rasterize(**arrays, **camera())
        timer = threading.Timer(0.05, lambda: os.kill(os.getpid(), signal.SIGINT))
        timer.start()
        with self.assertRaises(KeyboardInterrupt):
            for _ in range(1000):
                darb.rasterize(**arrays, **pictures)
        timer.join()
        darb.rasterize(**arrays, **camera())

    def test_other_threads_run_meanwhile(self):
        pictures, arrays = camera(count=32), splats(count=500, seed=3)
        counted, going = [0], [True]

        def count():
            while going[0]:
                counted[0] += 1

        thread = threading.Thread(target=count)
        thread.start()
        before = counted[0]
        darb.rasterize(**arrays, **pictures)
        during = counted[0] - before
        going[0] = False
        thread.join()
        self.assertGreater(during, 1000)


class Memory(unittest.TestCase):
    def test_calls_leave_nothing_behind(self):
        pictures, arrays = camera(), splats()
        d_image, d_alpha = weights(pictures)
        scene = darb.Scene.from_arrays(**splats(sh=4))
        calls = int(os.environ.get("DARB_CALLS", "60"))

        def call(i):
            darb.rasterize(**arrays, **pictures)
            darb.rasterize_backward(d_image, d_alpha, **arrays, **pictures)
            scene.means = scene.means
            scene.render(**pictures)
            with self.assertRaises(darb.Error):
                darb.rasterize(**{**arrays, "means": arrays["quats"]}, **pictures)

        for i in range(20):
            call(i)
        device, host = darb.device().allocated_bytes, support.resident_bytes()
        for i in range(calls):
            call(i)
        self.assertEqual(darb.device().allocated_bytes, device)
        grown = support.resident_bytes() - host
        print(f"\n{4 * calls} calls: {grown / 1024:.0f} KiB more")
        self.assertLess(grown, 8 << 20)


if __name__ == "__main__":
    unittest.main(verbosity=1)
