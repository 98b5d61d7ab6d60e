// SPDX-License-Identifier: MIT
// The gradient of exposure_grid.comp with respect to a photo's grid of maps, including that of its smoothness.
// Place: between loss and exposure_grid_backward.
// Work: one group per vertex of the picture's plane, for all luminances. It walks over the pixels around the vertex and
// owns its sums, so that they are the same in every run. Shared memory: 48 floats per thread, added up by one thread
// per term. Reads the picture before the map, transmittance, maps and d_image; writes the gradient [vertices][12].
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/effect_args.h"

layout(local_size_x = EXPOSURE_GRID_THREADS) in;

layout(push_constant, scalar) uniform Push { ExposureArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Maps { vec4 maps[]; };
layout(set = 0, binding = 1, scalar) readonly buffer ImageIn { float image[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Gradient { float d_image[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer GridGradient { float d_maps[]; };
layout(set = 0, binding = 4, scalar) readonly buffer FinalT { float final_transmittance[]; };

#include "effects/covered.glsl"
#include "effects/exposure_grid.glsl"

shared vec4 sums[EXPOSURE_GRID_THREADS][3 * EXPOSURE_GRID_L];  // rows of the maps

// The weighted gradient of half the squared differences from the neighbours.
float roughness(uvec3 at, uint term) {
    const uvec3 last = uvec3(EXPOSURE_GRID_X - 1, EXPOSURE_GRID_Y - 1, EXPOSURE_GRID_L - 1);
    const uint row = term / 4u, column = term % 4u;
    const float own = maps[grid_rows(args.view, at) + row][column];
    float sum = 0.0;
    for (uint axis = 0u; axis < 3u; ++axis) {
        uvec3 next = uvec3(0u);
        next[axis] = 1u;
        if (at[axis] > 0u) sum += own - maps[grid_rows(args.view, at - next) + row][column];
        if (at[axis] < last[axis]) sum += own - maps[grid_rows(args.view, at + next) + row][column];
    }
    return EXPOSURE_GRID_SMOOTHNESS * sum;
}

void main() {
    const uint lane = gl_LocalInvocationID.x, height = args.pixels / args.width;
    const uvec2 at = uvec2(gl_WorkGroupID.x % EXPOSURE_GRID_X, gl_WorkGroupID.x / EXPOSURE_GRID_X);
    const vec2 cell = vec2(args.width, height) / vec2(EXPOSURE_GRID_X - 1, EXPOSURE_GRID_Y - 1);
    const uvec2 begin = uvec2(max(vec2(0.0), floor((vec2(at) - 1.0) * cell) - 1.0));
    const uvec2 end = min(uvec2(args.width, height), uvec2(ceil((vec2(at) + 1.0) * cell) + 1.0));
    const uint across = end.x - begin.x, count = across * (end.y - begin.y);
    vec4 red[EXPOSURE_GRID_L], green[EXPOSURE_GRID_L], blue[EXPOSURE_GRID_L];  // rows of the maps
    for (uint l = 0u; l < EXPOSURE_GRID_L; ++l) red[l] = green[l] = blue[l] = vec4(0.0);
    for (uint i = lane; i < count; i += EXPOSURE_GRID_THREADS) {
        const uint p = (begin.y + i / across) * args.width + begin.x + i % across;
        const vec4 colour = covered_colour(p);
        const vec3 place = grid_place(p, colour.rgb);
        const vec2 near = max(vec2(0.0), 1.0 - abs(place.xy - vec2(at)));
        const vec3 d =
            near.x * near.y * vec3(d_image[p], d_image[args.pixels + p], d_image[2u * args.pixels + p]);
        for (uint l = 0u; l < EXPOSURE_GRID_L; ++l) {
            const vec4 part = max(0.0, 1.0 - abs(place.z - float(l))) * colour;
            red[l] += d.r * part;
            green[l] += d.g * part;
            blue[l] += d.b * part;
        }
    }
    for (uint l = 0u; l < EXPOSURE_GRID_L; ++l) {
        sums[lane][3u * l] = red[l];
        sums[lane][3u * l + 1u] = green[l];
        sums[lane][3u * l + 2u] = blue[l];
    }
    barrier();
    for (uint k = lane; k < EXPOSURE_GRID_L * EXPOSURE_TERMS; k += EXPOSURE_GRID_THREADS) {
        const uint l = k / EXPOSURE_TERMS, term = k % EXPOSURE_TERMS;
        float total = roughness(uvec3(at, l), term);
        for (uint i = 0u; i < EXPOSURE_GRID_THREADS; ++i) total += sums[i][k / 4u][k % 4u];
        d_maps[grid_rows(0u, uvec3(at, l)) * 4u + term] = total;
    }
}
