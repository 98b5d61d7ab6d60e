// Projected splats set by hand, blended by blend.comp and back by blend_backward.comp alone, with
// the same lists for the reference.
#pragma once

#include <algorithm>
#include <numeric>

#include "engine/core/rng.h"
#include "engine/gpu/commands.h"
#include "engine/reference/blend.h"
#include "engine/render/forward.h"
#include "engine/render/kernel_constants.h"
#include "tests/support/guarded_buffer.h"
#include "tests/support/shared_device.h"

namespace darb::test {

struct BlendScene {
    int width = 16, height = 16;  // px
    int kernel = KERNEL_GAUSSIAN;
    Footprint footprint = Footprint::psi;
    int evaluation = EVALUATION_POLYNOMIAL;
    float cutoff = static_cast<float>(ALPHA_CUTOFF_DEFAULT);
    glm::vec3 background{0.0f};
    std::vector<reference::ProjectedSplat<double>> splats;  // nearest first

    /// Mean in px, S' = [[xx, xy], [xy, yy]] in px^2. Everything is rounded to float, so that both
    /// sides start from the same numbers.
    void add(glm::dvec2 mean, glm::dvec3 cov, double opacity, glm::dvec3 colour) {
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
        s.reach = table().reach(s.opacity, double(cutoff));
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
            add(mean, cov, opacity, {rng.uniform(), rng.uniform(), rng.uniform()});
        }
    }
    const reference::KernelTable& table() const {
        return reference::kernel_table(kernel, footprint);
    }
    reference::RenderSettings settings() const {
        reference::RenderSettings s;
        s.alpha_cutoff = cutoff;
        for (int c = 0; c < 3; ++c) s.background[c] = background[c];
        return s;
    }
    reference::TileLists lists() const {
        auto copy = splats;
        return reference::make_tile_lists(width, height, copy);
    }
};

/// What the passes leave. Partials are in the order of the lists.
struct BlendOutput {
    std::vector<float> image;                                // [3][H][W]
    std::vector<float> transmittance;                        // [H][W], with store
    std::vector<std::uint32_t> last;                         // [H][W], with store
    std::vector<glm::vec4> partial_a, partial_b, partial_c;  // [K], with d_image
};

/// d_image: [3][H][W], or empty for the forward pass alone.
inline BlendOutput blend_on_device(const BlendScene& scene, const reference::TileLists& lists,
                                   bool store = true, const std::vector<float>& d_image = {}) {
    Device& device = shared_device();
    const BlendShape deal = blend_shape(device);
    SpecConstants constants =
        kernel_constants(scene.kernel, scene.footprint, scene.evaluation, 5, scene.cutoff);
    constants["THREADS"] = static_cast<std::int32_t>(deal.threads);
    constants["SUBGROUPS"] = static_cast<std::int32_t>(deal.subgroups);
    constants["STORE_FOR_BACKWARD"] = store ? 1 : 0;

    // Pairs lie in their slots in any order; only pair_order knows the lists.
    const size_t pairs = lists.pair_count();
    std::vector<std::uint32_t> order(pairs), pair_splat(pairs + 1, 0);
    std::iota(order.begin(), order.end(), 0U);
    Pcg32 rng(17);
    for (size_t i = pairs; i > 1; --i)
        std::swap(order[i - 1], order[rng.below(static_cast<std::uint32_t>(i))]);
    for (size_t j = 0; j < pairs; ++j) pair_splat[order[j]] = lists.splats[j];
    std::vector<glm::uvec2> ranges;
    for (size_t t = 0; t < lists.tile_count(); ++t) {
        const bool empty = lists.begin[t] == lists.begin[t + 1];
        ranges.push_back(empty ? glm::uvec2(0) : glm::uvec2(lists.begin[t], lists.begin[t + 1]));
    }
    std::vector<glm::vec4> shape, light, bound;
    for (const auto& s : scene.splats) {
        shape.emplace_back(s.mean_px.x, s.mean_px.y, s.l11, s.l21);
        light.emplace_back(s.colour.x, s.colour.y, s.colour.z, s.opacity);
        bound.emplace_back(s.l22, s.reach * (1 + 1e-5), s.depth, 0.0);
    }

    const size_t pixels = size_t(scene.width) * scene.height;
    const GuardedBuffer tile_range(device, "tile range", ranges),
        pair_order(device, "pair order", order), pair_splats(device, "pair splat", pair_splat),
        shapes(device, "shape", shape), lights(device, "light", light),
        bounds(device, "bound", bound), image(device, "image", pixels * 12),
        final_t(device, "final T", store ? pixels * 4 : 4),
        last(device, "last pair", store ? pixels * 4 : 4), d_images(device, "d_image", d_image),
        a(device, "partial a", pairs * 16), b(device, "partial b", pairs * 16),
        c(device, "partial c", pairs * 16);
    const gpu::BlendArgs args{static_cast<std::uint32_t>(scene.width),
                              static_cast<std::uint32_t>(scene.height),
                              static_cast<std::uint32_t>(lists.tiles_x),
                              scene.background.r,
                              scene.background.g,
                              scene.background.b};
    const auto groups_x = static_cast<std::uint32_t>(lists.tiles_x);
    const auto groups_y = static_cast<std::uint32_t>(lists.tiles_y);
    const Pipeline blend(device, "blend", constants);
    const Pipeline backward(device, "blend_backward", constants);
    Commands commands(device);
    commands.begin();
    commands.dispatch(
        blend, args,
        {tile_range, pair_order, pair_splats, shapes, lights, bounds, image, final_t, last},
        groups_x, groups_y);
    if (!d_image.empty())
        commands.dispatch(backward, args,
                          {tile_range, pair_order, pair_splats, shapes, lights, bounds, d_images,
                           final_t, last, a, b, c},
                          groups_x, groups_y);
    commands.submit_and_wait();
    for (const GuardedBuffer* buffer : {&tile_range, &pair_order, &pair_splats, &shapes, &lights,
                                        &bounds, &image, &final_t, &last, &a, &b, &c})
        EXPECT_TRUE(buffer->intact());
    BlendOutput out;
    out.image = image.read<float>();
    out.transmittance = final_t.read<float>();
    out.last = last.read<std::uint32_t>();
    const auto by_list = [&](const GuardedBuffer& from) {
        const auto slots = from.read<glm::vec4>();
        std::vector<glm::vec4> sorted(pairs);
        for (size_t j = 0; j < pairs; ++j) sorted[j] = slots[order[j]];
        return sorted;
    };
    out.partial_a = by_list(a);
    out.partial_b = by_list(b);
    out.partial_c = by_list(c);
    return out;
}

inline reference::BlendImages<double> blend_in_double(const BlendScene& scene,
                                                      const reference::TileLists& lists) {
    reference::BlendImages<double> images{Image<double>(scene.width, scene.height, 3),
                                          Image<double>(scene.width, scene.height, 1),
                                          Image<std::int32_t>(scene.width, scene.height, 1)};
    for (size_t t = 0; t < lists.tile_count(); ++t)
        reference::blend_tile(lists, t, scene.splats, scene.table(), scene.settings(), images);
    return images;
}

}  // namespace darb::test
