# SPDX-License-Identifier: MIT
"""gsplat's `rasterization` on any Vulkan device: a script changes its import alone.

    from darb.gsplat import rasterization            # instead of: from gsplat import rasterization
    colors, alphas, meta = rasterization(means, quats, scales, opacities, colors, viewmats, Ks,
                                         width, height)

Arguments, defaults and results are those of gsplat 1.5. An argument that darb cannot honour is a
darb.Error that names it; docs/python.md has the list. Tensors of another device are copied to the
host, and the results back.
"""

import math as _math
import weakref as _weakref

import torch as _torch

from . import Error as _Error
from .torch import _Rasterize

__all__ = ["rasterization"]

_LOW_PASS = 0.3          # px^2, shaders/shared/limits.h
_MARGIN = 0.3            # the Jacobian is held at the picture plus this share of W / (2 fx)
_TILE = 16               # px
_ALPHA_LEAST = 1 / 255   # what gsplat counts as seen
_REACH = 3.33            # standard deviations, at most
_MODES = ("RGB", "D", "ED", "RGB+D", "RGB+ED")
_LISTS = ("tiles_per_gauss", "isect_ids", "flatten_ids", "isect_offsets")


class _Meta(dict):
    """What gsplat returns beside the pictures; reading what darb does not have is an error."""

    def __missing__(self, key):
        if key in _LISTS:
            raise _Error(f"meta[{key!r}]: is not there\n"
                         "  darb keeps its lists of tiles on the device, in another form.")
        raise KeyError(key)


def _refuse(name, value, reason, hint):
    raise _Error(f"{name}: is {value!r}, {reason}\n  {hint}")


def _check_switches(given):
    """Raises for arguments of gsplat's that darb has no counterpart of, unless they have the default."""
    for name, default, reason, hint in (
            ("eps2d", _LOW_PASS, "but darb's low-pass is 0.3 px^2", "Leave it out."),
            ("tile_size", _TILE, "but darb's tiles have 16 px", "Leave it out."),
            ("sparse_grad", False, "but gradients are dense", "Leave it out."),
            ("absgrad", False, "but darb sums gradients with their signs",
             "Use meta['means2d'].grad after retain_grad()."),
            ("distributed", False, "but a call uses one device", "Give all splats to one process."),
            ("camera_model", "pinhole", "but a call takes pinholes", "Undistort the photos."),
            ("segmented", False, "but darb sorts in its own way", "Leave it out."),
            ("covars", None, "but darb takes quats and scales", "Give those instead."),
            ("with_ut", False, "but darb projects by the Jacobian", "Leave it out."),
            ("with_eval3d", False, "but darb blends projected splats", "Leave it out."),
            ("radial_coeffs", None, "but a call takes pinholes", "Undistort the photos."),
            ("tangential_coeffs", None, "but a call takes pinholes", "Undistort the photos."),
            ("thin_prism_coeffs", None, "but a call takes pinholes", "Undistort the photos."),
            ("ftheta_coeffs", None, "but a call takes pinholes", "Undistort the photos."),
            ("viewmats_rs", None, "but a picture has one pose", "Leave it out.")):
        value = given[name]
        same = value is None if default is None else value == default
        if not same:
            shown = "given" if isinstance(value, _torch.Tensor) else value
            _refuse(name, shown, reason, hint)
    shutter = given["rolling_shutter"]
    if shutter is not None and getattr(shutter, "name", shutter) != "GLOBAL":
        _refuse("rolling_shutter", shutter, "but a picture has one pose", "Leave it out.")
    if given["render_mode"] not in _MODES:
        _refuse("render_mode", given["render_mode"], "no such mode", f"Use {', '.join(_MODES)}.")
    if given["rasterize_mode"] not in ("classic", "antialiased"):
        _refuse("rasterize_mode", given["rasterize_mode"], "no such mode", "Use classic or antialiased.")
    for name, least in (("near_plane", 1e-6), ("far_plane", given["near_plane"]), ("radius_clip", 0),
                        ("channel_chunk", 1)):
        if not given[name] >= least:
            _refuse(name, given[name], f"below {least}", "Give a larger number.")


