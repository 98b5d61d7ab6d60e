# SPDX-License-Identifier: MIT
"""darb: 3D splats with a choice of kernel, on any Vulkan device.

Arrays in, arrays out: numpy arrays of float32, or whatever supports DLPack or the buffer protocol
and lies on the host. darb.torch does the same with gradients for PyTorch, and darb.gsplat by the call
of gsplat.

    rasterize           turns splats and cameras into pictures
    rasterize_backward  the gradients of a loss of the pictures, for every input
    Scene, Dataset      splat files; photos with their cameras
    Trainer             `darb train`, step by step
    Kernel              a reconstruction kernel of your own
    psi, sim1d          a kernel's correction factor; signals as sums of kernels
    plan, devices       the effects that a scene needs; the Vulkan devices
    Error               what was wrong, where, and what to do
    NoRoom, DeviceLost  kinds of it that a script can react to: less memory, another device

Every mistake is a darb.Error, which is a ValueError; NoRoom is also a MemoryError, and DeviceLost a
RuntimeError. Long calls let other threads run and end with Ctrl-C. A Device is used by one call at a
time, and others wait.
"""

import atexit as _atexit

from . import _darb

_darb.check_interpreter()

import numpy as _np  # noqa: E402

from ._darb import Dataset, Device, DeviceLost, Error, Kernel, NoRoom, Scene, __version__

__all__ = [
    "Dataset",
    "Device",
    "DeviceLost",
    "Error",
    "Kernel",
    "NoRoom",
    "Scene",
    "Trainer",
    "__version__",
    "cameras",
    "device",
    "devices",
    "kernel_names",
    "plan",
    "psi",
    "rasterize",
    "rasterize_backward",
    "sim1d",
    "write_png",
]

_devices = {}


def device(select=""):
    """The device with that number, or with that part of its name, opened once.

    "" is the best usable one, as `darb devices` lists them. A darb.Device is returned as it is.
    """
    if isinstance(select, Device):
        return select
    if select not in _devices:
        _devices[select] = Device(select)
    return _devices[select]


def _close():
    """Releases the devices before the interpreter ends, so that they keep their pipeline caches."""
    _devices.clear()


def _options(means, quats, scales, opacities, colors, sh, shapes, viewmats, Ks, width, height,
             kernel, footprint, background, sh_degree, antialiased, near, accuracy, depth):
    return {
        "means": means, "quats": quats, "scales": scales, "opacities": opacities,
        "colors": colors, "sh": sh, "shapes": shapes, "viewmats": viewmats, "Ks": Ks,
        "width": width, "height": height, "kernel": kernel, "footprint": footprint,
        "background": background, "sh_degree": sh_degree, "antialiased": antialiased, "near": near,
        "accuracy": accuracy, "depth": depth,
    }


def rasterize(means, quats=None, scales=None, opacities=None, *, colors=None, sh=None, shapes=None,
              viewmats, Ks, width, height, kernel=None, footprint=None, background=None,
              sh_degree=None, antialiased=None, near=0.2, accuracy="balanced", depth=False,
              device=""):
    """Draws pictures of splats through C cameras -> (image, alpha, info).

    N splats, float32 in C order:
        means      [N, 3]  world units; or a Scene instead of all arrays of splats, whose splats
                           stay on the device until they change
        quats      [N, 4]  w x y z, of any norm
        scales     [N, 3]  standard deviations, world units, not logarithms
        opacities  [N]     0 to 1
        colors     [N, 3]  RGB of any sign, used as they are: nothing is added or clamped
        sh         [N, K, 3]  harmonics instead, K = 1, 4, 9 or 16, the first band first:
                           colour = max(0, 0.5 + sum over k of sh[k] Y_k(direction)), as 3DGS has it
        shapes     [N]     for kernels that learn one (docs/kernels.md), such as ln(b/4) for "beta";
                           0 by default
    Cameras, float32 or float64:
        viewmats   [C, 4, 4]  world to camera, rigid; x right, y down, z forward
        Ks         [C, 3, 3]  pinholes, px; the centre of the top left pixel is (0.5, 0.5)
        width, height         px
    kernel: a name of kernel_names() or a Kernel ("gaussian"). footprint: "psi" or "exact".
    background: [3] or [C, 3], black by default. sh_degree: the highest degree that is used.
    antialiased: opacities are compensated for the low-pass of 0.3 px^2, as Mip-Splatting does.
    near: splats up to this z are left out. accuracy: "fast", "balanced" or "exact", a preset of
    `darb render --accuracy`. depth: also fills info["depth"]. device: as for darb.device.

    image  [C, H, W, 3] float32, not clamped.
    alpha  [C, H, W]    float32, 1 - transmittance.
    info   a dict: "visible" and "intersections" (of splats and tiles) [C]; "device_ms", the time
           of the passes, and "frame_ms", which adds the way to the host; "depth" [C, H, W], the
           expected z, 0 where nothing is seen; "picture", its number for rasterize_backward.
    """
    return _darb.rasterize(
        _device(device),
        _options(means, quats, scales, opacities, colors, sh, shapes, viewmats, Ks, width, height,
                 kernel, footprint, background, sh_degree, antialiased, near, accuracy, depth))


