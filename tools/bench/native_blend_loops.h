// SPDX-License-Identifier: MIT
// The loops of native_blend.cpp for one tile. Included once for each instruction set, in its own
// namespace and for its own target, because a compiler splits vectors that a set does not have for
// good where it first meets them. DARB_LANES: floats in a vector, 8 or 16. Vectors are passed by
// reference, as by value their calling convention would depend on the set. There is no include
// guard, for that reason.

inline constexpr int W = DARB_LANES;
typedef float F __attribute__((vector_size(4 * DARB_LANES)));
typedef std::int32_t I __attribute__((vector_size(4 * DARB_LANES)));
typedef float F8 __attribute__((vector_size(32)));
// Column and row of a lane's pixel in rows of 8.
#if DARB_LANES == 8
inline constexpr F kX = {0, 1, 2, 3, 4, 5, 6, 7}, kY = {};
#else
inline constexpr F kX = {0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7};
inline constexpr F kY = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1};
#endif
inline constexpr int V = kBlockPixels / W;  // vectors per block

inline std::size_t collect(const BlendFrame& f, std::uint32_t begin, std::uint32_t end,
                           std::uint32_t block, Hits& hits) {
    if (hits.splat.size() < end - begin) {
        hits.splat.resize(end - begin);
        hits.number.resize(end - begin);
    }
    std::size_t count = 0;
    for (std::uint32_t j = begin; j < end; ++j) {
        const std::uint32_t intersection = f.splat_from_intersection[f.intersection_from_sorted[j]];
        hits.splat[count] = intersection & INTERSECTION_SPLAT_MASK;
        hits.number[count] = j + 1;
        count += (intersection >> (INTERSECTION_BLOCK_SHIFT + block)) & 1u;
    }
    return count;
}

/// w = exp(-q/2), as shaders/kernels/gaussian.glsl.
inline void gaussian(const BlendFrame& f, const F& q, F& w) {
    constexpr float kRound = 12582912.0f;  // 1.5 * 2^23: adding it rounds to an integer
    F y = q * -0.72134752f;
    y = y > -126.0f ? y : F{} - 126.0f;
    const F shifted = y + kRound;
    const F t = y - (shifted - kRound);
    F p = t * f.polynomial[5] + f.polynomial[4];
    p = p * t + f.polynomial[3];
    p = p * t + f.polynomial[2];
    p = p * t + f.polynomial[1];
    p = p * t + f.polynomial[0];
    const I bits = (I)p + ((I)shifted << 23);
    w = (F)bits;
}

struct Offset {  // mean - pixel centre, and the whitened offset
    F dy, x, y;
};

/// dx0, dy0: mean minus the centre of the block's first pixel.
inline void offset_of(int v, float dx0, float dy0, const glm::vec4& shape, float l22, Offset& o) {
    const F dx = dx0 - kX;
    const int row = v * W / kBlockSide;
    o.dy = (dy0 - static_cast<float>(row)) - kY;
    o.x = shape.z * dx + shape.w * o.dy;
    o.y = l22 * o.dy;
}

/// The running values of a block's pixels, [V] each.
struct BlockLight {
    const F *red, *green, *blue, *transmittance;  // negative where a pixel has ended
    const I* last;
};

inline void write_block(const BlendFrame& f, const Block& at, const BlockLight& light,
                        BlendedImage& out) {
    const std::size_t plane = std::size_t{f.width} * f.height;
    for (int p = 0; p < kBlockPixels; ++p) {
        const std::uint32_t x = at.x + p % kBlockSide, y = at.y + p / kBlockSide;
        if (x >= f.width || y >= f.height) continue;
        const std::size_t o = std::size_t{y} * f.width + x;
        const float t = std::abs(light.transmittance[p / W][p % W]);
        out.image[o] = light.red[p / W][p % W] + t * f.background.r;
        out.image[plane + o] = light.green[p / W][p % W] + t * f.background.g;
        out.image[2 * plane + o] = light.blue[p / W][p % W] + t * f.background.b;
        out.final_transmittance[o] = t;
        out.last_intersection[o] = static_cast<std::uint32_t>(light.last[p / W][p % W]);
    }
}

