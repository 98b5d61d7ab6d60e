// SPDX-License-Identifier: MIT
// Projected splats set by hand, blended by blend.comp and back by blend_backward.comp, or by the
// passes over buckets, alone, with the same lists for the reference.
#pragma once

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/core/rng.h"
#include "engine/gpu/commands.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/raster/forward.h"
#include "engine/raster/kernel_constants.h"
#include "engine/reference/blend.h"
#include "tests/support/guarded_buffer.h"
#include "tests/support/shared_device.h"

namespace darb::test {

struct BlendScene {
    int width = 16, height = 16;  // px
    int kernel = KERNEL_GAUSSIAN;
    Footprint footprint = Footprint::psi;
    int evaluation = EVALUATION_POLYNOMIAL;
    float cutoff = static_cast<float>(ALPHA_CUTOFF_DEFAULT);
    float stop = static_cast<float>(TRANSMITTANCE_STOP);
    glm::vec3 background{0.0f};
    std::uint32_t segment = 0;  // intersections of a list a dispatch; 0: all
    std::uint32_t threads = 0;  // in a workgroup of blend.comp; 0: one subgroup per block
    bool records = false;       // blend_records.comp in its place
    BackwardBlend back = BackwardBlend::subgroup;
    // As ForwardOptions: d_image has five planes, and seven with depth_spread.
    bool depth_sum = false, depth_spread = false;
    std::vector<reference::ProjectedSplat<double>> splats;  // nearest first

    bool buckets() const { return back == BackwardBlend::buckets; }

    /// Mean in px, S' = [[xx, xy], [xy, yy]] in px^2. Everything is rounded to float, so that both
    /// sides start from the same numbers.
    void add(glm::dvec2 mean, glm::dvec3 cov, double opacity, glm::dvec3 colour,
             double exponent = 4) {
        const auto rounded = [](double value) { return double(static_cast<float>(value)); };
        reference::ProjectedSplat<double> s;
        const double det = cov.x * cov.z - cov.y * cov.y;
        s.mean_px = {rounded(mean.x), rounded(mean.y)};
        s.depth = 1 + static_cast<double>(splats.size());
        s.cov_xx = cov.x;
        s.cov_xy = cov.y;
        s.cov_yy = cov.z;
        s.l11 = rounded(std::sqrt(cov.z / det));
        s.l21 = rounded(-cov.y / std::sqrt(cov.z * det));
        s.l22 = rounded(1 / std::sqrt(cov.z));
        s.opacity = rounded(opacity);
        s.exponent = rounded(exponent);
        s.reach = table().reach(s.opacity, double(cutoff), s.exponent);
        for (int c = 0; c < 3; ++c) s.colour[c] = rounded(colour[c]);
        splats.push_back(s);
    }
    void add_random(size_t count, std::uint64_t seed, double min_opacity, double max_opacity) {
        Pcg32 rng(seed);
        for (size_t i = 0; i < count; ++i) {
            const double a = rng.uniform(0.5, 8), c = rng.uniform(0.5, 8);
            const double size = rng.uniform(0.3, 6);
            const glm::dvec3 cov(a * size, rng.uniform(-0.9, 0.9) * std::sqrt(a * c) * size,
                                 c * size);
            const glm::dvec2 mean(rng.uniform(-4, width + 4), rng.uniform(-4, height + 4));
            const double opacity = rng.uniform(min_opacity, max_opacity);
            const glm::dvec3 colour(rng.uniform(), rng.uniform(), rng.uniform());
            // From a kink at the edge to a spike.
            double exponent = 4;
            if (kernel_has_shape(kernel)) {
                const ShapedKernel& shaped = shaped_kernel(kernel);
                const double shape = rng.uniform(shaped.first_shape(), shaped.last_shape());
                exponent = shaped.exponent(footprint, shape);
            }
            add(mean, cov, opacity, colour, exponent);
        }
    }
    const reference::KernelTable& table() const {
        return reference::kernel_table(kernel, footprint);
    }
    reference::RenderSettings settings() const {
        reference::RenderSettings s;
        s.alpha_cutoff = cutoff;
        s.transmittance_stop = stop;
        for (int c = 0; c < 3; ++c) s.background[c] = background[c];
        return s;
    }
    reference::TileLists lists() const {
        auto copy = splats;
        return reference::make_tile_lists(width, height, copy);
    }
};

struct BlendVariant {
    int kernel = KERNEL_GAUSSIAN;
    Footprint footprint = Footprint::psi;
    int evaluation = EVALUATION_POLYNOMIAL;
    bool records = false;  // forward
    BackwardBlend back = BackwardBlend::subgroup;

