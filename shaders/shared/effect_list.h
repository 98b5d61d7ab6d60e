// SPDX-License-Identifier: MIT
// The list of effects: what a scene may need beyond plain splats. Each is compiled in, and has its
// buffers and gradients, only when it is on. The rules are in engine/plan/effect_plan.cpp.
#ifndef DARB_EFFECT_LIST_H
#define DARB_EFFECT_LIST_H

#define EFFECT_VIEW_COLOUR 0  // view-dependent colour by spherical harmonics of degree 1 to 3
#define EFFECT_ANTIALIAS 1    // opacity compensation of the low-pass, and the 3D smoothing filter
#define EFFECT_EXPOSURE 2     // an affine map of colours per photo
#define EFFECT_OFF_CENTRE 3   // a principal point off the image's centre
#define EFFECT_LENS 4         // lens distortion in the projection
#define EFFECT_ALPHA 5        // photos with alpha or masks, and a background behind them
#define EFFECT_DEPTH 6        // a picture of depths
#define EFFECT_HUGE 7         // splats over very many tiles, and very long lists of tiles
#define EFFECT_NEAR 8      // splats beside the picture that reach into it; the Jacobian is clamped
#define EFFECT_CAMERAS 9   // poses and intrinsics are trained beside the splats
#define EFFECT_SURFACE 10  // terms of the loss that lay splats on surfaces
#define EFFECT_SHUTTER 11  // rows of a photo that are exposed one after the other
#define EFFECT_COUNT 12

#ifdef __cplusplus
// Their names on the command line and in files, in the order of the numbers.
#define EFFECT_NAMES                                                                       \
    "sh", "antialias", "exposure", "off_centre", "lens", "alpha", "depth", "huge", "near", \
        "cameras", "surface", "shutter"
#endif

#endif
