// SPDX-License-Identifier: MIT
// The switches of the effects that live in the projection, forward and backward alike. A switch frozen to 0 leaves no
// instruction of its effect and no read of its data.

layout(constant_id = 200) const int OFF_CENTRE = 1;  // 0: the principal point is the image's centre
layout(constant_id = 201) const int ANTIALIAS = 0;  // the opacity is compensated for the low-pass
layout(constant_id = 202) const int SMOOTHING = 0;   // the 3D smoothing filter widens each splat
layout(constant_id = 203) const int LENS = 0;        // the lens distorts the projection
layout(constant_id = 205) const int SHUTTER = 0;     // the pose is that of the row
layout(constant_id = 204) const int NEAR_CARE = 1;   // x/z and y/z are clamped in the Jacobian
layout(constant_id = 206) const int PROJECTION = 0;  // PROJECTION_*: by the Jacobian, or by sigma points

const bool FILTERED = ANTIALIAS == 1 || SMOOTHING == 1;  // the opacity depends on the shape