    std::string name() const {
        std::string text =
            std::string(kernel_name(kernel)) + "_" + std::string(footprint_name(footprint));
        if (evaluation == EVALUATION_BUILTIN) text += "_builtin";
        if (records) text += "_records";
        if (back != BackwardBlend::subgroup)
            text += std::string("_") + kBackwardBlends[static_cast<size_t>(back)];
        return text;
    }
    /// Exact footprints of the kernels with a jump fall like a root at their edge: the slope there
    /// grows without bound, and a rounding of q is a percent of it.
    bool steep_edge() const {
        return footprint == Footprint::exact &&
               (kernel == KERNEL_INVERSE_QUADRATIC || kernel == KERNEL_INVERSE_MULTIQUADRIC);
    }
    /// Empty, on a background of three different values.
    BlendScene scene(int width = 16, int height = 16) const {
        BlendScene s;
        s.width = width;
        s.height = height;
        s.kernel = kernel;
        s.footprint = footprint;
        s.evaluation = evaluation;
        s.records = records;
        s.back = back;
        s.background = {0.1f, 0.5f, 0.9f};
        return s;
    }
};
inline void PrintTo(const BlendVariant& v, std::ostream* out) {
    *out << v.name();
}

/// Every one that the shaders tell apart: those of shaders/kernels/builtin.glsl by functions of the
/// driver as well, and of kernels with shapes one footprint, as the other is another exponent
/// alone.
inline std::vector<BlendVariant> every_blend_variant() {
    std::vector<BlendVariant> all;
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel)
        for (const Footprint footprint : {Footprint::psi, Footprint::exact})
            all.push_back({kernel, footprint, EVALUATION_POLYNOMIAL});
    for (const int kernel : {KERNEL_GAUSSIAN, KERNEL_RAISED_COSINE, KERNEL_HALF_COSINE_SQUARED,
                             KERNEL_SINC, KERNEL_COSINE, KERNEL_SQUARED_RAISED_COSINE, KERNEL_BETA,
                             KERNEL_GENERALIZED_EXPONENTIAL, KERNEL_GES_PUBLISHED})
        all.push_back({kernel, Footprint::psi, EVALUATION_BUILTIN});
    for (const int kernel : shaped_kernels())
        all.push_back({kernel, Footprint::psi, EVALUATION_POLYNOMIAL});
    return all;
}

/// In every form of the forward blend.
inline std::vector<BlendVariant> every_forward_variant() {
    std::vector<BlendVariant> all = every_blend_variant();
    for (BlendVariant v : every_blend_variant()) {
        v.records = true;
        all.push_back(v);
    }
    return all;
}

/// By one subgroup and by pixels, whose code for kernels is not the other's.
inline std::vector<BlendVariant> every_backward_variant() {
    std::vector<BlendVariant> all = every_blend_variant();
    for (const BackwardBlend back : {BackwardBlend::pixels, BackwardBlend::pixels4})
        for (BlendVariant v : every_blend_variant()) {
            const bool gaussian = v.kernel == KERNEL_GAUSSIAN || v.kernel == KERNEL_GES_PUBLISHED;
            if (back == BackwardBlend::pixels4 && !gaussian) continue;  // of 4 in any case
            v.back = back;
            all.push_back(v);
        }
    return all;
}

/// Sums over the pixels of a tile that an intersection's gradients follow from; G = opacity
/// dL/dalpha dw/dq, d = mean - pixel centre, x = l11 dx + l21 dy.
struct IntersectionSums {
    float gx, gxx, gx_dy, g_dy, d_opacity;
    glm::vec3 d_colour;
    float g_dy_dy, d_exponent;
    float d_depth = 0;  // with depth_sum
};

