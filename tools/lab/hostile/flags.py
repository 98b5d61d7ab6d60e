# SPDX-License-Identifier: MIT
"""Part 4: random combinations of the options of every command, as --help lists them, with values at and beyond their
limits. Values that only make a run long are left out."""

import os
import re
import subprocess

import mutate

WEIGHT = 3

# command: (options that keep it short, positional arguments to choose from)
BASES = {
    "train": ("--iterations 4 | -q | -o out/run", ["in/colmap in/text in/frames in/bare"]),
    "eval": ("", ["in/run in/scenes/scene.ply in/scenes/scene.spz", "in/colmap in/frames"]),
    "render": ("--cameras in/cameras.json | -o out/frames", ["in/run in/scenes/scene.splat"]),
    "view": ("--screenshot out/s.png | --size 64x48", ["in/run in/scenes/scene.sog in/frames/points.ply"]),
    "convert": ("", ["in/run in/scenes/scene.ply in/scenes/scene.sog",
                     "out/a.ply out/a.spz out/a.splat out/a.compressed.ply out/a.glb out/a.sog out/lod/lod-meta.json out/a.html out/a.txt out"]),
    "info": ("", ["in/run in/scenes/scene.ply in/colmap in/cameras.json in/path.json in"]),
    "plan": ("--no-price", ["in/run in/colmap in/scenes/scene.ply"]),
    "compare": ("-o out/c | --kernels gaussian | --iterations 3 | --blending-views 0 | -q",
                ["in/colmap in/colmap@images in/frames"]),
    "psi": ("--kernels sinc | --samples 2 | --cells 16", []),
    "sim1d": ("--signals square | --kernels gaussian | -N 2 | --seeds 1 | --steps 5 | -q", []),
    "devices": ("", []),
    "bench": ("--seconds 0 | --samples 1 | -q", ["no_such_case"]),
}
# Options whose usual values only make a run long: these values are chosen instead.
SHORT = {
    "--iterations": ["1", "2", "7"], "--steps": ["1", "9"], "--samples": ["1", "3"], "--cells": ["8", "20"], "--seeds": ["1", "2"],
    "--primitives": ["1", "3", "1,2"], "-N": ["1", "3"], "--seconds": ["0"], "--most-splats": ["1000"], "--fps": ["1", "30", "240"],
    "--threads": ["0", "1", "3"], "--train-options": ["--kernel sinc", "", "--nothing", "-o mine", "--iterations 2"],
    "--blending-views": ["0", "1"], "--size": ["64x48", "1x1", "7x3", "0x0", "-1x5", "x", "64", "64x", "1000000x1000000",
                                              "4294967296x1", "64x48x2", "0x10", "1e3x5"],
}
LEFT_OUT = {"--retune", "--view", "--growth", "--full", "--every-kernel", "--times", "--compare-all", "--train"}
KNOWN = {
    "--kernel": ["gaussian", "raised_cosine", "half_cosine_squared", "sinc", "inverse_quadratic", "cosine", "parabolic"],
    "--kernels": ["paper", "gaussian", "sinc,gaussian", "sinc,", ",", "gaussian,gaussian"],
    "--effects": ["all", "none", "auto", "+exposure,-sh", "-lens", "all,-lens", "+nothing", "+", "all,all", "-sh"],
    "--strategy": ["adc", "mcmc", "budget", "ADC"], "--accuracy": ["fast", "balanced", "exact"],
    "--device": ["0", "llvm", "1", "99", "-1", "nobody's"],
    "--max-memory": ["1", "1MB", "80MB", "800MB", "1.5GB", "99999999GB", "-1", "0"],
    "--up": ["x", "-x", "y", "-y", "z", "-z", "w"], "--rotate": ["10,20,30", "1,2", "a,b,c", "1e300,0,0", "nan,0,0"],
    "--translate": ["1,2,3", "1e38,1e38,1e38", ",,"], "--crop": ["-1,-1,-1,1,1,1", "1,1,1,-1,-1,-1", "0,0,0,0,0,0", "1,2,3"],
    "--scale": ["1", "1e-30", "1e30", "0", "-1"],
    "--resolution": ["1", "2", "4", "8", "9", "16", "3", "0", "-1", "-5", "100000", "2147483647"],
    "--footprint": ["psi", "exact", "file"], "--images": ["images", "masks", "none", "..", "/dev", "sparse"],
    "--cameras": ["in/cameras.json", "in/colmap", "in/frames", "in/run", "in/path.json", "mine/notes.txt"],
    "--path": ["in/path.json", "in/cameras.json", "none"], "--start-checkpoint": ["in/run/checkpoint.darb", "in/path.json", "in"],
    "--lpips": ["in/weights.safetensors", "in/path.json"], "--source-path": ["in/colmap", "in/frames", "none"],
    "--tune": ["scatter=ballot", "backward=buckets", "backward=subgroup", "exp=builtin", "none=1", "=", ","],
    "--random-points": ["1", "10", "1000", "0", "4000000000", "100000000", "18446744073709551615"],
    "--signals": ["square", "all", "none"], "--scene": ["in/scenes/scene.ply", "in/run"],
    "--cap-max": ["1", "5", "40", "100", "4294967295", "4294967296", "0"], "--data": ["in", "none"],
}
OUTPUTS = {"--json": "out/numbers.json", "--html": "out/page.html", "--screenshot": "out/s.png", "--export": "out/frames",
           "--output": "out/other", "--dump": "out/dump"}