def _check_shape(name, tensor, *shapes):
    if not isinstance(tensor, _torch.Tensor):
        raise _Error(f"{name}: is of the type {type(tensor).__name__}, no tensor\n"
                     f"  Give torch.as_tensor({name}).")
    got = tuple(tensor.shape)
    for shape in shapes:
        if len(got) == len(shape) and all(w in (None, g) for w, g in zip(shape, got)):
            return
    wanted = " or ".join("(" + ", ".join("any" if n is None else str(n) for n in s) + ")" for s in shapes)
    raise _Error(f"{name}: has the shape {got}, not {wanted}\n"
                 "  Check the order of the arguments; call once for each batch of splats.")


def _check_shapes(means, quats, scales, opacities, colors, viewmats, Ks, backgrounds, sh_degree):
    _check_shape("means", means, (None, 3))
    n = means.shape[0]
    _check_shape("quats", quats, (n, 4))
    _check_shape("scales", scales, (n, 3))
    _check_shape("opacities", opacities, (n,))
    _check_shape("viewmats", viewmats, (None, 4, 4))
    c = viewmats.shape[0]
    _check_shape("Ks", Ks, (c, 3, 3))
    if sh_degree is None:
        _check_shape("colors", colors, (n, None), (c, n, None))
        channels = colors.shape[-1]
    else:
        _check_shape("colors", colors, (n, None, 3), (c, n, None, 3))
        channels = 3
        if sh_degree not in (0, 1, 2, 3):
            _refuse("sh_degree", sh_degree, "but harmonics have degrees 0 to 3", "Give one of these.")
        if (sh_degree + 1) ** 2 > colors.shape[-2]:
            _refuse("sh_degree", sh_degree, f"but colors has {colors.shape[-2]} coefficients",
                    "Give (sh_degree + 1)^2 of them.")
    if colors.dtype != _torch.float32:
        raise _Error(f"colors: is of {str(colors.dtype)[6:]}, not float32\n  Give colors.float().")
    if backgrounds is not None:
        _check_shape("backgrounds", backgrounds, (c, channels))


# --- Projection, for meta -------------------------------------------------------------------------

def _in_camera(means, viewmats):
    """-> [C, N, 3], the means in the cameras' axes."""
    return _torch.einsum("cij,nj->cni", viewmats[:, :3, :3], means) + viewmats[:, None, :3, 3]


def _means2d(points, Ks):
    """[C, N, 3] -> [C, N, 2] px; 0 for what is not before the camera."""
    z = points[..., 2:]
    before = z > 0
    ratio = points[..., :2] / _torch.where(before, z, _torch.ones_like(z))
    focal = _torch.stack([Ks[:, 0, 0], Ks[:, 1, 1]], -1)[:, None]
    return _torch.where(before, ratio * focal + Ks[:, None, :2, 2], _torch.zeros_like(ratio))


def _rotations(quats):
    """[N, 4] w x y z of any norm -> [N, 3, 3]."""
    w, x, y, z = _torch.nn.functional.normalize(quats, dim=-1).unbind(-1)
    rows = [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]
    return _torch.stack(rows, -1).reshape(-1, 3, 3)


def _covariances2d(points, quats, scales, viewmats, Ks, width, height):
    """-> [C, N, 3]: xx, xy, yy of the projected covariances, px^2, without the low-pass."""
    z = _torch.where(points[..., 2] > 0, points[..., 2], _torch.ones_like(points[..., 2]))
    axes = _torch.einsum("cij,njk->cnik", viewmats[:, :3, :3], _rotations(quats) * scales[:, None])
    rows = []
    for i, size in ((0, width), (1, height)):
        focal, centre = Ks[:, i, i, None], Ks[:, i, 2, None]
        margin = _MARGIN * size / (2 * focal)
        ratio = _torch.minimum(_torch.maximum(points[..., i] / z, -centre / focal - margin),
                               (size - centre) / focal + margin)
        rows.append((focal / z)[..., None] * (axes[..., i, :] - ratio[..., None] * axes[..., 2, :]))
    x, y = rows
    return _torch.stack([(x * x).sum(-1), (x * y).sum(-1), (y * y).sum(-1)], -1)


