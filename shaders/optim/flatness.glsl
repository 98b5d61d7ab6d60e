// SPDX-License-Identifier: MIT
// The axis that the regulariser of flatness shortens.

// The first of those with the smallest scale.
uint smallest_axis(vec3 log_scale) {
    uint least = 0u;
    for (uint c = 1u; c < 3u; ++c)
        if (log_scale[c] < log_scale[least]) least = c;
    return least;
}
