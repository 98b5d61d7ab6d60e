# SPDX-License-Identifier: MIT
"""darb.rasterize with gradients for PyTorch: float32 tensors on the CPU, without copies of them.

    import torch, darb.torch
    image, alpha, info = darb.torch.rasterize(means, quats, scales, opacities, colors=colors,
                                              viewmats=viewmats, Ks=Ks, width=640, height=480)
    ((image - target) ** 2).mean().backward()

Gradients reach means, quats, scales, opacities, colors or sh, shapes, background, viewmats and Ks,
where these ask for them.
"""

import torch as _torch

import darb as _darb

__all__ = ["rasterize"]

_INPUTS = ("means", "quats", "scales", "opacities", "colors", "sh", "shapes", "viewmats", "Ks",
           "background")


def _array(name, value):
    """The tensor's own memory as a numpy array; anything else is returned as it is."""
    if not isinstance(value, _torch.Tensor):
        return value
    if value.device.type != "cpu":
        raise _darb.Error(f"{name}: lies on {value.device}, not in memory of the host\n"
                          f"  Copy it: {name}.cpu().")
    if value.layout != _torch.strided:
        raise _darb.Error(f"{name}: is of the layout {value.layout}, not strided\n"
                          f"  Give {name}.to_dense().")
    return value.detach().resolve_neg().numpy()


class _Rasterize(_torch.autograd.Function):
    """means2d [N, 2] is not read: it is what dL/d(projected mean) goes to, and only where wanted() says
    so, because that takes another picture. The gradients of all others do not depend on it."""

    @staticmethod
    def forward(ctx, settings, wanted, means2d, *tensors):
        given = {name: _array(name, value) for name, value in zip(_INPUTS, tensors)}
        image, alpha, info = _darb.rasterize(**given, **settings)
        ctx.settings = settings
        ctx.wanted = wanted
        ctx.picture = info["picture"]
        ctx.others = [None if isinstance(t, _torch.Tensor) else t for t in tensors]
        ctx.save_for_backward(*(t if isinstance(t, _torch.Tensor) else None for t in tensors))
        return _torch.from_numpy(image), _torch.from_numpy(alpha), info

    @staticmethod
    @_torch.autograd.function.once_differentiable
    def backward(ctx, d_image, d_alpha, _):
        saved = [t if t is not None else other for t, other in zip(ctx.saved_tensors, ctx.others)]
        given = {name: _array(name, value) for name, value in zip(_INPUTS, saved)}
        wants = dict(zip(_INPUTS, ctx.needs_input_grad[3:]))
        projected = ctx.needs_input_grad[2] and ctx.wanted()
        camera = wants["viewmats"] or wants["Ks"] or projected
        settings = {k: v for k, v in ctx.settings.items() if k != "depth"}
        d = _darb.rasterize_backward(
            d_image.contiguous().numpy(), d_alpha.contiguous().numpy(), **given, **settings,
            camera=camera, picture=0 if camera else ctx.picture)
        if wants["background"]:
            whole = d.pop("backgrounds")
            d["background"] = whole if saved[-1].dim() == 2 else whole.sum(0)
        gradients = []
        for name, value in zip(_INPUTS, saved):
            wanted = wants[name] and name in d
            gradients.append(_torch.from_numpy(d[name]).to(value.dtype) if wanted else None)
        means2d = _torch.from_numpy(d["means2d"].sum(0)) if projected else None
        return (None, None, means2d, *gradients)


def rasterize(means, quats=None, scales=None, opacities=None, *, colors=None, sh=None, shapes=None,
              viewmats, Ks, width, height, kernel=None, footprint=None, background=None,
              sh_degree=None, antialiased=None, near=0.2, accuracy="balanced", depth=False,
              device=""):
    """darb.rasterize for tensors -> (image, alpha, info), image and alpha with gradients.

    All arguments, shapes and units are those of darb.rasterize; help(darb.rasterize) has them.
    Tensors are float32 on the CPU and contiguous; viewmats, Ks and background may be float64.
    colors=[N, 3] take any sign, as in gsplat; sh are clamped at 0 after 0.5 is added, as there.
    Gradients are of the first order. With several cameras, the backward pass draws each picture again.
    """
    settings = dict(width=width, height=height, kernel=kernel, footprint=footprint,
                    sh_degree=sh_degree, antialiased=antialiased, near=near, accuracy=accuracy,
                    depth=depth, device=device)
    return _Rasterize.apply(settings, None, None, means, quats, scales, opacities, colors, sh, shapes,
                            viewmats, Ks, background)
