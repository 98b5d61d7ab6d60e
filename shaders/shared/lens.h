// SPDX-License-Identifier: MIT
// What C++ and GLSL share about the lens of a camera.
#ifndef DARB_LENS_H
#define DARB_LENS_H

#define LENS_FOLD_NONE 1e18  // CameraData.lens_fold of a camera without lens terms: a pinhole

#endif
