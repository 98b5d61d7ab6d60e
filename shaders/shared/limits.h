// SPDX-License-Identifier: MIT
// The limits to which parameters are clamped where they are read, and at which splats are rejected.
// A clamped parameter has a gradient of zero beyond its limit. Shared by C++ (engine/reference) and
// GLSL.
#ifndef DARB_LIMITS_H
#define DARB_LIMITS_H

#define LOG_SCALE_LIMIT 20.0  // log_scale is clamped to +-20: a standard deviation of 2e-9 .. 5e8
#define OPACITY_LOGIT_LIMIT \
    30.0  // logit is clamped to +-30: the sigmoid is 1 in float32 from 17 on
// a quaternion with a smaller squared norm is rejected with its splat
#define ROTATION_MIN_SQUARE 1e-12
#define DETERMINANT_MIN 1e-12  // px^4, of the projected covariance with the low-pass
// px; beyond it the rows of M are scaled down, as float32 would overflow
#define ROW_LIMIT 1048576.0
#define ALPHA_MAX 0.99           // bounds 1 - alpha, the divisor of the backward pass, by 0.01
#define TRANSMITTANCE_STOP 1e-4  // a pixel ends before the splat that would bring it below
// Relative, and taken off any stop. Each clamped layer leaves 0.01, so in exact arithmetic T meets
// 1e-2, 1e-4 and 1e-6, which float32 misses downwards by 1e-6 to 3e-6 of it. With the slack such a
// T does not count as below the stop.
#define TRANSMITTANCE_SLACK 1e-5
#define ALPHA_CUTOFF_DEFAULT (1.0 / 255.0)
#define GRADIENT_LIMIT 1e18   // beyond it the square, which is the second moment, exceeds float32
#define LOW_PASS_DEFAULT 0.3  // px^2
#define NEAR_DEFAULT 0.2      // world units

#define JACOBIAN_MARGIN 0.3  // the Jacobian is clamped to the image plus this share of W/(2 fx)
#define TILE_SIZE 16         // px in both directions; a blend workgroup owns one tile

#endif
