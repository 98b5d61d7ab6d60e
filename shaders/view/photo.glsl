// SPDX-License-Identifier: MIT
// The photo in a frame. The including shader has the DisplayArgs `args` and the buffer `photo`.

// The photo at the frame's pixel, over the background; false outside the photo.
bool photo_at(vec2 pixel, vec3 background, out vec3 colour) {
    const vec2 at = (pixel - vec2(args.photo_x, args.photo_y)) / args.photo_scale;
    colour = background;
    if (at.x < 0.0 || at.y < 0.0 || at.x >= float(args.photo_width) || at.y >= float(args.photo_height))
        return false;
    const vec4 texel = unpackUnorm4x8(photo[uint(at.y) * args.photo_width + uint(at.x)]);
    colour = mix(background, texel.rgb, texel.a);
    return true;
}