template <bool kCount>
inline void forward_block(const BlendFrame& f, std::uint32_t tile, std::uint32_t block, Hits& hits,
                          BlendedImage& out, BlendCounts& counts) {
    const Block at = block_at(f, tile, block);
    if (at.x >= f.width || at.y >= f.height) return;
    F transmittance[V], red[V] = {}, green[V] = {}, blue[V] = {};
    I last[V] = {}, counted = {};
    for (int p = 0; p < kBlockPixels; ++p) {
        const bool inside = at.x + p % kBlockSide < f.width && at.y + p / kBlockSide < f.height;
        transmittance[p / W][p % W] = inside ? 1.0f : -1.0f;
    }
    const glm::uvec2 range = f.tile_range[tile];
    constexpr std::uint32_t kChunk = 128;
    bool alive = true;
    for (std::uint32_t chunk = range.x; alive && chunk < range.y; chunk += kChunk) {
        const std::size_t count = collect(f, chunk, std::min(chunk + kChunk, range.y), block, hits);
        for (std::size_t i = 0; i < count;) {
            const std::size_t end = std::min(i + kBatch, count);
            if (kCount) counts.evaluated += (end - i) * kBlockPixels;
            for (; i < end; ++i) {
                const std::uint32_t splat = hits.splat[i];
                const glm::vec4 shape = f.shape[splat], light = f.light[splat];
                const float l22 = f.bound[splat].x;
                const float dx0 = shape.x - (static_cast<float>(at.x) + 0.5f);
                const float dy0 = shape.y - (static_cast<float>(at.y) + 0.5f);
                const I number = I{} + static_cast<std::int32_t>(hits.number[i]);
                for (int v = 0; v < V; ++v) {
                    Offset o;
                    offset_of(v, dx0, dy0, shape, l22, o);
                    F w;
                    gaussian(f, o.x * o.x + o.y * o.y, w);
                    F alpha = light.w * w;
                    alpha = alpha < kAlphaMax ? alpha : F{} + kAlphaMax;
                    alpha = alpha >= f.alpha_cutoff ? alpha : F{};
                    F wanted = alpha * transmittance[v];
                    const F next = transmittance[v] - wanted;
                    const I goes_on = next >= f.least_transmittance;
                    if (kCount) counted -= goes_on & (alpha > 0.0f);
                    wanted = goes_on ? wanted : F{};
                    red[v] += wanted * light.x;
                    green[v] += wanted * light.y;
                    blue[v] += wanted * light.z;
                    const F ended = (F)((I)transmittance[v] | INT32_MIN);  // -|T|
                    transmittance[v] = goes_on ? next : ended;
                    last[v] = goes_on ? number : last[v];
                }
            }
            F most = transmittance[0];
            for (int v = 1; v < V; ++v) most = most > transmittance[v] ? most : transmittance[v];
            alive = false;
            for (int l = 0; l < W; ++l) alive |= most[l] > 0;
            if (!alive) break;
        }
    }
    if (kCount) {
        for (int l = 0; l < W; ++l) counts.contributing += static_cast<std::uint32_t>(counted[l]);
        return;
    }
    write_block(f, at, {red, green, blue, transmittance, last}, out);
}

