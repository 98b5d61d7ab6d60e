// SPDX-License-Identifier: MIT
// What C++ and GLSL share about the lens and the shutter of a camera.
#ifndef DARB_LENS_H
#define DARB_LENS_H

#define LENS_FOLD_NONE 1e18  // CameraData.lens_fold of a camera without lens terms: a pinhole

#define SHUTTER_LONGEST 0.75  // times of rows beyond the picture's edges, at 1/2, are held there
#define SHUTTER_SLOWEST \
    0.25                 // a point moves along with the rows by at most all of them less this share
#define SHUTTER_STEPS 4  // Newton's steps to the time of a row

#endif
