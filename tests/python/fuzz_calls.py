#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Random calls of the Python package: each returns or raises an exception with a text.

    fuzz_calls.py [--calls N] [--seed S] [--seconds T]

Arguments are right, wrong in one place, or nonsense: shapes, types, order, released memory, NaN,
huge numbers, other objects. An abort, a hang, an empty message or an exception of another kind than
darb.Error, TypeError, MemoryError and what a callback raises is a finding. With the engine under
ASan:

    cmake -B build-python-asan -G Ninja -DCMAKE_CXX_COMPILER=g++ -DCMAKE_BUILD_TYPE=Debug \
        -DCMAKE_CXX_FLAGS_DEBUG=-O1 -DCMAKE_UNITY_BUILD=ON -DDARB_SANITIZE=address \
        -DDARB_PYTHON=ON
    cmake --build build-python-asan --target darb_python
    LD_PRELOAD="$(g++ -print-file-name=libasan.so) $(g++ -print-file-name=libstdc++.so)" \
        ASAN_OPTIONS=detect_leaks=0 \
        PYTHONPATH=build-python-asan/python /usr/bin/python3 tests/python/fuzz_calls.py
"""

import argparse
import collections
import os
import pathlib
import random
import tempfile
import time

import support

try:
    import numpy as np

    import darb
except ModuleNotFoundError as error:  # one that is there and does not load fails the test
    support.skip(f"the module is not here: {error}")

ODD_NUMBERS = (0, -1, 1, 2, 3, 7, 1.5, -0.0, 1e-30, 1e30, 1e39, 2**31, 2**63, 2**200, float("nan"),
               float("inf"), -float("inf"))


class Weird:
    def __getattr__(self, name):
        raise ValueError(f"no {name}")


class Lying:
    """An array interface that fails in the middle."""

    def __dlpack_device__(self):
        return (1, 0)

    def __dlpack__(self, **_):
        raise BufferError("gone")


def released():
    view = memoryview(np.zeros((4, 3), np.float32))
    view.release()
    return view


def odd_objects(rng):
    return rng.choice((
        None, True, "", "gaussian", "\udc80", b"x", [], (), {}, object(), Weird(), Lying(), released(),
        lambda *a: None, rng.choice(ODD_NUMBERS), np.float32(3), np.int64(4), np.zeros(()),
        np.zeros((0, 3), np.float32), np.zeros((2, 3), "U3"), np.zeros((2, 3), complex),
        np.ma.masked_array(np.zeros((3, 3), np.float32)), range(3), Ellipsis, darb, int))


def odd_array(rng, good):
    """The array with one thing wrong, or not."""
    a = np.array(good)
    kind = rng.randrange(12)
    if kind == 0:
        return a.astype(rng.choice(("f8", "f2", "i4", "u1", "bool", ">f4", "c8", "O")))
    if kind == 1 and a.ndim > 1:
        return np.asfortranarray(a)
    if kind == 2 and a.ndim:
        return a[..., ::-1]
    if kind == 3 and a.size:
        a.flat[rng.randrange(a.size)] = rng.choice(
            (np.nan, np.inf, -np.inf, 3.4e38, -3.4e38, 1e-45, -1, 2, 0))
        return a
    if kind == 4 and a.ndim:
        return a[:rng.randrange(a.shape[0] + 1)]
    if kind == 5:
        return a[None]
    if kind == 6:
        return a.reshape(-1)
    if kind == 7:
        return np.broadcast_to(np.float32(rng.choice((0, 1, -1, 1e20))), a.shape)
    if kind == 8:
        return memoryview(a) if a.size else a
    if kind == 9:
        return a.tolist()
    if kind == 10 and a.size:
        raw = np.frombuffer(bytes(a.nbytes + 1), np.uint8)[1:].view(np.float32)
        return raw.reshape(a.shape) if a.dtype == np.float32 else a
    return (a * np.float32(rng.choice((0, 1e-20, 1e10, 1e20, -1)))).astype(a.dtype)


def random_call(rng):
    count = rng.choice((0, 1, 2, 5, 20))
    sh = rng.choice((None, None, 1, 4, 9, 16))
    arguments = dict(support.splats(count, rng.randrange(100), sh))
    pictures = support.camera(rng.choice((1, 1, 2)), rng.choice((1, 7, 16, 33)),
                              rng.choice((1, 5, 16, 40)), rng.choice((1e-3, 20.0, 1e4)))
    arguments.update(pictures)
    arguments.update(rng.choice((
        {}, {}, {"kernel": rng.choice(darb.kernel_names())}, {"footprint": "exact"},
        {"background": [0.1, 0.2, 0.3]}, {"antialiased": True}, {"near": 1e-3},
        {"accuracy": rng.choice(("fast", "exact", "balanced"))}, {"sh_degree": rng.randrange(4)},
        {"depth": True}, {"kernel": "beta", "shapes": support.shapes(count)})))
    return arguments


def spoil(rng, arguments):
    for _ in range(rng.choice((0, 1, 1, 1, 2))):
        name = rng.choice(list(arguments))
        value = arguments[name]
        if isinstance(value, np.ndarray) and rng.random() < 0.7:
            arguments[name] = odd_array(rng, value)
        elif rng.random() < 0.1:
            del arguments[name]
        elif rng.random() < 0.3 and name in ("width", "height", "near", "sh_degree"):
            arguments[name] = rng.choice(ODD_NUMBERS[:9])
        else:
            arguments[name] = odd_objects(rng)
    return arguments


def rasterize(rng, world):
    return darb.rasterize(**spoil(rng, random_call(rng)))


def backward(rng, world):
    arguments = random_call(rng)
    arguments.pop("depth", None)
    d_image, d_alpha = support.weights(arguments, rng.randrange(9))
    arguments.update(d_image=d_image, camera=rng.random() < 0.3, picture=rng.choice((0, 0, 1, 9)))
    if rng.random() < 0.5:
        arguments["d_alpha"] = d_alpha
    return darb.rasterize_backward(**spoil(rng, arguments))


def scene(rng, world):
    one = rng.choice(world["scenes"])
    what = rng.randrange(6)
    if what == 0:
        one = darb.Scene.from_arrays(**spoil(rng, support.splats(rng.choice((0, 3, 9)), 3, 4)))
        world["scenes"][rng.randrange(len(world["scenes"]))] = one
    elif what == 1:
        name = rng.choice(("means", "log_scales", "quats", "opacity_logits", "sh_dc", "sh_rest",
                           "shapes"))
        value = getattr(one, name)
        if value is None:
            value = support.shapes(len(one))
        setattr(one, name, odd_array(rng, value) if rng.random() < 0.8 else odd_objects(rng))
    elif what == 2:
        setattr(one, rng.choice(("kernel", "footprint", "antialiased")), rng.choice(
            ("gaussian", "sinc", "beta", "exact", "psi", True, False, odd_objects(rng))))
    elif what == 3:
        pictures = support.camera(1, 20, 20)
        return one.render(**spoil(rng, pictures))
    elif what == 4:
        path = world["folder"] / rng.choice(("a.ply", "a.spz", "a.splat", "b.txt", "nowhere/a.ply"))
        one.write(path if rng.random() < 0.8 else odd_objects(rng))
        return darb.Scene.read(path)
    else:
        return one.picture(rng.choice((8, 16))), repr(one), len(one)


def files(rng, world):
    path = world["folder"] / "damaged.ply"
    data = bytearray(world["ply"])
    for _ in range(rng.randrange(4)):
        data[rng.randrange(len(data))] = rng.randrange(256)
    path.write_bytes(data[:rng.choice((len(data), rng.randrange(len(data))))])
    return darb.Scene.read(path)


def others(rng, world):
    odd = odd_objects(rng)
    what = rng.randrange(7)
    if what == 6:
        return darb.Kernel(rng.choice((odd, lambda q: odd, lambda q: 1 - q / 4, lambda q: q,
                                       "1 - q/4", "foo(")),
                           rng.choice((4, 9, odd, *ODD_NUMBERS)), rng.choice(("", "a", "A b", odd)))
    if what == 0:
        return darb.Dataset.read(odd)
    if what == 1:
        return darb.Trainer(support.SHIPPED, **{rng.choice(
            ("iterations", "kernel", "lambda_dssim", "output", "x", "eval", "r")): odd},
            resolution="no")
    if what == 2:
        return darb.write_png(world["folder"] / "a.png",
                              odd_array(rng, np.zeros((4, 5, 3), np.float32)))
    if what == 3:
        return darb.device(odd)
    if what == 4:
        return darb.psi(odd, samples=rng.choice((0, 1, odd)), cells=8) if rng.random() < 0.3 else \
            darb.sim1d(signals=odd, kernels=odd, primitives=odd, seeds=1, steps=2, samples=16)
    return darb.plan(odd)


def train(rng, world):
    trainer = world["trainer"]
    what = rng.randrange(4)
    if what == 0:
        return trainer.step(odd_objects(rng) if rng.random() < 0.5 else 1)
    if what == 1:
        return trainer.step(1, loss=lambda image, view: odd_array(rng, image * 0))
    if what == 2:
        return trainer.step(1, loss=rng.choice((odd_objects(rng), lambda: 3, lambda i, v: odd_objects(rng))))
    return trainer.checkpoint(odd_objects(rng)), trainer.evaluate()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--calls", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=1e9)
    given = parser.parse_args()
    np.seterr(all="ignore")
    tally = collections.Counter()
    folder = tempfile.TemporaryDirectory()
    os.chdir(folder.name)  # an odd path may name a file of here
    world = {"folder": pathlib.Path(folder.name),
             "scenes": [darb.Scene.from_arrays(**support.splats(n, n, 4)) for n in (1, 5)]}
    world["scenes"][0].write(world["folder"] / "good.ply")
    world["ply"] = (world["folder"] / "good.ply").read_bytes()
    kinds = [rasterize] * 5 + [backward] * 3 + [scene] * 4 + [files, others, others]
    if support.SHIPPED.exists():
        world["trainer"] = darb.Trainer(support.SHIPPED, resolution=16, iterations=100_000,
                                        max_splats=500, eval=True, effects="-exposure")
        kinds.append(train)
    end = time.monotonic() + given.seconds
    done = 0
    for number in range(given.calls):
        if time.monotonic() > end:
            break
        rng = random.Random(given.seed * 1_000_003 + number)
        call = rng.choice(kinds)
        try:
            call(rng, world)
            tally[call.__name__, "returned"] += 1
        except (darb.Error, TypeError, MemoryError) as error:
            assert str(error).strip(), f"call {number}: {type(error)} without a text"
            tally[call.__name__, type(error).__name__] += 1
        except (ValueError, AttributeError, UnicodeError, OSError) as error:
            # numpy's own, made before the call, and what an odd object raises itself.
            tally[call.__name__, type(error).__name__] += 1
            assert str(error).strip(), f"call {number}: {type(error)} without a text"
        done += 1
    for (name, outcome), count in sorted(tally.items()):
        print(f"{count:6d}  {name:10s} {outcome}")
    print(f"{done} calls from seed {given.seed}: no abort")
    if done > 200:
        assert tally["rasterize", "returned"] and tally["rasterize", "Error"], tally


if __name__ == "__main__":
    main()
