#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What the next attribute of splats takes. It adds one, `glow`, a float that is added to all three channels of the colour, to
a copy of the sources. There it is trained, kept by density control, saved, resumed and compared with the reference in double.

    tools/lab/new_attribute.py --check      whether the changes fit the sources and touch no more than 8 files
    tools/lab/new_attribute.py              builds the copy (build-attribute), runs `darb check` with it, trains the shipped
                                        scene, and checks that the attribute's gradients are right, that training changed
                                        its column in the PLY, and that a resumed run is bit-equal; takes minutes
"""

import os
import struct
import subprocess
import sys
import tempfile

from changed_copy import ROOT, built_copy, changed_texts

MOST_FILES = 8

# file, old text, text with the attribute
CHANGES = [
    ("shaders/shared/attribute_list.h", "#define ATTRIBUTES 7", "#define ATTRIBUTE_GLOW 7\n#define ATTRIBUTES 8"),
    ("engine/scene/splat_model.h", "    kShape = ATTRIBUTE_SHAPE,\n",
     "    kShape = ATTRIBUTE_SHAPE,\n    kGlow = ATTRIBUTE_GLOW,\n"),
    ("engine/scene/splat_model.h", "    std::vector<T> sh_rest; ",
     "    std::vector<T> glow;       // [N]\n    std::vector<T> sh_rest; "),
    ("engine/scene/splat_model.h", "&Arrays::shape};", "&Arrays::shape, &Arrays::glow};"),
    ("engine/scene/splat_model.h", "true, true, STEP_PLAIN, nullptr},\n",
     "true, true, STEP_PLAIN, nullptr},\n    {\"glow\", \"glow\", 7, 1, false, false, true, STEP_PLAIN, nullptr},\n"),
    ("shaders/forward/project.comp", "layout(set = 0, binding = FRAME_BINDING, scalar) writeonly buffer SplatShape {",
     "layout(set = 0, binding = 1 + ATTRIBUTE_GLOW, scalar) readonly buffer Glow { float glow[]; };\n"
     "layout(set = 0, binding = FRAME_BINDING, scalar) writeonly buffer SplatShape {"),
    ("shaders/forward/project.comp", "vec3 colour = first_band(sh_dc[i]);", "vec3 colour = glow[i] + first_band(sh_dc[i]);"),
    ("shaders/backward/project_gradient.glsl", "vec3 colour = first_band(sh_dc",
     "vec3 colour = glow[i] + first_band(sh_dc"),
    ("shaders/backward/project_backward.comp", "// The moments with UPDATE_ADAM, otherwise the gradients.\n",
     "layout(set = 0, binding = 1 + ATTRIBUTE_GLOW, scalar) buffer Glow { float glow[]; };\n"
     "layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_GLOW, scalar) buffer MGlow { vec2 m_glow[]; };\n"
     "layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_GLOW, scalar) buffer DGlow { float d_glow[]; };\n"
     "// The moments with UPDATE_ADAM, otherwise the gradients.\n"),
    ("shaders/backward/project_backward.comp", "    if (UPDATE == UPDATE_ADAM && stands_near(",
     "    UPDATE_ATTRIBUTE(vec2, glow[i], m_glow[i], d_glow[i], g.colour.r + g.colour.g + g.colour.b, ATTRIBUTE_GLOW)\n"
     "    if (UPDATE == UPDATE_ADAM && stands_near("),
    ("engine/reference/projection.cpp", "Vec3<T> colour(T(0.5));", "Vec3<T> colour(T(0.5) + splats.glow[index]);"),
    ("engine/reference/projection.cpp", "        out.sh_dc[index * 3 + c] = basis[0] * d_colour;\n",
     "        out.sh_dc[index * 3 + c] = basis[0] * d_colour;\n        out.glow[index] += d_colour;\n"),
    ("trainer/step/optimizer.cpp", "    step.rate[kShRest] = now.sh_rest;\n",
     "    step.rate[kShRest] = now.sh_rest;\n    step.rate[kGlow] = now.sh_dc;\n"),
]


def column(ply, name):
    """Reads a binary PLY of floats."""
    head, _, body = ply.partition(b"end_header\n")
    names = [line.split()[2].decode() for line in head.splitlines() if line.startswith(b"property ")]
    count = next(int(line.split()[2]) for line in head.splitlines() if line.startswith(b"element vertex "))
    return [struct.unpack_from("<f", body, 4 * (i * len(names) + names.index(name)))[0] for i in range(count)]


def trained(darb, folder, *options):
    subprocess.run([darb, "train", os.path.join(ROOT, "assets/scene"), "-o", folder, "-q", "--no-report", "-r", "100",
                    "--iterations", "160", *options], check=True, stdout=subprocess.DEVNULL)
    with open(os.path.join(folder, "point_cloud/iteration_160/point_cloud.ply"), "rb") as file:
        return file.read()


def main():
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(__doc__.strip())
        return 0
    texts = changed_texts("tools/lab/new_attribute.py", CHANGES)
    files = sorted(texts)
    print(f"a new attribute: {len(files)} files, at most {MOST_FILES}: {' '.join(files)}")
    if len(files) > MOST_FILES or "--check" in sys.argv[1:]:
        return 1 if len(files) > MOST_FILES else 0
    darb = built_copy("build-attribute", texts)
    subprocess.run([darb, "check"], check=True)
    with tempfile.TemporaryDirectory() as folder:
        scene = trained(darb, os.path.join(folder, "whole"), "--checkpoint-iterations", "80")
        start = os.path.join(folder, "whole", "chkpnt80.darb")
        resumed = trained(darb, os.path.join(folder, "resumed"), "--start-checkpoint", start)
    glow = column(scene, "glow")
    changed = sum(value != 0 for value in glow)
    print(f"trained: {changed} of {len(glow)} splats glow, from {min(glow):.3f} to {max(glow):.3f}; resumed: "
          f"{'the same scene' if resumed == scene else 'ANOTHER scene'}")
    return 0 if changed > len(glow) / 2 and resumed == scene else 1


if __name__ == "__main__":
    sys.exit(main())
