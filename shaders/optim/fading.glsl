// SPDX-License-Identifier: MIT
// Fades splats that stand nearer to a training camera than the scene does. Needs position[] and lib/covariance.glsl.

const float FADING = 1.0;  // logit lost per frame. Adam regains it in at most 20, so what many photos support stays

bool stands_near(CameraData camera, uint i, float clearance) {
    return length(from_centre(camera, position[i])) < clearance;
}