/// What the passes leave. Intersections are in the order of the lists.
struct BlendOutput {
    std::vector<float> image;                     // [3][H][W]
    std::vector<float> transmittance;             // [H][W], with store
    std::vector<std::uint32_t> last;              // [H][W], with store
    std::vector<IntersectionSums> intersections;  // [K], with d_image
};

/// Intersections as emit.comp writes them, but in slots of any order that only
/// intersection_from_sorted knows.
struct ShuffledIntersections {
    std::vector<std::uint32_t> order, splat_from_intersection;
    std::vector<glm::uvec2> ranges;

    /// all_blocks: every intersection claims to touch every block of its tile.
    ShuffledIntersections(const BlendScene& scene, const reference::TileLists& lists,
                          bool all_blocks)
        : order(lists.intersection_count()), splat_from_intersection(lists.intersection_count()) {
        std::iota(order.begin(), order.end(), 0U);
        Pcg32 rng(17);
        for (size_t i = order.size(); i > 1; --i)
            std::swap(order[i - 1], order[rng.below(static_cast<std::uint32_t>(i))]);
        for (size_t t = 0; t < lists.tile_count(); ++t) {
            const std::uint32_t begin = lists.begin[t], end = lists.begin[t + 1];
            ranges.push_back(begin == end ? glm::uvec2(0) : glm::uvec2(begin, end));
            const int x = static_cast<int>(t) % lists.tiles_x * TILE_SIZE;
            const int y = static_cast<int>(t) / lists.tiles_x * TILE_SIZE;
            for (std::uint32_t j = begin; j < end; ++j) {
                const std::uint32_t splat = lists.splats[j];
                const std::uint32_t bits = all_blocks ? 15 : blocks(scene.splats[splat], x, y);
                splat_from_intersection[order[j]] = splat | bits << INTERSECTION_BLOCK_SHIFT;
            }
        }
    }

    static std::uint32_t blocks(const reference::ProjectedSplat<double>& s, int x, int y) {
        std::uint32_t bits = 0;
        for (int b = 0; b < 4; ++b) {
            const int left = x + b % 2 * 8, top = y + b / 2 * 8;
            const double q = reference::smallest_q(s, left, top, left + 8, top + 8);
            if (q <= s.reach * (1 + 1e-5)) bits |= 1U << b;
        }
        return bits;
    }
};

struct BlendPipelines {
    Pipeline blend, backward, bucket_tiles, bucket_behind;
    std::uint32_t bucket = 0;  // intersections

    BlendPipelines(Device& device, const BlendScene& scene, bool store) {
        SpecConstants constants =
            kernel_constants(scene.kernel, scene.footprint, scene.evaluation, 5, scene.cutoff);
        const std::uint32_t subgroup = add_block_constants(device, constants);
        bucket = bucket_length(device);
        constants["SEGMENT"] = static_cast<std::int32_t>(scene.segment);
        constants["DEPTH_SUM"] = constants["ALPHA_GRADIENT"] = scene.depth_sum ? 1 : 0;
        constants["DEPTH_SPREAD"] = scene.depth_spread ? 1 : 0;
        constants["BUCKET"] = static_cast<std::int32_t>(bucket);
        constants = for_several_passes(constants);
        const bool several = writes_every_slot(scene.back);
        constants["THREADS"] = static_cast<std::int32_t>(several ? 4 * subgroup : subgroup);
        constants["BATCH"] = scene.back == BackwardBlend::pixels4 ? 4 : 8;
        constants = for_several_passes(constants);
        backward = Pipeline(device, back_shader(scene.back), constants, true, subgroup);
        const std::uint32_t threads = scene.threads > 0 ? scene.threads : subgroup * 4;
        constants["THREADS"] = static_cast<std::int32_t>(threads);
        constants["PIXELS"] = static_cast<std::int32_t>(256 / threads);
        constants["STORE_FOR_BACKWARD"] = store ? 1 : 0;
        constants["CHECKPOINTS"] = scene.buckets() ? 1 : 0;
        constants["MIN_TRANSMITTANCE"] = least_transmittance(scene.stop);
        blend =
            Pipeline(device, scene.records ? "blend_records" : "blend", constants, true, subgroup);
        constants = for_several_passes(constants);
        constants["THREADS"] = SPLAT_GROUP;
        bucket_tiles = Pipeline(device, "bucket_tiles", constants);
        bucket_behind = Pipeline(device, "bucket_behind", constants);
    }
    static const char* back_shader(BackwardBlend back) {
        if (is_by_pixels(back)) return "blend_backward_pixels";
        if (back == BackwardBlend::buckets) return "blend_backward_buckets";
        return back == BackwardBlend::team ? "blend_backward_team" : "blend_backward";
    }
};