def _blurred(covariances, antialiased):
    """-> conics [C, N, 3] of the covariances with the low-pass, these, and the compensations."""
    xx, xy, yy = covariances.unbind(-1)
    wide_x, wide_y = xx + _LOW_PASS, yy + _LOW_PASS
    determinant = wide_x * wide_y - xy * xy
    conics = _torch.stack([wide_y, -xy, wide_x], -1) / determinant[..., None]
    share = ((xx * yy - xy * xy) / determinant).clamp(min=0).sqrt() if antialiased else None
    return conics, _torch.stack([wide_x, xy, wide_y], -1), share


def _radii(wide, opacities, points, means2d, width, height, near, far, clip):
    """-> int32 [C, N, 2] px, 0 for what is not seen; bool [C, N], whether far and clip leave it in."""
    xx, xy, yy = wide.unbind(-1)
    middle = 0.5 * (xx + yy)
    largest = (middle + (middle * middle - (xx * yy - xy * xy)).clamp(min=0.01).sqrt()).sqrt()
    seen = opacities >= _ALPHA_LEAST
    reach = (2 * (opacities.clamp(min=_ALPHA_LEAST) / _ALPHA_LEAST).log()).sqrt().clamp(max=_REACH)
    sides = _torch.stack([xx, yy], -1).sqrt()
    radii = (reach[..., None] * _torch.minimum(sides, largest[..., None])).ceil()
    depths = points[..., 2]
    kept = (depths < far) & (radii > clip).any(-1) if clip > 0 else depths < far
    size = _torch.tensor([width, height], dtype=means2d.dtype)
    inside = ((means2d + radii > 0) & (means2d - radii < size)).all(-1) & (depths > near)
    return _torch.where((kept & seen & inside)[..., None], radii, _torch.zeros_like(radii)).int(), kept


class _Tap:
    """dL/d(projected mean) of the pictures, on its way to meta["means2d"].

    The gradients of the splats come from the passes as a whole, so what flows back through means2d
    from the pictures must not reach the means once more. What a loss on means2d itself adds must.
    """

    def __init__(self, ids, shape):
        self.ids, self.shape = ids, shape
        self.tensor = None
        self.sum = None

    def wanted(self):
        tensor = self.tensor() if self.tensor is not None else None
        return tensor is not None and (tensor.retains_grad or bool(tensor._backward_hooks))

    def packed(self, dense):
        return dense if self.ids is None else dense[self.ids]

    def of_camera(self, means2d, camera):
        """[N, 2] of one camera, by way of which its gradient is noted."""
        if self.ids is None:
            dense = means2d[camera]
        else:
            chosen = self.ids[0] == camera
            dense = means2d.new_zeros(self.shape[1:]).index_copy(0, self.ids[1][chosen], means2d[chosen])
        return _Noted.apply(self, camera, dense)

    def note(self, camera, share):
        if self.sum is None:
            self.sum = _torch.zeros(self.shape, dtype=share.dtype)
        self.sum[camera] += share

    def take(self):
        share, self.sum = self.sum, None
        return None if share is None else self.packed(share)


class _Noted(_torch.autograd.Function):
    @staticmethod
    def forward(ctx, tap, camera, means2d):
        ctx.set_materialize_grads(False)
        ctx.tap, ctx.camera = tap, camera
        return means2d.clone()

    @staticmethod
    def backward(ctx, share):
        if share is not None:
            ctx.tap.note(ctx.camera, share)
        return None, None, share


