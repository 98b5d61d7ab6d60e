// SPDX-License-Identifier: MIT
// project_backward.comp alone: parameters and moments of a model on the device, sums of
// intersections set by the test, and the reference's gradients for the same sums.
#pragma once

#include <array>

#include "engine/core/rng.h"
#include "engine/gpu/commands.h"
#include "engine/primitives/groups.h"
#include "engine/raster/backward.h"
#include "engine/raster/kernel_constants.h"
#include "engine/reference/reference_render.h"
#include "tests/support/guarded_buffer.h"
#include "tests/support/shared_device.h"

namespace darb::test {

/// What blend_backward leaves for one intersection: [0..3] sums of G x, G x x, G x dy, G dy; [4]
/// d_opacity; [5..7] d_colour; [8] sum of G dy dy.
using IntersectionPartials = std::array<float, 10>;

/// The intersections of every splat, one after another.
struct Partials {
    std::vector<std::uint32_t> count, begin;          // [N]
    std::vector<IntersectionPartials> intersections;  // [K]

    /// 0 to 5 intersections each; every fifth splat has none. The size of the sums differs by 1e4
    /// between splats, as it does in scenes.
    static Partials random(size_t splats, std::uint64_t seed) {
        Pcg32 rng(seed), exponents(seed, 9);  // exponents: for kernels with shapes, drawn from a
                                              // stream of their own
        Partials p;
        for (size_t i = 0; i < splats; ++i) {
            p.begin.push_back(static_cast<std::uint32_t>(p.intersections.size()));
            p.count.push_back(i % 5 == 4 ? 0 : 1 + rng.below(5));
            const double size = std::pow(10.0, rng.uniform(-4, 0));
            for (std::uint32_t k = 0; k < p.count.back(); ++k) {
                p.intersections.emplace_back();
                IntersectionPartials& sums = p.intersections.back();
                for (size_t c = 0; c < 9; ++c)
                    sums[c] = static_cast<float>(size * rng.uniform(-1, 1));
                sums[9] = static_cast<float>(size * exponents.uniform(-1, 1));
            }
        }
        return p;
    }
};

struct PassState {
    std::array<std::vector<float>, kAttributeCount> parameters;
    std::array<std::vector<float>, kAttributeCount> moments;  // [N][stride][2]
    std::array<std::vector<float>, kAttributeCount> d;        // what UPDATE_STORE and _ADD leave
    std::vector<float> rest_sum;                              // as the harmonics
    std::vector<glm::vec2> gradient_sum;
    gpu::FrameStatus status;
    bool operator==(const PassState& o) const {
        return parameters == o.parameters && moments == o.moments && d == o.d &&
               rest_sum == o.rest_sum && gradient_sum == o.gradient_sum &&
               std::memcmp(&status, &o.status, sizeof status) == 0;
    }
};

inline PassState start_state(const SplatModel& model) {
    PassState s;
    for (int a = 0; a < kAttributeCount; ++a) {
        s.parameters[a] = attribute_values(model, a);
        s.moments[a].assign(s.parameters[a].size() * 2, 0.0f);
        s.d[a].assign(s.parameters[a].size(), 0.0f);
    }
    s.rest_sum.assign(model.sh_rest.size(), 0.0f);
    s.gradient_sum.assign(model.size(), glm::vec2(0));
    s.status = {};
    return s;
}

/// The arguments as Backward makes them, except that weights are not divided by the count.
inline gpu::ProjectBackwardArgs backward_args(std::uint32_t splats, const AdamStep& step) {
    gpu::ProjectBackwardArgs args{};
    args.splat_end = splats;
    args.low_pass = static_cast<float>(LOW_PASS_DEFAULT);
    std::copy(step.rate.begin(), step.rate.end(), args.rate);
    args.inverse_sqrt_correction2 = step.inverse_sqrt_correction2;
    args.opacity_weight = step.opacity_weight;
    args.scale_weight = step.scale_weight;
    args.flatness_weight = step.flatness_weight;
    args.regularise_unseen = step.regularise_unseen > 0 ? 1u : 0u;
    args.largest_log_scale = step.largest_log_scale;
    args.clearance = step.clearance;
    args.rest_share = 1.0f / static_cast<float>(step.rest_every);
    return args;
}

/// Runs the pass once; update: UPDATE_*. Without Adam, gradient_sum receives what this view
/// contributes. by_chunks: partial_chunks.comp has been over the partials.
inline PassState run_backward_pass(const SplatModel& model, const Camera& camera, int sh_degree,
                                   int update, const PassState& before, const Partials& partials,
                                   const AdamStep& step = {}, const ProjectionEffects& effects = {},
                                   const std::vector<float>& filters = {0.0f},
                                   bool by_chunks = false, int projection = PROJECTION_JACOBIAN) {
    Device& device = shared_device();
    const auto n = static_cast<std::uint32_t>(model.size());
    SpecConstants constants = kernel_constants(model.kernel, model.footprint);
    constants["THREADS"] = SPLAT_GROUP;
    constants["SH_DEGREE"] = sh_degree;
    constants["SH_STORED"] = model.sh_degree;
    constants["UPDATE"] = update;
    constants["REST"] = step.rest;
    constants["FLATNESS"] = step.flatness_weight > 0 ? 1 : 0;
    constants["SUMS_BY_CHUNKS"] = by_chunks ? 1 : 0;
    constants["PROJECTION"] = projection;
    add_constants(effects, constants);
    const Pipeline pipeline(device, "project_backward", constants);
    std::vector<float> sums, rest, exponent;
    for (const IntersectionPartials& intersection : partials.intersections) {
        sums.insert(sums.end(), intersection.begin(), intersection.begin() + 8);
        rest.push_back(intersection[8]);
        exponent.push_back(intersection[9]);
    }
    const auto& b = before;
    const GuardedBuffer cameras(device, "cameras", std::vector{camera_data(camera, model.origin)});
    std::vector<AttributeRows> rows, state_rows;
    for (int a = 0; a < kAttributeCount; ++a) {
        rows.push_back(attribute_rows(a, model.floats(a)));
        state_rows.push_back(attribute_rows(a, model.floats(a), update == UPDATE_ADAM ? 2 : 1));
    }
    std::vector<GuardedBuffer> p, held;  // held: moments or gradients
    for (int a = 0; a < kAttributeCount; ++a) {
        p.emplace_back(device, attribute_name(a), held_rows(rows[a], b.parameters[a]));
        held.emplace_back(device, "state",
                          held_rows(state_rows[a], update == UPDATE_ADAM ? b.moments[a] : b.d[a]));
    }
    const GuardedBuffer count(device, "intersection count", partials.count),
        begin(device, "first intersection", partials.begin), sum(device, "partials", sums),
        rests(device, "partial rest", rest), gradient(device, "gradient sum", b.gradient_sum),
        status(device, "status", std::vector{b.status}), smoothing(device, "smoothing", filters),
        rest_sum(device, "rest sum", held_rows(rows[kShRest], b.rest_sum)),
        exponents(device, "partial exponent", exponent);
    std::vector<BufferRange> buffers{cameras};
    for (const GuardedBuffer& buffer : p) buffers.emplace_back(buffer);
    for (const GuardedBuffer& buffer : held) buffers.emplace_back(buffer);
    for (const GuardedBuffer* buffer : {&count, &begin, &sum, &sum, &sum, &sum, &sum, &rests,
                                        &gradient, &status, &smoothing, &rest_sum, &exponents})
        buffers.emplace_back(*buffer);
    Commands commands(device);
    commands.begin();
    const Groups g = groups_for(n);
    commands.dispatch(pipeline, backward_args(n, step), buffers, g.x, g.y);
    commands.submit_and_wait();
    PassState after = before;
    for (int a = 0; a < kAttributeCount; ++a) {
        EXPECT_TRUE(p[a].intact());
        EXPECT_TRUE(held[a].intact());
        after.parameters[a] = values_of_rows(rows[a], p[a].read<float>(), n);
        (update == UPDATE_ADAM ? after.moments : after.d)[a] =
            values_of_rows(state_rows[a], held[a].read<float>(), n);
    }
    EXPECT_TRUE(gradient.intact() && status.intact() && sum.intact() && rests.intact());
    EXPECT_TRUE(rest_sum.intact());
    after.rest_sum = values_of_rows(rows[kShRest], rest_sum.read<float>(), n);
    after.gradient_sum = gradient.read<glm::vec2>();
    after.status = status.read<gpu::FrameStatus>()[0];
    return after;
}

struct DoubleGradients {
    std::array<std::vector<double>, kAttributeCount> d;
    std::vector<double> mean_ndc;  // [N]
};

inline DoubleGradients gradients_in_double(const SplatModel& model, const Camera& camera,
                                           int sh_degree, const Partials& partials,
                                           const std::vector<float>& filters = {},
                                           int projection = PROJECTION_JACOBIAN) {
    reference::RenderSettings settings;
    settings.sh_degree = sh_degree;
    settings.projection = projection;
    auto splats = reference::make_splats<double>(model);
    splats.smoothing.assign(filters.begin(), filters.end());
    const auto& kernel = reference::kernel_table(model.kernel, model.footprint);
    reference::SplatGradients<double> out;
    out.resize_like(splats);
    DoubleGradients result;
    for (size_t i = 0; i < model.size(); ++i) {
        const auto s = reference::project(splats, i, camera, settings, kernel);
        double sum[10] = {};
        for (std::uint32_t e = 0; e < partials.count[i]; ++e)
            for (int c = 0; c < 10; ++c) sum[c] += partials.intersections[partials.begin[i] + e][c];
        const reference::ProjectedGradient<double> g{
            {2 * s.l11 * sum[0], 2 * (s.l21 * sum[0] + s.l22 * s.l22 * sum[3])},
            2 * (sum[1] - s.l21 * sum[2]) / s.l11,  // x = l11 dx + l21 dy
            2 * sum[2],
            2 * s.l22 * sum[8],
            sum[4],
            sum[9],
            0,  // gradient by the depth
            {sum[5], sum[6], sum[7]}};
        reference::project_backward(splats, i, camera, settings, kernel, {s, g}, out);
        result.mean_ndc.push_back(
            std::hypot(g.d_mean_px.x * camera.width / 2, g.d_mean_px.y * camera.height / 2));
    }
    for (int a = 0; a < kAttributeCount; ++a)
        result.d[static_cast<size_t>(a)] = attribute_values(out, a);
    return result;
}

}  // namespace darb::test