/// d_image: [3][H][W], or empty for the forward pass alone.
inline BlendOutput blend_on_device(const BlendScene& scene, const reference::TileLists& lists,
                                   bool store = true, const std::vector<float>& d_image = {},
                                   bool all_blocks = false) {
    Device& device = shared_device();
    const BlendPipelines pipelines(device, scene, store);
    const ShuffledIntersections shuffled(scene, lists, all_blocks);
    std::vector<glm::vec4> shape, light, bound;
    std::vector<float> exponent;
    for (const auto& s : scene.splats) {
        shape.emplace_back(s.mean_px.x, s.mean_px.y, s.l11, s.l21);
        light.emplace_back(s.colour.x, s.colour.y, s.colour.z, s.opacity);
        exponent.push_back(static_cast<float>(s.exponent));
        bound.emplace_back(s.l22, s.reach * (1 + 1e-5), s.depth, 0.0);
    }
    const size_t pixels = size_t(scene.width) * scene.height,
                 intersections = lists.intersection_count();
    const size_t more = scene.depth_sum ? 1 : 0;  // sums of an intersection
    const size_t planes = scene.depth_spread ? 6 : 3 + more;
    const size_t checkpoint_planes = scene.depth_spread ? 6 : 4 + more;
    const size_t records = intersections / pipelines.bucket + lists.tile_count();
    const float start = writes_every_slot(scene.back) ? NAN : 0.0f;
    // A record that no pixel reaches must not be read: NaN would show.
    const std::vector<float> unwritten(scene.buckets() ? records * 256 * checkpoint_planes : 1,
                                       NAN);
    const GuardedBuffer ranges(device, "tile range", shuffled.ranges),
        order(device, "intersection from sorted", shuffled.order),
        splats(device, "splat from intersection", shuffled.splat_from_intersection),
        shapes(device, "shape", shape), lights(device, "light", light),
        bounds(device, "bound", bound), image(device, "image", pixels * 4 * planes),
        final_t(device, "final T", store || scene.segment > 0 ? pixels * 4 : 4),
        behind(device, "behind", scene.segment > 0 ? pixels * 4 : 4),
        last(device, "last intersection", store ? pixels * 4 : 4),
        d_images(device, "d_image", d_image),
        partials(device, "partials", std::vector<float>(intersections * 8, start)),
        rest(device, "partial rest", std::vector<float>(intersections * (1 + more), start)),
        exponents(device, "exponent", exponent),
        partial_exponent(device, "partial exponent", std::vector<float>(intersections, start)),
        checkpoints(device, "checkpoints", unwritten),
        bucket_tile(device, "bucket tile", std::vector<std::uint32_t>(records, 0)),
        bucket_rest(device, "behind buckets",
                    std::vector<float>(scene.buckets() ? records * 256 : 1, NAN));
    std::uint32_t longest = 0;
    for (const glm::uvec2& r : shuffled.ranges) longest = std::max(longest, r.y - r.x);
    gpu::BlendArgs args{static_cast<std::uint32_t>(scene.width),
                        static_cast<std::uint32_t>(scene.height),
                        static_cast<std::uint32_t>(lists.tiles_x),
                        scene.background.r,
                        scene.background.g,
                        scene.background.b,
                        0,
                        1};
    if (scene.segment > 0) args.segments = longest / scene.segment + 1;
    const auto groups_x = static_cast<std::uint32_t>(lists.tiles_x);
    const auto groups_y = static_cast<std::uint32_t>(lists.tiles_y);
    Commands commands(device);
    commands.begin();
    for (; args.segment < args.segments; ++args.segment)
        commands.dispatch(pipelines.blend, args,
                          {ranges, order, splats, shapes, lights, bounds, image, final_t, last,
                           checkpoints, exponents},
                          groups_x, groups_y);
    commands.submit_and_wait();
    BlendOutput out{image.read<float>(), final_t.read<float>(), last.read<std::uint32_t>(), {}};
    commands.begin();
    const gpu::BucketArgs bucket_args{args.width, args.height, args.tiles_x,
                                      static_cast<std::uint32_t>(records)};
    if (scene.buckets())
        commands.dispatch(pipelines.bucket_tiles, bucket_args, {ranges, bucket_tile}, groups_x,
                          groups_y);
    while (args.segment-- > 0 && !d_image.empty())
        if (scene.buckets())
            commands.dispatch(pipelines.bucket_behind, args,
                              {ranges, d_images, last, checkpoints, behind, bucket_rest}, groups_x,
                              groups_y, 4);
        else
            commands.dispatch(
                pipelines.backward, args,
                {ranges, order, splats, shapes, lights, bounds, d_images, final_t, last, partials,
                 partials, partials, partials, partials, rest, behind, exponents, partial_exponent},
                groups_x, groups_y);
    if (scene.buckets() && !d_image.empty())
        commands.dispatch(
            pipelines.backward, bucket_args,
            {ranges, order, splats, shapes, lights, bounds, d_images, last, bucket_tile,
             checkpoints, bucket_rest, partials, rest, exponents, partial_exponent},
            static_cast<std::uint32_t>(records));
    commands.submit_and_wait();
    for (const GuardedBuffer* buffer :
         {&ranges, &order, &splats, &shapes, &lights, &bounds, &image, &final_t, &last, &partials,
          &rest, &behind, &checkpoints, &bucket_tile, &bucket_rest, &partial_exponent})
        EXPECT_TRUE(buffer->intact());
    const auto sums = partials.read<float>(), rests = rest.read<float>();
    const auto of_exponent = partial_exponent.read<float>();
    for (size_t j = 0; j < intersections; ++j) {
        const float* p = &sums[shuffled.order[j] * size_t{8}];
        out.intersections.push_back({p[0],
                                     p[1],
                                     p[2],
                                     p[3],
                                     p[4],
                                     {p[5], p[6], p[7]},
                                     rests[shuffled.order[j] * (1 + more)],
                                     of_exponent[shuffled.order[j]],
                                     more > 0 ? rests[shuffled.order[j] * 2 + 1] : 0.0f});
    }
    return out;
}

