// SPDX-License-Identifier: MIT
// What the passes of the loss compare at a pixel. The includer declares args, image, photo, USE_ALPHA and USE_MASK.

bool in_image(int x, int y) {
    return x >= 0 && x < int(args.width) && y >= 0 && y < int(args.height);
}

// Whether the photo's pixel `at` is not masked.
bool is_compared(uint at) {
    return USE_ALPHA == 0 || USE_MASK == 0 || photo[at] >= 0x80000000u;
}

// (a, b) = (x + y, x - y) of one channel's pixel, x rendered, y photo; 0 outside the image and under the mask.
vec2 sum_and_difference(int channel, int column, int row) {
    const bool inside = in_image(column, row);
    const uint at = inside ? uint(row) * args.width + uint(column) : 0u;
    const float x = image[uint(channel) * args.width * args.height + at];
    const uint rgba = photo[at];
    float y = float(bitfieldExtract(rgba, channel * 8, 8)) * (1.0 / 255.0);
    bool counts = inside;
    if (USE_ALPHA == 1 && USE_MASK == 0) {
        const vec3 background = vec3(args.background_r, args.background_g, args.background_b);
        y = mix(background[channel], y, float(rgba >> 24) * (1.0 / 255.0));
    } else if (USE_ALPHA == 1) {
        counts = inside && rgba >= 0x80000000u;
    }
    return counts ? vec2(x + y, x - y) : vec2(0.0);
}

// What a compared pixel adds to the sums: |x - y|, -, squared error of the clamped x, 1.
vec4 pixel_sums(vec2 ab) {
    const float x = 0.5 * (ab.x + ab.y);
    const float error = ab.y + clamp(x, 0.0, 1.0) - x;
    return vec4(abs(ab.y), 0.0, error * error, 1.0);
}