def rasterize_backward(d_image, d_alpha=None, *, means, quats=None, scales=None, opacities=None,
                       colors=None, sh=None, shapes=None, viewmats, Ks, width, height, kernel=None,
                       footprint=None, background=None, sh_degree=None, antialiased=None, near=0.2,
                       accuracy="balanced", device="", camera=False, picture=0):
    """The gradients of a loss of rasterize's pictures for its inputs, as a dict.

    d_image [C, H, W, 3] is dL/d(image), and d_alpha [C, H, W] or None is dL/d(alpha), float32. The
    other arguments are those of rasterize. "means", "quats", "scales", "opacities", "colors" or "sh",
    and "shapes" for kernels that learn one have the shapes of the inputs and are summed over the
    cameras; "backgrounds" is [C, 3]. A Scene has "log_scales" and "opacity_logits" instead of scales
    and opacities.

    With camera there are also "viewmats" [C, 4, 4] and "Ks" [C, 3, 3]. Their numbers are treated as
    independent, as gsplat does; for a rotation only the part along rotations counts. "means2d"
    [C, N, 2] is then dL/d(projected mean) in 1/px, camera by camera.
    "means_ndc_norm" [N] is |dL/d(projected mean)| in units of half the picture's sides, and "shown"
    [N] tells in how many pictures a splat is seen; density control uses these two. "not_finite"
    counts splats whose gradients exceeded float32; they are 0. picture: info["picture"] of the call
    of rasterize with the same arguments, so that a single camera need not be drawn again.
    """
    return _darb.rasterize_backward(
        _device(device),
        _options(means, quats, scales, opacities, colors, sh, shapes, viewmats, Ks, width, height,
                 kernel, footprint, background, sh_degree, antialiased, near, accuracy, False),
        d_image, d_alpha, picture, camera)


_device = device  # the functions have an argument of that name
_atexit.register(_close)


def devices():
    """All Vulkan devices, best first: a list of dicts with name, driver, type and limits."""
    return _darb.devices()


def kernel_names():
    """The names of the kernels, as on the command line, including those made in this process."""
    return _darb.kernel_names()


def write_png(path, image):
    """Writes [H, W, 3] as a PNG: float32 in [0, 1], clamped and rounded to 8 bits, or uint8."""
    _darb.write_png(path, image)


# --- Scene ---------------------------------------------------------------------------------------

Scene.__doc__ = """A splat scene in memory.

    scene = darb.Scene.read("scene.ply")    # any format that `darb` reads
    image, alpha, info = scene.render(viewmats, Ks, 640, 480)
    scene.write("copy.spz")                 # any format that `darb convert` writes to one file

Attributes are read-only views of the scene's own float32; assign an array of the same shape to
change one: means [N, 3], log_scales [N, 3], quats [N, 4] (w x y z), opacity_logits [N], sh_dc
[N, 3], sh_rest [N, K - 1, 3], shapes [N] (for a kernel that learns one, else None). kernel,
footprint and antialiased say how it is drawn. The splats stay on the device between calls until
one is assigned. A notebook shows a scene as a picture.
"""


def _scene_from_arrays(means, quats, scales, opacities, *, sh, shapes=None, kernel="gaussian",
                       footprint="psi", antialiased=False):
    """Makes a Scene from arrays as darb.rasterize takes them, with scales and opacities themselves.

    Opacities are clamped to 1e-6 and 1 - 1e-6, and scales to 1e-8 and more, because files hold
    logits and logarithms.
    """
    return _scene_of_arrays({
        "means": means, "quats": quats, "scales": scales, "opacities": opacities, "sh": sh,
        "shapes": shapes, "kernel": kernel, "footprint": footprint, "antialiased": antialiased})


def _scene_render(self, viewmats, Ks, width, height, **options):
    """darb.rasterize for this scene -> (image, alpha, info)."""
    return rasterize(self, viewmats=viewmats, Ks=Ks, width=width, height=height, **options)


