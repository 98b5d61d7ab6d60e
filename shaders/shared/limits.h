// SPDX-License-Identifier: MIT
// Limits at which parameters are clamped where they are read, and splats are rejected. A clamped
// parameter has a gradient of zero outside. Shared by C++ (engine/reference) and GLSL.
#ifndef DARB_LIMITS_H
#define DARB_LIMITS_H

#define LOG_SCALE_LIMIT 20.0  // log_scale is clamped to +-20: a standard deviation of 2e-9 .. 5e8
#define OPACITY_LOGIT_LIMIT \
    30.0  // logit is clamped to +-30: the sigmoid is 1 in float32 from 17 on
#define ROTATION_MIN_SQUARE 1e-12  // squared norm of a quaternion below which a splat is rejected
#define DETERMINANT_MIN 1e-12      // px^4, of the projected covariance with the low-pass
#define ROW_LIMIT 1048576.0        // px; beyond it the rows of M are scaled, as float32 overflows
#define ALPHA_MAX 0.99             // bounds 1 - alpha, the divisor of the backward pass, by 0.01
#define TRANSMITTANCE_STOP 1e-4    // a pixel ends before the splat that would bring it below
// Relative, and taken off any stop: 0.01 of each clamped layer is left, so that T meets 1e-2, 1e-4
// and 1e-6 exactly, which float32 misses by 1e-6 to 3e-6 of it downwards. Such a T counts as not
// below the stop.
#define TRANSMITTANCE_SLACK 1e-5
#define ALPHA_CUTOFF_DEFAULT (1.0 / 255.0)
#define GRADIENT_LIMIT 1e18   // beyond it the square, for the second moment, leaves float32
#define LOW_PASS_DEFAULT 0.3  // px^2
#define NEAR_DEFAULT 0.2      // world units

#define JACOBIAN_MARGIN 0.3  // the Jacobian is clamped to the image plus this share of W/(2 fx)
#define TILE_SIZE 16         // px, both ways; a blend workgroup owns one tile

#endif
