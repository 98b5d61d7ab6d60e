// SPDX-License-Identifier: MIT
// Turns a blended frame into 8-bit pixels for a window: the picture, or a heat map of error, depth or work. A frame
// that had no room for its intersections shows the previous picture, scaled to its size, because the host learns of it
// and repeats it only some frames later.
// Place: after blend, only in the viewer.
// Work: one thread per pixel. Shared memory: none. Reads the frame with its status, the photo, the previous picture
// and, for VIEW_COUNT, where each pixel ended in its tile's list; writes B8G8R8A8.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/render_args.h"
#include "shared/view_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;
layout(constant_id = 1) const int MODE = VIEW_COLOUR;
layout(constant_id = 2) const int HAS_PHOTO = 0;

layout(push_constant, scalar) uniform Push { DisplayArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer ImageIn { float image[]; };       // [3][H][W]
layout(set = 0, binding = 1, scalar) readonly buffer Photo { uint photo[]; };          // R in the low byte
layout(set = 0, binding = 2, scalar) readonly buffer TileRange { uvec2 tile_range[]; };
layout(set = 0, binding = 3, scalar) readonly buffer LastIntersection { uint last_intersection[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Status { FrameStatus status; };
layout(set = 0, binding = 5, scalar) readonly buffer Before { uint before[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Pixels { uint pixels[]; };

#include "lib/finite.glsl"
#include "lib/linear_id.glsl"
#include "view/heat.glsl"
#include "view/photo.glsl"

uint before_at(vec2 centre, vec3 background) {
    if (args.before_width == 0u) return packUnorm4x8(vec4(background.bgr, 1.0));
    const vec2 size = vec2(args.before_width, args.before_height);
    const uvec2 at = uvec2(min(centre / vec2(args.width, args.height) * size, size - 1.0));
    return before[at.y * args.before_width + at.x];
}

void main() {
    const uint i = linear_id();
    const uint plane = args.width * args.height;
    if (i >= plane) return;
    const uvec2 at = uvec2(i % args.width, i / args.width);
    const vec2 centre = vec2(at) + 0.5;
    const vec3 background = vec3(args.background_r, args.background_g, args.background_b);
    if (status.overflow != 0u) {
        pixels[i] = before_at(centre, background);
        return;
    }
    vec3 colour = vec3(image[i], image[plane + i], image[2u * plane + i]);
    vec3 truth = background;
    if (MODE == VIEW_ERROR) {
        const bool known = HAS_PHOTO == 1 && photo_at(centre, background, truth);
        const vec3 difference = abs(clamp(colour, 0.0, 1.0) - truth);
        colour = known ? heat(dot(difference, vec3(1.0 / 3.0)) / args.heat_max) : vec3(0.15);
    } else if (MODE == VIEW_DEPTH) {
        colour = colour.g > 0.05 ? heat(1.0 - colour.r / colour.g) : background;
    } else if (MODE == VIEW_COUNT) {
        const uvec2 tile = at / TILE_SIZE;
        const uint begin = tile_range[tile.y * args.tiles_x + tile.x].x;
        const uint last = last_intersection[i];
        colour = heat(last > begin ? float(last - begin) / args.heat_max : 0.0);
    }
    colour = any_nan(colour) ? vec3(1.0, 0.0, 1.0) : colour;
    pixels[i] = packUnorm4x8(vec4(colour.bgr, 1.0));
}