/// The last planes of a picture with depth_spread: sums over splats of w (z - z0) and of its
/// square, and z0.
struct DepthPlanes {
    std::vector<float> sum, square, first;

    DepthPlanes(const BlendScene& scene, const std::vector<float>& image) {
        const auto pixels = std::ptrdiff_t{scene.width} * scene.height;
        for (std::vector<float>* plane : {&sum, &square, &first}) {
            const auto at =
                image.begin() + (3 + (plane == &square) + 2 * (plane == &first)) * pixels;
            plane->assign(at, at + pixels);
        }
    }
    /// W sum(w z z) - sum(w z)^2 of a pixel, which does not depend on z0.
    double spread(size_t pixel, double cover) const {
        return cover * double(square[pixel]) - double(sum[pixel]) * double(sum[pixel]);
    }
};

inline reference::BlendImages<double> blend_in_double(const BlendScene& scene,
                                                      const reference::TileLists& lists) {
    reference::BlendImages<double> images{Image<double>(scene.width, scene.height, 3),
                                          Image<double>(scene.width, scene.height, 1),
                                          Image<double>(scene.width, scene.height, 1),
                                          Image<std::int32_t>(scene.width, scene.height, 1),
                                          Image<double>(scene.width, scene.height, 1)};
    for (size_t t = 0; t < lists.tile_count(); ++t)
        reference::blend_tile(lists, t, scene.splats, scene.table(), scene.settings(), images);
    return images;
}

}  // namespace darb::test