class Option:
    def __init__(self, names, kind, text):
        self.names, self.kind = names, kind
        self.choices = re.findall(r"\{([^}]*)\}", kind)
        self.default = re.findall(r"\[([^\]\s]+)\]\s*$", text)
        ends = re.search(r"in \[(\S+) - (\S+)\]", kind)
        self.ends = ends.groups() if ends else None

    def name(self, rng):
        return rng.choice(self.names)

    def value(self, rng):
        """One word; for lists sometimes several; None for a switch."""
        main = max(self.names, key=len)
        if not self.kind:
            return None
        short = next((SHORT[n] for n in self.names if n in SHORT), None)
        if short:
            return rng.choice(short + ["0", "-1", "1e999", "x", "", "1.5"]) if rng.random() < 0.5 else rng.choice(short)
        known = next((KNOWN[n] for n in self.names if n in KNOWN), None)
        output = next((OUTPUTS[n] for n in self.names if n in OUTPUTS), None)
        if output:
            return rng.choice([output] * 6 + ["out/kept", "out/link", "mine/notes.txt/x", "/dev/full", "out/" + "n" * 300, ""])
        roll = rng.random()
        if roll < 0.1:
            return rng.choice(mutate.HOSTILE_TEXT)
        if known and roll < 0.9:
            return rng.choice(known)
        if self.choices and roll < 0.85:
            return rng.choice(self.choices[0].split(","))
        number = self.default and re.fullmatch(r"[-+0-9.e]+", self.default[0])
        if re.match("INT|UINT|FLOAT", self.kind) or number and roll < 0.9:
            return self.number(rng)
        if roll < 0.5 and not known:
            return self.number(rng)
        if self.default and roll < 0.7:
            return rng.choice(self.default)
        return rng.choice(mutate.HOSTILE_TEXT + mutate.HOSTILE_NUMBERS) if main else None

    def number(self, rng):
        if self.ends and rng.random() < 0.7:
            low, high = (float(end) for end in self.ends)
            value = rng.choice([low, high, (low + high) / 2, low - 1, high + 1, low + (high - low) * rng.random()])
            return f"{value:.0f}" if "INT" in self.kind else f"{value:g}"
        if rng.random() < 0.5:
            return rng.choice(["0", "1", "2", "3", "10", "100"] + ([] if "INT" in self.kind else ["0.5", "0.01", "1e-6"]))
        return rng.choice(mutate.HOSTILE_NUMBERS)


def options_of(day, command):
    """The options in the command's help; what each takes is what the command says when the value is missing."""
    if ("options", command) in day.store:
        return day.store[("options", command)]

    def said(*words):
        done = subprocess.run([day.darb, command, *words], capture_output=True, text=True, check=False)
        return done.stdout + done.stderr
    found = []
    for match in re.finditer(r"^  (-[^\s,]+(?:, -[^\s,]+)*)(.*(?:\n {10,}.*)*)", said("--help-all"), re.MULTILINE):
        names = match.group(1).split(", ")
        if LEFT_OUT.intersection(names) or "--help" in names or "--help-all" in names:
            continue
        typed = re.search(r"\d required (\S+( in \[[^\]]*\])?) missing", said("--no-such-option", names[-1]))
        found.append(Option(names, typed.group(1) if typed else "", match.group(2)))
    if not found or command in ("train", "view") and not any(option.kind for option in found):
        raise RuntimeError(f"the options of {command} were not understood")
    day.store[("options", command)] = found
    return found


def one(case):
    rng = case.random
    command = rng.choice([*BASES, "train", "train", "convert", "render", "view"])
    base, positional = BASES[command]
    for sample in ("colmap", "text", "frames", "bare", "run", "scenes", "cameras.json", "path.json", "weights.safetensors"):
        case.take(sample, f"in/{sample}")
    case.add_foreign()
    words, used = [], set()
    available = options_of(case.day, command)
    for option in rng.sample(available, min(len(available), rng.choice([0, 1, 1, 2, 2, 3, 4, 6, 10]))):
        name, value = option.name(rng), option.value(rng)
        used |= set(option.names)
        joined = value is not None and (value.startswith("-") or rng.random() < 0.1) and name.startswith("--")
        words += [f"{name}={value}"] if joined else [name] if value is None else [name, value]
        if "..." in option.kind and rng.random() < 0.5 and value:
            words.append(option.value(rng) or "1")
    for pair in [option.split() for option in base.split("|") if option]:  # unless chosen above
        words += [] if pair[0] in used else pair
    front = [rng.choice(choices.split()) for choices in positional]
    if rng.random() < 0.03:
        front = front[:-1] if rng.random() < 0.5 else front + [rng.choice(mutate.HOSTILE_TEXT)]
    words = [*front, *words] if rng.random() < 0.7 else [*words, "--", *front]
    if rng.random() < 0.02:
        odd = rng.choice(["--nothing", "-z", "--", "-", "", "--iterations", "@in/path.json"])
        words.insert(rng.randrange(len(words) + 1), odd)
    case.what = f"{command} {' '.join(words)}"
    if any(word == "out/link" for word in words):
        case.owned |= {"out/link", "out/notes.txt"}  # named as an output
    case.guard()
    case.run([command, *words])
    if "" in words or any(".." in word or word in (".", "mine/notes.txt") for word in words):
        case.owned |= {"mine/notes.txt"}
    # Relative names from HOSTILE_TEXT are legal outputs, and lie in the working folder.
    values = [word.split("=")[-1] for word in words if word and "\0" not in word]
    case.check_kept([os.path.relpath(case.path(value), case.folder).split("/")[0] for value in values])
