// SPDX-License-Identifier: MIT
// A rolling shutter in the projection: every splat is seen by the camera as it was when the row of its centre was
// exposed. The terms and the pose at a time are those of engine/scene/camera.h. Source: docs/math.md, Rolling shutter.
// Needs covariance.glsl and camera_model.glsl.

// exp(w) v, by Rodrigues' formula.
vec3 turned(vec3 v, vec3 w) {
    const float square = dot(w, w), angle = sqrt(square), sine = sin(0.5 * angle);
    const bool small = square < 1e-6;
    const float a = small ? 1.0 - square / 6.0 : sin(angle) / angle;
    const float b = small ? 0.5 - square / 24.0 : 2.0 * sine * sine / square;
    const vec3 across = cross(w, v);
    return v + a * across + b * cross(w, across);
}

// How a point of the camera moves at the time t, in the camera of that time.
struct ShutterMotion {
    vec3 swing;     // exp(t turn) move
    vec3 velocity;  // dp/dt
    vec2 pixel;     // d(pixel)/dt, px
    float per_row;  // dt/d(row), 1/px; 0 where t is held at its limit
};

// j0, j1: rows of the projection's Jacobian at p.
ShutterMotion shutter_motion(CameraData camera, float t, vec3 p, vec3 j0, vec3 j1) {
    ShutterMotion m;
    m.swing = turned(camera.shutter_move, t * camera.shutter_turn);
    m.velocity = cross(camera.shutter_turn, p) - m.swing;
    m.pixel = vec2(dot(j0, m.velocity), dot(j1, m.velocity));
    const float rows = float(camera.height);
    m.per_row = abs(t) < SHUTTER_LONGEST ? 1.0 / max(rows - m.pixel.y, SHUTTER_SLOWEST * rows) : 0.0;
    return m;
}

// The time at which the row of a point is exposed. middle: the point in the camera of the middle row. Newton's steps
// on row(t) / height - 1/2 = t.
float row_time(CameraData camera, vec3 middle) {
    float t = 0.0;
    for (int k = 0; k < SHUTTER_STEPS; ++k) {
        const vec3 p = turned(middle - t * camera.shutter_move, t * camera.shutter_turn);
        vec3 j0, j1;
        vec2 pixel;
        jacobian_rows(camera, p, j0, j1);
        pixel_of(camera, p, pixel);
        const float rows = float(camera.height), speed = shutter_motion(camera, t, p, j0, j1).pixel.y;
        precise const float miss = pixel.y - rows * (0.5 + t);  // not fused with what pixel.y is made of
        t = clamp(t + miss / max(rows - speed, SHUTTER_SLOWEST * rows), -SHUTTER_LONGEST, SHUTTER_LONGEST);
    }
    return t;
}

// Turns the camera of the middle row into that of the point's row, and returns the time of that row.
float take_row(inout CameraData camera, vec3 point) {
    const float t = row_time(camera, to_camera(camera, from_centre(camera, point)));
    camera.centre_rest += t * to_world(camera, camera.shutter_move);
    mat3 columns = transpose(mat3(camera.row0, camera.row1, camera.row2));
    for (int c = 0; c < 3; ++c) columns[c] = turned(columns[c], t * camera.shutter_turn);
    const mat3 rows = transpose(columns);
    camera.row0 = rows[0];
    camera.row1 = rows[1];
    camera.row2 = rows[2];
    return t;
}

// The Jacobian of the pixel with the row's time free: d(pixel) = J dp + d(pixel)/dt dt/d(row) d(row).
void add_shutter(ShutterMotion m, inout vec3 j0, inout vec3 j1) {
    j0 += m.pixel.x * m.per_row * j1;
    j1 += m.pixel.y * m.per_row * j1;
}

struct ShutterGradient {
    mat2x3 d_k;       // of the rows before add_shutter
    vec3 d_velocity;
    float d_time;     // at a held p
};

// dL/dp at a held time, from the gradients of the pixel and of the Jacobian's rows. j: these rows after add_shutter; k:
// before it. d_shear: dL/d(the shear of sigma points' offsets).
vec3 shutter_point_gradient(CameraData camera, ShutterMotion m, vec3 p, mat2x3 k, mat2x3 j, mat2x3 d_j, vec2 d_pixel,
                            vec2 d_shear, out ShutterGradient g) {
    vec2 along = vec2(dot(d_j[0], k[1]), dot(d_j[1], k[1]));
    const vec2 shear = m.per_row * m.pixel;
    if (PROJECTION != PROJECTION_JACOBIAN) along += d_shear;
    const vec2 d_speed = m.per_row * (along + vec2(0.0, dot(shear, along)));
    g.d_velocity = d_speed.x * k[0] + d_speed.y * k[1];
    g.d_k = mat2x3(d_j[0] + d_speed.x * m.velocity,
                 d_j[1] + shear.x * d_j[0] + shear.y * d_j[1] + d_speed.y * m.velocity);
    g.d_time = -dot(g.d_velocity, cross(camera.shutter_turn, m.swing)) -
               dot(d_j[0], cross(camera.shutter_turn, j[0])) - dot(d_j[1], cross(camera.shutter_turn, j[1]));
    return camera_point_gradient(camera, p, g.d_k[0], g.d_k[1], d_pixel) + cross(g.d_velocity, camera.shutter_turn);
}

// J^T v, with J from d exp(w) = [J dw] exp(w).
vec3 left_jacobian_transposed(vec3 v, vec3 w) {
    const float square = dot(w, w), angle = sqrt(square), sine = sin(0.5 * angle);
    const float b = square < 1e-6 ? 0.5 - square / 24.0 : 2.0 * sine * sine / square;
    const float c = square < 1e-2 ? 1.0 / 6.0 - square / 120.0 + square * square / 5040.0
                                  : (angle - sin(angle)) / (square * angle);
    const vec3 across = cross(w, v);
    return v - b * across + c * cross(w, across);
}