def _scene_mesh(self, viewmats=None, Ks=None, width=None, height=None, *, cameras=None,
                resolution=-1, method="tsdf", depth=None, level=0.5, voxel=None,
                truncation=4, far=None, near=0.2, bounds=None, faces=None, keep=None,
                min_island=50, fill_holes=None, texture="vertex", texel=None, seams="level",
                collider=None,
                capsule=(0.2, 1.6), up=None, reference=None, thresholds=None, align=None,
                output=None, device=""):
    """`darb mesh` for this scene -> (vertices, faces, colours, info).

    Cameras say from where the surface is seen: viewmats and Ks as in darb.rasterize, or cameras,
    the path of a cameras.json, a transforms.json or a data set (resolution: as -r). Without any
    there are 32 around the scene. The other options are those of the command, by the same names
    (docs/mesh.md); bounds is (x0, y0, z0, x1, y1, z1). output also writes a file: .ply, .obj, .glb
    or .gltf. device: as for darb.device; a collider needs none.

    vertices  [V, 3] float64, world units.
    faces     [F, 3] uint32, counter-clockwise from outside.
    colours   [V, 3] uint8, or None where the texture is another one than "vertex".
    info      a dict: "voxel", "normals" [V, 3] or None, what `--json` reports, and
              for pages "uv" [F, 3, 2], (0, 0) the top left corner; "page" [F]; "pages", a list of
              uint8 [H, W, 3];
              with a reference "comparison" and, where it was aligned, "alignment", the [4, 4]
              float64 that took the reference to the mesh.
    """
    return _darb.mesh(
        None if collider is not None else _device(device), self,
        {"viewmats": viewmats, "Ks": Ks, "width": width, "height": height, "cameras": cameras,
         "resolution": resolution, "method": method, "depth": depth, "level": level, "voxel": voxel,
         "truncation": truncation, "far": far, "near": near, "bounds": bounds, "faces": faces,
         "keep": keep, "min_island": min_island, "fill_holes": fill_holes, "texture": texture,
         "texel": texel, "seams": seams, "collider": collider, "capsule": capsule, "up": up,
         "reference": reference, "thresholds": thresholds, "align": align, "output": output})


def _scene_picture(self, size=480):
    """A view of the scene along z, [size, size, 3] float32."""
    means = _np.asarray(self.means, dtype=_np.float64)
    if len(means) == 0:
        return _np.zeros((size, size, 3), _np.float32)
    centre = _np.median(means, axis=0)
    reach = max(float(_np.quantile(_np.abs(means - centre).max(axis=1), 0.9)), 1e-3)
    viewmat = _np.eye(4)
    viewmat[:3, 3] = -centre
    viewmat[2, 3] += 3 * reach
    K = _np.array([[size * 1.2, 0, size / 2], [0, size * 1.2, size / 2], [0, 0, 1.0]])
    return self.render(viewmat[None], K[None], size, size, near=0.01 * reach)[0][0]


def _scene_png(self):
    return _darb.encode_png(_scene_picture(self))


def _scene_repr(self):
    return (f"<darb.Scene of {len(self)} splats, {self.kernel}, footprint {self.footprint}, "
            f"harmonics of degree {self.sh_degree}>")


_scene_of_arrays = Scene.from_arrays
Scene.from_arrays = staticmethod(_scene_from_arrays)
Scene.render = _scene_render
Scene.mesh = _scene_mesh
Scene.picture = _scene_picture
Scene._repr_png_ = _scene_png
Scene.__repr__ = _scene_repr

# --- Kernel --------------------------------------------------------------------------------------

Kernel.__doc__ = """A reconstruction kernel of one's own, wherever a kernel's name may stand.

    cubic = darb.Kernel(lambda q: (1 - q / 9) ** 3, support=9, name="cubic")
    cubic = darb.Kernel("(1 - q/9)^3", support=9)        # an expression in q and d
    image, alpha, info = darb.rasterize(..., kernel=cubic)

profile: w(q) of q = d^2, d the Mahalanobis distance; falling from w(0), which becomes 1, to the
edge at q = support, smooth in q. A polynomial of the shaders' degrees is fitted to it: error is
its largest distance, notes say what was changed. psi is the ratio of the projected second moment
to the 2x2 block of the covariance. kernel(q) is the fitted profile. Files that are written hold
the kernel. Of a name there is one kernel a process.
"""


# --- Dataset -------------------------------------------------------------------------------------

Dataset.__doc__ = """Photos with their cameras: a COLMAP project, transforms.json, and the like.

    data = darb.Dataset.read("garden", resolution=4, eval=True)
    data.viewmats [V, 4, 4], data.Ks [V, 3, 3]    float64; by name, as data.view(i)
    data.photo(i)                                 uint8 [H, W, 4]; alpha 0 is masked or empty
    data.points [P, 3] float64, data.point_colors [P, 3] uint8
"""


