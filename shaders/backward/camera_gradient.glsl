// SPDX-License-Identifier: MIT
// dL/d(camera) of one splat, with respect to the numbers that project.comp computes with, each of them free: the
// rotation's nine entries by rows with the centre held, then fx, fy, cx, cy, and the shutter's turn and move. Used with
// CAMERA_GRADIENT; camera_sums.comp or the host adds the splats up, and the effect of the centre is in dL/d(position).
// A lens keeps its own terms. Needs camera_model.glsl and shutter.glsl.

layout(constant_id = 30) const int CAMERA_GRADIENT = 0;

// dL/df and dL/dc through one row of the Jacobian, (f/z, ., -f ratio/z). Where the ratio is held at the picture's
// margin, the last entry depends on c but not on f. d: gradients of the row's first and last entry.
vec2 focal_gradient(vec2 d, float ratio, float free_ratio, float z, float d_pixel) {
    const bool held = ratio != free_ratio;
    return vec2(d_pixel * free_ratio + (d.x - (held ? 0.0 : d.y * ratio)) / z,
                d_pixel + (held ? d.y / z : 0.0));
}

void store_camera_gradient(CameraData camera, uint i, vec3 p, vec3 to_splat, vec3 d_p, mat2x3 j, mat2x3 d_t,
                           mat2x3 d_j, vec2 d_mean) {
    const uint at = CAMERA_SHARES * i;
    for (uint k = 0u; k < 3u; ++k) {
        const vec3 row = d_p[k] * to_splat + j[0][k] * d_t[0] + j[1][k] * d_t[1];
        for (uint c = 0u; c < 3u; ++c) camera_gradient[at + 3u * k + c] = row[c];
    }
    const vec2 free = p.xy / p.z, ratio = clamped_ratio(camera, free);
    vec2 of_x = focal_gradient(d_j[0].xz, ratio.x, free.x, p.z, d_mean.x);
    vec2 of_y = focal_gradient(d_j[1].yz, ratio.y, free.y, p.z, d_mean.y);
    if (distorts(camera)) {  // pixel and rows scale with f; the limit of the ratio belongs to the lens
        const vec2 value = lens_point(camera, free).value;
        of_x = vec2(d_mean.x * value.x + dot(d_j[0], j[0]) / camera.focal.x, d_mean.x);
        of_y = vec2(d_mean.y * value.y + dot(d_j[1], j[1]) / camera.focal.y, d_mean.y);
    }
    camera_gradient[at + 9u] = of_x.x;
    camera_gradient[at + 10u] = of_y.x;
    camera_gradient[at + 11u] = of_x.y;
    camera_gradient[at + 12u] = of_y.y;
    if (SHUTTER == 0)
        for (uint c = CAMERA_SHARE_SHUTTER; c < CAMERA_SHARES; ++c) camera_gradient[at + c] = 0.0;
}

// What reaches the camera through sigma points. axes: the splat's, in the world, each as long as its standard deviation.
void add_sigma_camera_gradient(uint i, mat3 axes, SigmaGradient g) {
    const uint at = CAMERA_SHARES * i;
    const mat3 by_row = axes * transpose(g.d_axes);  // column: row of the rotation
    for (uint k = 0u; k < 3u; ++k)
        for (uint c = 0u; c < 3u; ++c) camera_gradient[at + 3u * k + c] += by_row[k][c];
    camera_gradient[at + 9u] += g.d_focal.x;
    camera_gradient[at + 10u] += g.d_focal.y;
}

// twist: dL/d(a turn of the row's camera, on the left).
void store_shutter_gradient(CameraData camera, uint i, float time, vec3 p, vec3 d_p, vec3 twist, vec3 d_view,
                            ShutterMotion m, ShutterGradient g) {
    const vec3 angle = time * camera.shutter_turn;
    const vec3 d_turn = time * left_jacobian_transposed(twist - cross(m.swing, g.d_velocity), angle) +
                        cross(p, g.d_velocity);
    const vec3 d_move = -turned(time * (d_p + to_camera(camera, d_view)) + g.d_velocity, -angle);
    const uint at = CAMERA_SHARES * i + CAMERA_SHARE_SHUTTER;
    for (uint c = 0u; c < 3u; ++c) {
        camera_gradient[at + c] = d_turn[c];
        camera_gradient[at + 3u + c] = d_move[c];
    }
}

// From the rotation of the row at this time to that of the middle row, whose `move` the centre of the row follows, too.
// d_view: dL/d(position) through the view direction.
void turn_back_camera_gradient(CameraData camera, uint i, float time, vec3 d_view) {
    const uint at = CAMERA_SHARES * i;
    for (uint c = 0u; c < 3u; ++c) {
        const vec3 column = vec3(camera_gradient[at + c], camera_gradient[at + 3u + c], camera_gradient[at + 6u + c]);
        const vec3 middle = turned(column, -time * camera.shutter_turn) - time * d_view[c] * camera.shutter_move;
        for (uint k = 0u; k < 3u; ++k) camera_gradient[at + 3u * k + c] = middle[k];
    }
}

void clear_camera_gradient(uint i) {
    for (uint c = 0u; c < CAMERA_SHARES; ++c) camera_gradient[CAMERA_SHARES * i + c] = 0.0;
}