/// sums[i] += the sum of the lanes of v[i], i < 8.
inline void add_lane_sums(const F8* v, float* sums) {
    F8 a[4], b[2];
    for (int i = 0; i < 4; ++i)
        a[i] = __builtin_shufflevector(v[2 * i], v[2 * i + 1], 0, 8, 2, 10, 4, 12, 6, 14) +
               __builtin_shufflevector(v[2 * i], v[2 * i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
    for (int i = 0; i < 2; ++i)
        b[i] = __builtin_shufflevector(a[2 * i], a[2 * i + 1], 0, 1, 8, 9, 4, 5, 12, 13) +
               __builtin_shufflevector(a[2 * i], a[2 * i + 1], 2, 3, 10, 11, 6, 7, 14, 15);
    const F8 c = __builtin_shufflevector(b[0], b[1], 0, 1, 2, 3, 8, 9, 10, 11) +
                 __builtin_shufflevector(b[0], b[1], 4, 5, 6, 7, 12, 13, 14, 15);
    for (int i = 0; i < 8; ++i) sums[i] += c[i];
}
#if DARB_LANES == 16
inline void half_of(const F& v, F8& sum) {
    sum = __builtin_shufflevector(v, v, 0, 1, 2, 3, 4, 5, 6, 7) +
          __builtin_shufflevector(v, v, 8, 9, 10, 11, 12, 13, 14, 15);
}
#else
inline void half_of(const F8& v, F8& sum) {
    sum = v;
}
#endif

struct BackwardPixels {
    F transmittance[V], behind[V], red[V], green[V], blue[V];
    I last[V];
};

inline std::uint32_t load_pixels(const BlendFrame& f, const BlendedImage& image,
                                 const std::vector<float>& d_image, const Block& at,
                                 BackwardPixels& px) {
    const std::size_t plane = std::size_t{f.width} * f.height;
    std::uint32_t last = 0;
    for (int p = 0; p < kBlockPixels; ++p) {
        const std::uint32_t x = at.x + p % kBlockSide, y = at.y + p / kBlockSide;
        const bool inside = x < f.width && y < f.height;
        const std::size_t o = inside ? std::size_t{y} * f.width + x : 0;
        const glm::vec3 d = inside
                                ? glm::vec3(d_image[o], d_image[plane + o], d_image[2 * plane + o])
                                : glm::vec3(0.0f);
        const std::uint32_t ended = inside ? image.last_intersection[o] : 0;
        px.red[p / W][p % W] = d.r;
        px.green[p / W][p % W] = d.g;
        px.blue[p / W][p % W] = d.b;
        px.behind[p / W][p % W] = glm::dot(d, f.background);
        px.transmittance[p / W][p % W] = inside ? image.final_transmittance[o] : 1.0f;
        px.last[p / W][p % W] = static_cast<std::int32_t>(ended);
        last = std::max(last, ended);
    }
    return last;
}

/// Adds one splat: nine sums over the block's pixels, the ninth kept apart.
inline void backward_splat(const BlendFrame& f, std::uint32_t splat, std::uint32_t number,
                           const Block& at, BackwardPixels& px, float* first, float* rest) {
    const glm::vec4 shape = f.shape[splat], light = f.light[splat];
    const float l22 = f.bound[splat].x;
    const float dx0 = shape.x - (static_cast<float>(at.x) + 0.5f);
    const float dy0 = shape.y - (static_cast<float>(at.y) + 0.5f);
    F gx = {}, gxx = {}, gxdy = {}, gdy = {}, gdydy = {}, opacity = {};
    F red = {}, green = {}, blue = {};
    for (int v = 0; v < V; ++v) {
        Offset o;
        offset_of(v, dx0, dy0, shape, l22, o);
        F w;
        gaussian(f, o.x * o.x + o.y * o.y, w);
        const F raw = light.w * w;
        const I counts =
            (raw >= f.alpha_cutoff) & (px.last[v] >= static_cast<std::int32_t>(number));
        const I clamped = raw >= kAlphaMax;
        F alpha = clamped ? F{} + kAlphaMax : raw;
        alpha = counts ? alpha : F{};
        const F before = px.transmittance[v] / (1.0f - alpha);
        const F ahead =
            light.x * px.red[v] + light.y * px.green[v] + light.z * px.blue[v] - px.behind[v];
        const F d_alpha = (counts & ~clamped) ? before * ahead : F{};
        const F g = d_alpha * (w * -0.5f), g_x = g * o.x, g_dy = g * o.dy, weight = alpha * before;
        gx += g_x;
        gxx += g_x * o.x;
        gxdy += g_x * o.dy;
        gdy += g_dy;
        gdydy += g_dy * o.dy;
        opacity += d_alpha * w;
        red += weight * px.red[v];
        green += weight * px.green[v];
        blue += weight * px.blue[v];
        px.behind[v] += alpha * ahead;
        px.transmittance[v] = before;
    }
    F8 sums[8], ninth;
    half_of(gx * light.w, sums[0]);
    half_of(gxx * light.w, sums[1]);
    half_of(gxdy * light.w, sums[2]);
    half_of(gdy * light.w, sums[3]);
    half_of(opacity, sums[4]);
    half_of(red, sums[5]);
    half_of(green, sums[6]);
    half_of(blue, sums[7]);
    half_of(gdydy * light.w, ninth);
    add_lane_sums(sums, first);
    float total = 0;
    for (int l = 0; l < 8; ++l) total += ninth[l];
    *rest += total;
}

inline void backward_block(const BlendFrame& f, const BlendedImage& image,
                           const std::vector<float>& d_image, std::uint32_t tile,
                           std::uint32_t block, Hits& hits, BlendPartials& out) {
    const Block at = block_at(f, tile, block);
    if (at.x >= f.width || at.y >= f.height) return;
    BackwardPixels px;
    const std::uint32_t last = load_pixels(f, image, d_image, at, px);
    const glm::uvec2 range = f.tile_range[tile];
    const std::uint32_t end = std::min(last, range.y);
    if (end <= range.x) return;
    for (std::size_t i = collect(f, range.x, end, block, hits); i-- > 0;) {
        const std::uint32_t slot = f.intersection_from_sorted[hits.number[i] - 1];
        backward_splat(f, hits.splat[i], hits.number[i], at, px,
                       out.first.data() + std::size_t{slot} * 8, &out.rest[slot]);
    }
}

inline void forward_tile(const Work& work, std::uint32_t tile, Hits& hits) {
    BlendCounts none;
    for (std::uint32_t block = 0; block < kBlocks; ++block)
        forward_block<false>(work.frame, tile, block, hits, *work.image, none);
}

/// The slots of a tile's intersections belong to it alone, and are set to zero first.
inline void backward_tile(const Work& work, std::uint32_t tile, Hits& hits) {
    const BlendFrame& f = work.frame;
    BlendPartials& out = *work.partials;
    for (std::uint32_t j = f.tile_range[tile].x; j < f.tile_range[tile].y; ++j) {
        const std::size_t slot = f.intersection_from_sorted[j];
        std::fill_n(out.first.begin() + static_cast<std::ptrdiff_t>(slot * 8), 8, 0.0f);
        out.rest[slot] = 0;
    }
    for (std::uint32_t block = 0; block < kBlocks; ++block)
        backward_block(f, *work.image, *work.d_image, tile, block, hits, out);
}
