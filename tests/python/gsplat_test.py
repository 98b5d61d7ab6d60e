#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""darb.gsplat.rasterization against a picture of its own in numpy, in double; what it refuses."""

import importlib.util
import inspect
import unittest

import support

try:
    import numpy as np
    import torch

    import darb
    from darb.gsplat import rasterization
except ModuleNotFoundError as error:  # one that is there and does not load fails the test
    support.skip(f"torch or the module is not here: {error}")
from support import camera, relative

torch.set_num_threads(1)
LEAST = 1 / 255          # alphas below are cut off
LEAST_EXACT = 1 / 1024   # the same with accuracy "exact"


def scene(count=14, channels=3, seed=4):
    arrays = support.splats(count=count, seed=seed)
    rng = np.random.default_rng(seed)
    arrays["opacities"] = rng.uniform(0.2, 0.6, count).astype(np.float32)
    arrays["colors"] = rng.uniform(-0.5, 1, (count, channels)).astype(np.float32)
    return arrays


def rotations(quats):
    w, x, y, z = (quats / np.linalg.norm(quats, axis=1, keepdims=True)).T
    return np.stack([np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], -1),
                     np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], -1),
                     np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1)], 1)


def draw(arrays, pictures, c=0, least=LEAST, moved=None, seen=None, antialiased=False, background=None):
    """Splat after splat in double: -> [H, W, D + 1], whose last channel is the sum of depths, alpha, and
    means2d. moved: [N, 2] px, added to the projected means. seen: a list that holds the pixels where each
    splat is not cut off, or that gets them where it is empty. All means are well inside the picture."""
    a = {name: np.float64(value) for name, value in arrays.items()}
    view, K = np.float64(pictures["viewmats"][c]), np.float64(pictures["Ks"][c])
    width, height = pictures["width"], pictures["height"]
    points = a["means"] @ view[:3, :3].T + view[:3, 3]
    axes = view[:3, :3] @ (rotations(a["quats"]) * a["scales"][:, None])
    z = points[:, 2]
    jacobian = np.zeros((len(z), 2, 3))
    for i in range(2):
        jacobian[:, i, i] = K[i, i] / z
        jacobian[:, i, 2] = -K[i, i] * points[:, i] / z**2
    covariances = jacobian @ axes @ np.swapaxes(axes, 1, 2) @ np.swapaxes(jacobian, 1, 2)
    wide = covariances + 0.3 * np.eye(2)
    opacities = a["opacities"]
    if antialiased:
        opacities = opacities * np.sqrt(np.linalg.det(covariances) / np.linalg.det(wide))
    means2d = points[:, :2] / z[:, None] * np.diag(K)[:2] + K[:2, 2]
    centres = means2d if moved is None else means2d + moved
    values = np.concatenate([a["colors"], z[:, None]], 1)
    y, x = np.mgrid[0:height, 0:width] + 0.5
    image, through = np.zeros((height, width, values.shape[1])), np.ones((height, width))
    order = np.argsort(z, kind="stable")
    seen = [] if seen is None else seen
    noted = len(seen) > 0
    for i in order:
        p = np.linalg.inv(wide[i])
        dx, dy = x - centres[i, 0], y - centres[i, 1]
        alpha = opacities[i] * np.exp(-0.5 * (p[0, 0] * dx * dx + 2 * p[0, 1] * dx * dy + p[1, 1] * dy * dy))
        if not noted:
            seen.append(alpha >= least)
        alpha = np.where(seen[i if noted else -1], alpha, 0)
        image += (through * alpha)[..., None] * values[i]
        through *= 1 - alpha
    if not noted:
        seen[:] = [seen[k] for k in np.argsort(order)]  # by splat
    if background is not None:
        image[..., :-1] += through[..., None] * np.float64(background)
    return image, 1 - through, means2d


def tensors(values, grad=False):
    return {name: torch.from_numpy(value).requires_grad_(grad) if isinstance(value, np.ndarray) else value
            for name, value in values.items()}


