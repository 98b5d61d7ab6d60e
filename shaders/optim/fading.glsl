// SPDX-License-Identifier: MIT
// What stands nearer to a camera of training than the scene does fades. Needs position[] and lib/covariance.glsl.

const float FADING = 1.0;  // logit lost per frame: Adam regains it in at most 20, so what many photos hold up stays

bool stands_near(CameraData camera, uint i, float clearance) {
    return length(from_centre(camera, position[i])) < clearance;
}
