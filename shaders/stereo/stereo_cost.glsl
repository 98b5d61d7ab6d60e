// SPDX-License-Identifier: MIT
// What a plane costs at a pixel: 1 - correlation of the greys in its window with those of the source photos where the
// plane puts them, as the mean over the better half of the sources. Weights fall with the distance in grey from the
// middle, so that a window keeps to one surface (as in COLMAP, Schoenberger et al. 2016). A plane is (v, dv/dx, dv/dy):
// the inverse depth at the pixel's centre and its slope, which is exact for planes in space. Needs args, grey[] and
// source[] of the including shader: a word has the greys of a pixel, of the one right of it, of the one below it, and
// of the one right below, 1 to 255; 0 means outside the photo.

struct StereoWindow {
    float grey[STEREO_SAMPLES], weight[STEREO_SAMPLES];
    float total;  // sum of the weights
    vec2 at;      // px
};

// Takes every other pixel of the square, as on a chessboard.
ivec2 sample_offset(int k) {
    const int side = 2 * STEREO_RADIUS + 1;
    return ivec2((2 * k) % side, (2 * k) / side) - STEREO_RADIUS;
}

float grey_at(ivec2 p) {
    return float(grey[p.y * int(args.width) + p.x] & 255u) / 255.0;
}

StereoWindow stereo_window(ivec2 pixel) {
    StereoWindow window;
    window.at = vec2(pixel) + 0.5;
    window.total = 0.0;
    const float middle = grey_at(pixel);
    const ivec2 last = ivec2(args.width, args.height) - 1;
    for (int k = 0; k < STEREO_SAMPLES; ++k) {
        const ivec2 by = sample_offset(k), p = pixel + by, inside = clamp(p, ivec2(0), last);
        const float g = grey_at(inside), apart = (g - middle) / STEREO_GREY_SPREAD;
        const float w = exp(-0.5 * (apart * apart + dot(vec2(by), vec2(by)) /
                                                        (STEREO_PLACE_SPREAD * STEREO_PLACE_SPREAD)));
        window.grey[k] = g;
        window.weight[k] = p == inside && g > 0.0 ? w : 0.0;
        window.total += window.weight[k];
    }
    return window;
}

bool shows_something(StereoWindow window) {
    float sum = 0.0, squares = 0.0;
    for (int k = 0; k < STEREO_SAMPLES; ++k) {
        sum += window.weight[k] * window.grey[k];
        squares += window.weight[k] * window.grey[k] * window.grey[k];
    }
    sum /= window.total;
    return squares / window.total - sum * sum >= STEREO_LEAST_VARIANCE;
}

float source_cost(StereoSource from, vec3 plane, StereoWindow window) {
    const vec3 origin = from.toward * vec3(window.at, 1.0) + plane.x * from.shift;
    const vec3 by_x = from.toward[0] + plane.y * from.shift;
    const vec3 by_y = from.toward[1] + plane.z * from.shift;
    const vec2 last = vec2(from.width, from.height) - 1.0;
    float total = 0.0, sum = 0.0, squares = 0.0, own = 0.0, own_squares = 0.0, product = 0.0;
    for (int k = 0; k < STEREO_SAMPLES; ++k) {
        const vec2 by = vec2(sample_offset(k));
        const vec3 q = origin + by.x * by_x + by.y * by_y;
        const vec2 p = q.xy / q.z - 0.5;
        const bool inside = q.z > 0.0 && p.x >= 0.0 && p.y >= 0.0 && p.x < last.x && p.y < last.y;
        const vec2 low = inside ? floor(p) : vec2(0.0), f = p - low;
        const vec4 four = unpackUnorm4x8(grey[from.first + uint(low.y) * from.width + uint(low.x)]);
        const bool counts = inside && min(min(four.x, four.y), min(four.z, four.w)) > 0.0;
        const vec2 rows = mix(four.xz, four.yw, f.x);
        const float g = counts ? mix(rows.x, rows.y, f.y) : 0.0, w = counts ? window.weight[k] : 0.0;
        const float r = window.grey[k];
        total += w;
        sum += w * g;
        squares += w * g * g;
        own += w * r;
        own_squares += w * r * r;
        product += w * g * r;
    }
    if (!(total > 0.5 * window.total)) return STEREO_NO_COST;
    sum /= total;
    own /= total;
    const float variance = squares / total - sum * sum, own_variance = own_squares / total - own * own;
    if (variance < STEREO_LEAST_VARIANCE || own_variance < STEREO_LEAST_VARIANCE) return STEREO_NO_COST;
    return clamp(1.0 - (product / total - sum * own) * inversesqrt(variance * own_variance), 0.0, STEREO_NO_COST);
}

float stereo_cost(vec3 plane, StereoWindow window) {
    if (!(plane.x >= args.farthest && plane.x <= args.nearest &&
          dot(plane.yz, plane.yz) <= args.steepest * args.steepest * plane.x * plane.x))
        return STEREO_NO_COST;
    float best[STEREO_SOURCES];
    for (uint s = 0u; s < args.sources; ++s) {
        float cost = source_cost(source[s], plane, window);
        for (uint k = 0u; k < s; ++k) {
            const float other = best[k];
            best[k] = min(other, cost);
            cost = max(other, cost);
        }
        best[s] = cost;
    }
    const uint better = (args.sources + 1u) / 2u;
    float sum = 0.0;
    for (uint k = 0u; k < better; ++k) sum += best[k];
    return sum / float(better);
}