class _Projected(_torch.autograd.Function):
    @staticmethod
    def forward(ctx, tap, means, viewmats, Ks):
        ctx.set_materialize_grads(False)
        ctx.tap = tap
        ctx.save_for_backward(means, viewmats, Ks)
        return tap.packed(_means2d(_in_camera(means, viewmats), Ks))

    @staticmethod
    @_torch.autograd.function.once_differentiable
    def backward(ctx, gradient):
        noted = ctx.tap.take()
        others = gradient if gradient is None or noted is None else gradient - noted
        wants = ctx.needs_input_grad[1:]
        if others is None or not others.any():
            return None, None, None, None
        with _torch.enable_grad():
            inputs = [t.detach().requires_grad_(w) for t, w in zip(ctx.saved_tensors, wants)]
            again = ctx.tap.packed(_means2d(_in_camera(inputs[0], inputs[1]), inputs[2]))
            found = iter(_torch.autograd.grad(again, [t for t, w in zip(inputs, wants) if w], others))
        return (None, *(next(found) if w else None for w in wants))


# --- Pictures ------------------------------------------------------------------------------------

def _pieces(colors, background, chunk):
    """Cuts [N, D] into [N, 3], with zeros behind the last; yields (piece, background, channels)."""
    for first in range(0, colors.shape[-1], chunk):
        piece = colors[:, first:first + chunk]
        behind = None if background is None else background[first:first + chunk]
        empty = 3 - piece.shape[-1]
        if empty:
            piece = _torch.nn.functional.pad(piece, (0, empty))
            behind = None if behind is None else _torch.nn.functional.pad(behind, (0, empty))
        yield piece.contiguous(), behind, 3 - empty


class _Call:
    """One call of rasterization: what all its pictures have in common."""

    def __init__(self, splats, options, chunk):
        self.splats, self.options, self.chunk = splats, options, min(3, chunk)

    def picture(self, camera, opacities, means2d, wanted, *, colors=None, sh=None, sh_degree=None,
                background=None):
        means, quats, scales = self.splats
        viewmat, K = camera
        settings = {**self.options, "sh_degree": sh_degree}
        image, alpha, _ = _Rasterize.apply(settings, wanted, means2d, means, quats, scales, opacities,
                                           colors, sh, None, viewmat, K, background)
        return image, alpha

    def pictures(self, colors, depths, sh_degree, background, *view):
        """-> [1, H, W, X] and [1, H, W] of one camera."""
        images, alpha = [], None
        if colors is not None and sh_degree is not None:
            bands = colors.shape[-2]
            if bands not in (1, 4, 9, 16):
                colors = colors[:, :(sh_degree + 1) ** 2]
            image, alpha = self.picture(*view, sh=colors.contiguous(), sh_degree=sh_degree,
                                        background=background)
            images.append(image)
            colors = background = None
        features = [t for t in (colors, None if depths is None else depths[:, None]) if t is not None]
        if features:
            if background is not None and depths is not None:
                background = _torch.nn.functional.pad(background, (0, 1))
            for piece, behind, used in _pieces(_torch.cat(features, -1), background, self.chunk):
                image, its_alpha = self.picture(*view, colors=piece, background=behind)
                images.append(image[..., :used])
                alpha = its_alpha if alpha is None else alpha
        return _torch.cat(images, -1), alpha