def _dataset_read(path, *, resolution=-1, eval=False, images="images", lens="auto"):
    """Reads the cameras and points; photos are read when they are asked for.

    resolution: 1, 2, 4, 8 divide, above 8 a width in px, -1 as they are but at most 1,600 px wide.
    eval: every 8th view is held out, or the source's own test views. images: the photo folder of
    a COLMAP project. lens: "auto", "undistort" or "original", as `darb train --lens`.
    """
    return Dataset._read(path, {"resolution": resolution, "eval": eval, "images": images,
                                "lens": lens})


def cameras(path):
    """The cameras of a cameras.json, a transforms.json or a data set; photos are not needed.

    -> a dict of viewmats [V, 4, 4] and Ks [V, 3, 3] in float64, and lists of names, widths and
    heights.
    """
    views = _darb.cameras(path)
    each = [views.view(i) for i in range(len(views))]
    return {"viewmats": views.viewmats, "Ks": views.Ks, "names": [v["name"] for v in each],
            "widths": [v["width"] for v in each], "heights": [v["height"] for v in each]}


Dataset.read = staticmethod(_dataset_read)
Dataset.__repr__ = lambda self: f"<darb.Dataset of {len(self)} views, {self.source}>"


# --- Trainer -------------------------------------------------------------------------------------

class Trainer(_darb.Trainer):
    """`darb train`, step by step, with the same options and the same bits.

        trainer = darb.Trainer("garden", resolution=4, iterations=7000, eval=True)
        while not trainer.step(100)["done"]:
            print(trainer.iteration, trainer.evaluate()["psnr"])
        trainer.scene().write("garden.ply")

    dataset: a path, or a Dataset, which brings its own resolution, eval, images and lens. Options
    have the names of `darb train --help-all` with underscores: kernel="raised_cosine",
    max_splats=100_000, effects="-exposure", random_background=False for --fixed-background.
    start_checkpoint=path goes on from a checkpoint of this class or of the command.

    step(n=1, loss=None) -> dict: iteration, loss, psnr (dB, of the training view), splats,
        visible, intersections, done. With batch=B, iterations count views: whole batches run until n
        views are done, with a loss of your own for each view. With loss, dL/dimage = loss(image, view)
        replaces the built-in loss: image is [H, W, 3] float32 as it is compared, not clamped; view is
        a dict of name, iteration, photo (uint8 [H, W, 4], of the image's size) and background [3].
        "loss" is then still that of the built-in one.
    evaluate() -> dict: psnr, ssim, views, over the views that are held out.
    scene() -> Scene: what a file of the run would hold.
    on_round: a function of a dict (iteration, before, after, grown, pruned), called after each
        round of density control, or None.
    checkpoint(path): saves everything that is needed to go on bit by bit.
    iteration, iterations, len(trainer): iterations done, iterations in all, current splats.
    options: every option by name, as it was given or by default.

    Ctrl-C ends step() between two iterations, and the run goes on with the next call.
    """

    def __init__(self, dataset, *, device="", **options):
        super().__init__(_device(device), dataset, options)

    def __repr__(self):
        return (f"<darb.Trainer at iteration {self.iteration} of {self.iterations}, "
                f"{len(self)} splats>")


# --- Kernels, plans ------------------------------------------------------------------------------

def psi(kernels=None, *, samples=24, cells=64, seed=0):
    """The correction factor psi of kernels in three ways: what `darb psi --json` writes, as a dict.

    kernels: names or Kernels, or None for the family. samples: random covariances of the grid; cells:
    its cells along each axis. ["kernels"][i]["exact"] is the ratio of moments, "grid" the paper's
    experiment, "least_squares" the best scale, and "distance_from_projection" how far each is off.
    """
    return _darb.psi(kernels, samples, cells, seed)


def sim1d(*, signals=None, kernels=None, primitives=(1, 5, 10), seeds=20, steps=10_000,
          samples=1000, lr=0.01):
    """Signals as sums of N kernels, fitted by Adam: what `darb sim1d --json` writes, as a dict.

    signals: names, or None for all; kernels: names or Kernels. ["rows"] has one row for each signal,
    kernel and number of primitives, with the median loss over the seeds.
    """
    return _darb.sim1d({"signals": signals, "kernels": kernels, "primitives": primitives,
                        "seeds": seeds, "steps": steps, "samples": samples, "lr": lr})


def plan(what, *, cameras=None, effects="auto", sh_degree=None, kernel=None, depth=False,
         resolution=-1, price=False, device=""):
    """Which effects a scene or a data set needs, and why: the rows of `darb plan --json`.

    what: a path. cameras: for a scene, those that will look at it. price: measures what each effect
    costs on the device, ms and bytes.
    """
    return _darb.plan({"what": what, "cameras": cameras, "effects": effects,
                       "sh_degree": sh_degree, "kernel": kernel, "depth": depth,
                       "resolution": resolution, "price": price, "device": device})
