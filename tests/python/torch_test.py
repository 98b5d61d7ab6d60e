#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""darb.torch.rasterize: gradients by autograd, and a fit with an optimizer of torch's."""

import unittest

import support

try:
    import numpy as np
    import torch

    import darb
    import darb.torch
except ModuleNotFoundError as error:  # one that is there and does not load fails the test
    support.skip(f"torch or the module is not here: {error}")
from support import camera, relative, splats, weights

torch.set_num_threads(1)


def tensors(arrays, grad=True):
    return {name: torch.from_numpy(value).requires_grad_(grad) for name, value in arrays.items()}


class Autograd(unittest.TestCase):
    def test_every_input_has_the_gradient_of_the_double_reference(self):
        for sh in (None, 9):
            pictures, arrays = camera(count=2), splats(sh=sh)
            d_image, d_alpha = weights(pictures)
            given = tensors(arrays)
            cameras = {"viewmats": torch.from_numpy(pictures["viewmats"]).requires_grad_(),
                       "Ks": torch.from_numpy(pictures["Ks"]).requires_grad_(),
                       "background": torch.tensor([0.2, 0.5, 0.7], requires_grad=True)}
            image, alpha, info = darb.torch.rasterize(**given, **{**pictures, **cameras})
            (image * torch.from_numpy(d_image)).sum().add(
                (alpha * torch.from_numpy(d_alpha)).sum()).backward()
            want = darb.rasterize_backward(d_image, d_alpha, **arrays, **pictures, camera=True,
                                           background=np.float32([0.2, 0.5, 0.7]))
            for name, tensor in {**given, **cameras}.items():
                self.assertEqual(tensor.grad.shape, tensor.shape, name)
                wanted = (want["backgrounds"].sum(0) if name == "background" else want[name])
                self.assertLess(relative(tensor.grad.numpy(), wanted), 1e-6, name)
            names = dict.fromkeys(("colors", "sh", "shapes", "kernel", "footprint",
                                   "sh_degree", "antialiased"))
            truth, _, d_true = darb._darb.reference(
                {**names, "near": 0.2, "accuracy": "balanced", "depth": False, **arrays,
                 **pictures, "background": np.float32([0.2, 0.5, 0.7])}, d_image, d_alpha)
            self.assertLess(relative(image.detach().numpy(), truth), 2e-5)
            for name in ("means", "quats", "scales", "opacities"):
                self.assertLess(relative(given[name].grad.numpy(), d_true[name]), 2e-3, name)
            self.assertGreater(int(info["visible"].min()), 10)

    def test_central_differences_of_every_input(self):
        # A splat that grows crosses the cut-off of alphas, which is lower in "exact".
        for kernel in ("gaussian", "beta"):
            with self.subTest(kernel):
                self.central_differences(kernel)

    def central_differences(self, kernel):
        pictures, arrays = {**camera(), "accuracy": "exact", "kernel": kernel}, splats(count=10)
        arrays["background"] = np.float32([0.3, 0.1, 0.6])
        if kernel == "beta":
            arrays["shapes"] = support.shapes(10)
        weight = torch.from_numpy(weights(pictures)[0])
        given = tensors(arrays)
        image, _, _ = darb.torch.rasterize(**given, **pictures)
        (image * weight).sum().backward()
        for name, value in arrays.items():
            g = given[name].grad.numpy()
            u = (g / support.rms(g) * 4e-3).astype(np.float32)

            def loss(sign):
                moved = {**arrays, name: value + sign * u}
                image = darb.torch.rasterize(**tensors(moved, False), **pictures)[0]
                return float((image.double() * weight.double()).sum())

            wanted = float((np.float64(g) * u).sum())
            self.assertLess(abs((loss(1) - loss(-1)) / 2 - wanted), 0.02 * abs(wanted) + 0.01, name)

    def test_memory_is_shared_and_what_asks_for_nothing_gets_nothing(self):
        pictures, arrays = camera(), splats()
        given = tensors(arrays, grad=False)
        given["colors"].requires_grad_()
        image, alpha, _ = darb.torch.rasterize(**given, **pictures)
        image.sum().backward()
        self.assertIsNotNone(given["colors"].grad)
        self.assertIsNone(given["means"].grad)
        with torch.no_grad():
            again, _, _ = darb.torch.rasterize(**given, **pictures)
        self.assertFalse(again.requires_grad)
        np.testing.assert_array_equal(again.numpy(), image.detach().numpy())
        self.assertEqual(darb.torch._array("means", given["means"]).ctypes.data,
                         given["means"].data_ptr())

    def test_mistakes_are_errors(self):
        pictures, arrays = camera(), splats()
        given = tensors(arrays)
        for text, changed in (
                ("means: is of float64, not float32", {"means": given["means"].double()}),
                ("means: is not in C order", {"means": given["means"].t().contiguous().t()}),
                ("lies on meta", {"means": torch.zeros(24, 3, device="meta")}),
                ("layout torch.sparse_coo", {"means": given["means"].detach().to_sparse()})):
            with self.subTest(text), self.assertRaisesRegex(darb.Error, text):
                darb.torch.rasterize(**{**given, **changed}, **pictures)
        image, _, _ = darb.torch.rasterize(**given, **pictures)
        with self.assertRaisesRegex(darb.Error, "nan at pixel"):
            (image * float("nan")).sum().backward()
        image, _, _ = darb.torch.rasterize(**given, **pictures)
        with torch.no_grad():
            given["means"] += 1
        with self.assertRaisesRegex(RuntimeError, "modified by an inplace"):
            image.sum().backward()
        with self.assertRaisesRegex(darb.Error, "darb.torch.rasterize"):
            darb.rasterize(**{**arrays, "means": given["means"]}, **pictures)

    def test_an_optimizer_of_torch_fits_a_picture(self):
        pictures = camera(width=48, height=48)
        target = torch.from_numpy(darb.rasterize(**splats(count=40, seed=7), **pictures)[0])
        given = tensors(splats(count=40, seed=8))
        optimizer = torch.optim.Adam(given.values(), lr=0.02)
        losses = []
        for _ in range(25):
            optimizer.zero_grad()
            with torch.no_grad():
                given["opacities"].clamp_(0.01, 1)
                given["scales"].clamp_(0.01)
            image, _, _ = darb.torch.rasterize(**given, **pictures)
            loss = (image - target).square().mean()
            loss.backward()
            optimizer.step()
            losses.append(float(loss))
        self.assertLess(losses[-1], 0.5 * losses[0])


if __name__ == "__main__":
    unittest.main(verbosity=1)