def rasterization(means, quats, scales, opacities, colors, viewmats, Ks, width, height,
                  near_plane=0.01, far_plane=1e10, radius_clip=0.0, eps2d=0.3, sh_degree=None,
                  packed=True, tile_size=16, backgrounds=None, render_mode="RGB", sparse_grad=False,
                  absgrad=False, rasterize_mode="classic", channel_chunk=32, distributed=False,
                  camera_model="pinhole", segmented=False, covars=None, with_ut=False,
                  with_eval3d=False, radial_coeffs=None, tangential_coeffs=None,
                  thin_prism_coeffs=None, ftheta_coeffs=None, rolling_shutter=None, viewmats_rs=None,
                  *, kernel=None, footprint=None, accuracy="balanced", device=""):
    """gsplat's rasterization -> (render_colors [C, H, W, X], render_alphas [C, H, W, 1], meta).

    means [N, 3], quats [N, 4], scales [N, 3], opacities [N], colors [N, D] or [C, N, D], of any D,
    or with sh_degree [N, K, 3] or [C, N, K, 3]; viewmats [C, 4, 4], Ks [C, 3, 3], backgrounds [C, D].
    All have gradients. X is D, with "D" or "ED" 1, and with "RGB+D" or "RGB+ED" D + 1.

    meta: means2d, radii (x and y), depths, conics and opacities, [C, N, ...] or with packed [nnz, ...]
    beside camera_ids and gaussian_ids; width, height, tile_size, tile_width, tile_height, n_cameras,
    n_batches. Call meta["means2d"].retain_grad() before the backward pass for its gradient.

    kernel, footprint, accuracy and device are darb's own, as for darb.rasterize. Any other argument
    that cannot be honoured is a darb.Error that names it.
    """
    _check_switches({**locals()})
    _check_shapes(means, quats, scales, opacities, colors, viewmats, Ks, backgrounds, sh_degree)
    home = means.device
    means, quats, scales, opacities, colors, viewmats, Ks = (
        t.cpu().contiguous() for t in (means, quats, scales, opacities, colors, viewmats, Ks))
    backgrounds = None if backgrounds is None else backgrounds.cpu().contiguous()
    antialiased = rasterize_mode == "antialiased"
    # An inverse of torch's may leave rounding in the last row, which gsplat does not read.
    viewmats = _torch.cat([viewmats[:, :3], viewmats.new_tensor([0, 0, 0, 1]).expand(len(viewmats), 1, 4)], 1)

    poses, pinholes = viewmats.to(means.dtype), Ks.to(means.dtype)
    points = _in_camera(means, poses)
    conics, wide, share = _blurred(
        _covariances2d(points, quats, scales, poses, pinholes, width, height), antialiased)
    peaks = opacities.expand(len(viewmats), -1) if share is None else opacities * share
    with _torch.no_grad():
        radii, kept = _radii(wide, peaks, points, _means2d(points, pinholes), width, height, near_plane,
                             far_plane, radius_clip)
    ids = (radii > 0).all(-1).nonzero(as_tuple=True) if packed else None
    tap = _Tap(ids, (*points.shape[:2], 2))
    means2d = _Projected.apply(tap, means, poses, pinholes)
    tap.tensor = _weakref.ref(means2d)

    options = {"width": width, "height": height, "kernel": kernel, "footprint": footprint,
               "antialiased": antialiased, "near": near_plane, "accuracy": accuracy, "depth": False,
               "device": device}
    call = _Call((means, quats, scales), options, channel_chunk)
    culls = radius_clip > 0 or bool((points[..., 2] >= far_plane).any())
    each_has_colors = colors.dim() == (3 if sh_degree is None else 4)
    images, alphas = [], []
    for c in range(len(viewmats)):
        image, alpha = call.pictures(
            None if render_mode in ("D", "ED") else colors[c] if each_has_colors else colors,
            points[c, :, 2] if "D" in render_mode else None, sh_degree,
            None if backgrounds is None or render_mode in ("D", "ED") else backgrounds[c],
            (viewmats[c:c + 1], Ks[c:c + 1]), opacities * kept[c] if culls else opacities,
            tap.of_camera(means2d, c), tap.wanted)
        images.append(image)
        alphas.append(alpha[..., None])
    image, alpha = _torch.cat(images), _torch.cat(alphas)
    if "ED" in render_mode:
        image = _torch.cat([image[..., :-1], image[..., -1:] / alpha.clamp(min=1e-10)], -1)

    tiles = [_math.ceil(side / _TILE) for side in (width, height)]
    meta = _Meta(
        batch_ids=None if ids is None else _torch.zeros_like(ids[0]),
        camera_ids=None if ids is None else ids[0], gaussian_ids=None if ids is None else ids[1],
        radii=tap.packed(radii), means2d=means2d, depths=tap.packed(points[..., 2]),
        conics=tap.packed(conics), opacities=tap.packed(peaks), width=width, height=height,
        tile_size=_TILE, tile_width=tiles[0], tile_height=tiles[1], n_batches=1,
        n_cameras=len(viewmats))
    if home.type != "cpu":
        # means2d stays, because its gradient is taken from the tensor that was projected.
        image, alpha = image.to(home), alpha.to(home)
        for key, value in meta.items():
            if isinstance(value, _torch.Tensor) and key != "means2d":
                meta[key] = value.to(home)
    return image, alpha, meta