class Rasterization(unittest.TestCase):
    def test_pictures_are_those_of_numpy_for_every_mode_and_number_of_channels(self):
        pictures = camera(count=2)
        for channels, mode, antialiased in ((3, "RGB", False), (1, "RGB+ED", True), (5, "RGB+D", False),
                                            (3, "ED", False), (3, "D", True)):
            with self.subTest(channels=channels, mode=mode, antialiased=antialiased):
                arrays = scene(channels=channels)
                behind = np.float32(np.random.default_rng(1).uniform(0, 1, (2, channels)))
                image, alpha, meta = rasterization(
                    **tensors({**arrays, **pictures}), backgrounds=torch.from_numpy(behind), render_mode=mode,
                    rasterize_mode="antialiased" if antialiased else "classic")
                has_colours = "RGB" in mode
                self.assertEqual(tuple(image.shape), (2, 32, 40, channels * has_colours + ("D" in mode)))
                self.assertEqual(tuple(alpha.shape), (2, 32, 40, 1))
                for c in range(2):
                    want, want_alpha, _ = draw(arrays, pictures, c, antialiased=antialiased,
                                               background=behind[c] if has_colours else None)
                    self.assertLess(relative(alpha[c, ..., 0].numpy(), want_alpha), 2e-4)
                    if has_colours:
                        self.assertLess(relative(image[c, ..., :channels].numpy(), want[..., :-1]), 2e-4)
                    if "D" in mode:
                        depth = want[..., -1] / (np.maximum(want_alpha, 1e-10) if "ED" in mode else 1)
                        self.assertLess(relative(image[c, ..., -1].numpy(), depth), 2e-4)

    def test_harmonics_are_darbs_and_may_differ_from_camera_to_camera(self):
        pictures, arrays = camera(count=2), support.splats(sh=9)
        want = darb.rasterize(**arrays, **pictures, near=0.01)[0]
        sh = arrays.pop("sh")
        given = tensors({**arrays, **pictures})
        got = rasterization(**given, colors=torch.from_numpy(sh), sh_degree=2)[0]
        np.testing.assert_array_equal(got.numpy(), want)
        more = np.concatenate([sh, np.ones((24, 3, 3), np.float32)], 1)  # 12 coefficients
        each = torch.from_numpy(np.stack([more, 0.5 * more]))
        got = rasterization(**given, colors=each, sh_degree=2)[0]
        np.testing.assert_array_equal(got[0].numpy(), want[0])
        self.assertGreater(relative(got[1].numpy(), want[1]), 0.05)

    def test_the_last_row_of_a_pose_is_not_read(self):
        pictures, arrays = camera(), scene()
        want = rasterization(**tensors({**arrays, **pictures}))[0]
        pictures["viewmats"][:, 3] += np.float32([1e-9, 0, -1e-8, 1e-7])
        np.testing.assert_array_equal(rasterization(**tensors({**arrays, **pictures}))[0].numpy(), want.numpy())

    def test_gradients_are_differences_of_the_picture_in_numpy(self):
        pictures, arrays = camera(), scene(channels=4)
        arrays["quats"] /= np.linalg.norm(arrays["quats"], axis=1, keepdims=True)
        rng = np.random.default_rng(9)
        weight = rng.uniform(-1, 1, (32, 40, 5)).astype(np.float32)
        behind = rng.uniform(0, 1, 4).astype(np.float32)
        given = tensors(arrays, grad=True)
        views = torch.from_numpy(pictures["viewmats"]).requires_grad_()
        image, _, _ = rasterization(**given, **tensors({**pictures, "viewmats": None}) | {"viewmats": views},
                                    backgrounds=torch.from_numpy(behind[None]), render_mode="RGB+D",
                                    accuracy="exact")
        (image[0] * torch.from_numpy(weight)).sum().backward()

        seen = []
        draw(arrays, pictures, 0, LEAST_EXACT, seen=seen)

        def loss(**changed):
            views_of = changed.pop("viewmats", pictures["viewmats"])
            picture, _, _ = draw({**{k: np.float64(v) for k, v in arrays.items()}, **changed},
                                 {**pictures, "viewmats": views_of}, seen=seen, background=behind)
            return float((picture * weight).sum())

        for name, value in {**arrays, "viewmats": pictures["viewmats"]}.items():
            g = np.float64((views if name == "viewmats" else given[name]).grad.numpy())
            for u in (g / support.rms(g), rng.normal(size=g.shape)):
                if name == "viewmats":
                    u[:, :3, :3] = 0  # a rotation is no longer one when its numbers move alone
                    u[:, 3] = 0
                step = 1e-6
                wanted = (loss(**{name: np.float64(value) + step * u}) -
                          loss(**{name: np.float64(value) - step * u})) / (2 * step)
                scale = support.rms(g) * np.sqrt(g.size) * np.sqrt((u * u).sum())
                self.assertLess(abs(wanted - float((g * u).sum())), 0.002 * scale, name)

    def test_means2d_has_the_gradient_that_density_control_reads(self):
        pictures, arrays = camera(count=2), scene(channels=4)
        weight = np.random.default_rng(3).uniform(-1, 1, (2, 32, 40, 4)).astype(np.float32)
        found = {}
        for packed in (False, True):
            given = tensors(arrays, grad=True)
            image, _, meta = rasterization(**given, **tensors(pictures), packed=packed, accuracy="exact")
            meta["means2d"].retain_grad()
            (image * torch.from_numpy(weight)).sum().backward()
            found[packed] = (meta, meta["means2d"].grad.numpy(), given["means"].grad.numpy())
        meta, dense, of_means = found[False]
        for c in range(2):
            seen = []
            _, _, means2d = draw(arrays, pictures, c, LEAST_EXACT, seen=seen)
            np.testing.assert_allclose(meta["means2d"][c].detach().numpy(), means2d, atol=1e-3)
            for i in range(len(dense[c])):
                for axis in range(2):
                    step = np.zeros_like(means2d)
                    step[i, axis] = 1e-5
                    ends = [(draw(arrays, pictures, c, moved=s * step, seen=seen)[0][..., :-1] * weight[c]).sum()
                            for s in (1, -1)]
                    self.assertLess(abs((ends[0] - ends[1]) / 2e-5 - dense[c, i, axis]),
                                    0.002 * np.abs(dense[c]).max(), (c, i, axis))
        meta, packed, of_means_packed = found[True]
        ids = (meta["camera_ids"].numpy(), meta["gaussian_ids"].numpy())
        self.assertGreater(len(ids[0]), 20)
        np.testing.assert_array_equal(packed, dense[ids])
        # The gradient of the splats is the same, whether or not anybody reads that of means2d.
        given = tensors(arrays, grad=True)
        image, _, _ = rasterization(**given, **tensors(pictures), accuracy="exact")
        (image * torch.from_numpy(weight)).sum().backward()
        plain = given["means"].grad.numpy()
        for other in (of_means, of_means_packed):
            self.assertLess(relative(other, plain), 1e-5)

    def test_a_loss_on_means2d_reaches_the_means(self):
        pictures, arrays = camera(), scene()
        given = tensors(arrays, grad=True)
        image, _, meta = rasterization(**given, **tensors(pictures), packed=False)
        meta["means2d"].retain_grad()
        (image.sum() + 3 * meta["means2d"].sum()).backward()
        plain = tensors(arrays, grad=True)
        rasterization(**plain, **tensors(pictures), packed=False)[0].sum().backward()
        added = (given["means"].grad - plain["means"].grad).numpy()
        view, K = np.float64(pictures["viewmats"][0]), np.float64(pictures["Ks"][0])
        points = np.float64(arrays["means"]) @ view[:3, :3].T + view[:3, 3]
        d = np.stack([K[0, 0] / points[:, 2], K[1, 1] / points[:, 2],
                      -(points[:, :2] * np.diag(K)[:2]).sum(1) / points[:, 2] ** 2], 1)
        self.assertLess(relative(added, 3 * d @ view[:3, :3]), 1e-4)

    def test_meta_says_what_is_seen(self):
        pictures, arrays = camera(), scene()
        arrays["means"][0] = (0, 0, -9)    # behind the camera
        arrays["means"][1] = (40, 0, 0)    # far to the right
        arrays["means"][2] = (0, 0, 30)    # beyond the far plane below
        _, _, meta = rasterization(**tensors({**arrays, **pictures}), packed=False)
        radii = meta["radii"].numpy()
        self.assertEqual(radii.dtype, np.int32)
        self.assertEqual(radii.shape, (1, 14, 2))
        self.assertEqual(radii[0, :2].max(), 0)
        self.assertGreater(radii[0, 2:].min(), 0)
        np.testing.assert_allclose(meta["depths"][0].numpy(), arrays["means"][:, 2] + 4, rtol=1e-6)
        self.assertEqual((meta["tile_width"], meta["tile_height"], meta["n_cameras"]), (3, 2, 1))
        _, _, packed = rasterization(**tensors({**arrays, **pictures}))
        np.testing.assert_array_equal(packed["gaussian_ids"].numpy(), np.arange(2, 14))
        np.testing.assert_array_equal(packed["conics"].numpy(), meta["conics"][0, 2:].numpy())
        with self.assertRaisesRegex(darb.Error, "isect_ids"):
            meta["isect_ids"]
        with self.assertRaises(KeyError):
            meta["absent"]

    def test_planes_and_radius_clip_leave_splats_out(self):
        pictures, arrays = camera(), scene()
        depths = arrays["means"][:, 2] + 4
        far = float(np.sort(depths)[6])
        near = float(np.sort(depths)[2])
        inside = (depths > near) & (depths < far)
        got = rasterization(**tensors({**arrays, **pictures}), near_plane=near, far_plane=far)[0]
        kept = {name: value[inside] for name, value in arrays.items()}
        want = rasterization(**tensors({**kept, **pictures}))[0]
        self.assertLess(relative(got.numpy(), want.numpy()), 1e-6)
        _, _, meta = rasterization(**tensors({**arrays, **pictures}), packed=False)
        clip = float(np.median(meta["radii"][0].max(-1).values.numpy()))
        kept = {name: value[meta["radii"][0].max(-1).values.numpy() > clip] for name, value in arrays.items()}
        got = rasterization(**tensors({**arrays, **pictures}), radius_clip=clip)[0]
        self.assertLess(relative(got.numpy(), rasterization(**tensors({**kept, **pictures}))[0].numpy()), 1e-6)

    def test_what_cannot_be_honoured_is_refused_by_name(self):
        pictures, arrays = camera(), scene()
        given = tensors({**arrays, **pictures})
        for name, value in (
                ("eps2d", 0.1), ("tile_size", 8), ("sparse_grad", True), ("absgrad", True),
                ("distributed", True), ("camera_model", "fisheye"), ("segmented", True),
                ("covars", torch.zeros(14, 3, 3)), ("with_ut", True), ("with_eval3d", True),
                ("radial_coeffs", torch.zeros(1, 6)), ("tangential_coeffs", torch.zeros(1, 2)),
                ("thin_prism_coeffs", torch.zeros(1, 4)), ("ftheta_coeffs", object()),
                ("viewmats_rs", torch.zeros(1, 4, 4)), ("rolling_shutter", 2), ("render_mode", "depth"),
                ("rasterize_mode", "soft"), ("near_plane", 0.0), ("far_plane", 0.001),
                ("radius_clip", -1), ("channel_chunk", 0), ("sh_degree", 4), ("sh_degree", 1),
                ("backgrounds", torch.zeros(3)), ("colors", torch.zeros(13, 3)),
                ("colors", torch.zeros(14, 3, dtype=torch.float64)), ("means", torch.zeros(2, 14, 3)),
                ("quats", None), ("opacities", torch.zeros(1, 14)), ("Ks", torch.zeros(2, 3, 3))):
            with self.subTest(name):
                changed = {**given, name: value}
                if name == "sh_degree":
                    changed["colors"] = torch.zeros(14, 3, 3)
                with self.assertRaisesRegex(darb.Error, f"^{name}: "):
                    rasterization(**changed)
        with self.assertRaises(TypeError):
            rasterization(**given, no_such_argument=1)
        names = list(inspect.signature(rasterization).parameters)
        self.assertEqual(names[:9], ["means", "quats", "scales", "opacities", "colors", "viewmats", "Ks",
                                     "width", "height"])

    def test_random_splats_fit_a_picture(self):
        path = support.SOURCE / "tools" / "python" / "examples" / "fit_gsplat.py"
        spec = importlib.util.spec_from_file_location("fit_gsplat", path)
        example = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(example)
        target = torch.ones(48, 48, 3)
        target[:24, :24] = torch.tensor([1.0, 0, 0])
        target[24:, 24:] = torch.tensor([0.0, 0, 1])
        _, losses = example.fit(target, 120, 60)
        self.assertLess(losses[-1], 0.2 * losses[0])


if __name__ == "__main__":
    unittest.main(verbosity=1)
