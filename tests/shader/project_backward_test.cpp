// SPDX-License-Identifier: MIT
// project_backward.comp alone, with its gradients stored rather than applied, against the reference
// for the same sums per intersection; and partial_chunks.comp before it.
#include "tests/support/backward_pass.h"
#include "tests/support/compare_arrays.h"
#include "tests/support/every_kernel.h"
#include "tests/support/test_scene.h"

namespace darb::test {
namespace {

/// Every splat must be visible in the reference. Each is compared on its own scale, because
/// gradients of different splats differ by more than their rounding.
void expect_gradients_match(const SplatModel& model, const Camera& camera, int sh_degree = 3) {
    const Tolerance& allowed = tolerance("project_gradient_float32");
    const int degree = std::min(sh_degree, model.sh_degree);
    const Partials partials = Partials::random(model.size(), 77);
    const DoubleGradients expected = gradients_in_double(model, camera, degree, partials);
    const PassState start = start_state(model);
    const PassState after = run_backward_pass(model, camera, degree, UPDATE_STORE, start, partials);
    EXPECT_EQ(after.parameters, start.parameters);
    EXPECT_EQ(after.status.bad_gradients, 0U);
    const auto got = after.d;
    for (int a = 0; a < kAttributeCount; ++a) {
        const size_t stride = got[a].size() / model.size();
        if (stride == 0) continue;
        std::vector<double> truth, relative;  // in units of the splat's own largest entry
        for (size_t i = 0; i < model.size(); ++i) {
            double largest = 0;
            if (a == kShape)  // two sums that may cancel: in units of the terms of one of them
                for (std::uint32_t e = 0; e < partials.count[i]; ++e)
                    largest += std::abs(partials.intersections[partials.begin[i] + e][9]);
            for (size_t c = 0; c < stride; ++c)
                largest = std::max(largest, std::abs(expected.d[a][i * stride + c]));
            for (size_t c = 0; c < stride; ++c) {
                const double unit = largest > 0 ? largest : 1;
                truth.push_back(expected.d[a][i * stride + c] / unit);
                relative.push_back(got[a][i * stride + c] / unit);
            }
        }
        EXPECT_TRUE(compare_scaled(attribute_name(a), truth, relative, allowed));
    }
    std::vector<double> norms;
    for (size_t i = 0; i < model.size(); ++i) {
        norms.push_back(after.gradient_sum[i].x);
        EXPECT_EQ(after.gradient_sum[i].y, partials.count[i] > 0 ? 1 : 0) << "splat " << i;
    }
    EXPECT_TRUE(compare_scaled("mean", expected.mean_ndc, norms, allowed));
}

TEST(ProjectBackward, every_kernel_and_footprint_matches_double) {
    for (const int kernel : every_kernel())
        for (const Footprint footprint : {Footprint::psi, Footprint::exact}) {
            if (footprint == Footprint::exact && !has_exact_footprint(kernel)) continue;
            SCOPED_TRACE(std::string(kernel_name(kernel)) + " " +
                         std::string(footprint_name(footprint)));
            const TestScene s = random_scene({.count = 100,
                                              .kernel = kernel,
                                              .footprint = footprint,
                                              .min_log_scale = -4,
                                              .max_log_scale = 0,
                                              .seed = 51});
            expect_gradients_match(s.model, s.camera);
        }
}

TEST(ProjectBackward, every_sh_degree_stored_and_used_matches_double) {
    for (int stored = 0; stored <= 3; ++stored)
        for (int used = 0; used <= stored; ++used) {
            SCOPED_TRACE(fmt::format("stored {}, used {}", stored, used));
            TestScene s = random_scene({.count = 100, .sh_degree = stored, .seed = 52});
            for (float& value : s.model.sh_rest) value *= 5;  // some colours clamp at 0
            expect_gradients_match(s.model, s.camera, used);
        }
}

TEST(ProjectBackward, splats_beyond_the_jacobian_clamp_match_double) {
    TestScene s = random_scene({.count = 200, .min_log_scale = -1, .max_log_scale = 1, .seed = 53});
    s.camera.cx = 3;
    s.camera.cy = 30;
    size_t beyond = 0;
    for (size_t i = 0; i < s.model.size(); ++i) {
        for (int c = 0; c < 3; ++c) s.model.position[i * 3 + c] *= 4;
        const glm::dvec3 world(s.model.position[i * 3], s.model.position[i * 3 + 1],
                               s.model.position[i * 3 + 2]);
        glm::dvec3 p = s.camera.rotation * world + s.camera.translation;
        if (p.z < 0.3) {  // into the view's half space
            p.z = 0.5 + std::abs(p.z);
            const glm::dvec3 back = glm::transpose(s.camera.rotation) * (p - s.camera.translation);
            for (int c = 0; c < 3; ++c) s.model.position[i * 3 + c] = static_cast<float>(back[c]);
        }
        const double x = s.camera.fx * p.x / p.z + s.camera.cx;
        beyond += x < -0.15 * 32 || x > 1.15 * 32;
    }
    ASSERT_GT(beyond, 50U);
    expect_gradients_match(s.model, s.camera);
}

TEST(ProjectBackward, quaternions_of_any_norm_match_double) {
    for (const double norm : {2e-6, 1e-3, 1e5, 1e15}) {
        SCOPED_TRACE(fmt::format("norm {}", norm));
        TestScene s = random_scene({.count = 60, .seed = 54});
        for (size_t i = 0; i < s.model.size(); ++i) {
            double square = 0;
            for (int c = 0; c < 4; ++c) square += std::pow(s.model.rotation[i * 4 + c], 2);
            for (int c = 0; c < 4; ++c)
                s.model.rotation[i * 4 + c] =
                    static_cast<float>(s.model.rotation[i * 4 + c] * norm / std::sqrt(square));
        }
        expect_gradients_match(s.model, s.camera);
    }
}

TEST(ProjectBackward, needles_and_discs_match_double) {
    for (const double ratio : {1e2, 1e4, 1e6})
        for (const bool disc : {false, true}) {
            SCOPED_TRACE(fmt::format("ratio {} {}", ratio, disc ? "disc" : "needle"));
            TestScene s = random_scene({.count = 60, .seed = 55});
            const auto thin = static_cast<float>(-std::log(ratio));
            for (size_t i = 0; i < s.model.size(); ++i)
                for (int c = 0; c < 3; ++c)
                    s.model.log_scale[i * 3 + c] = (c == 0) == disc ? thin : 0.0f;
            expect_gradients_match(s.model, s.camera);
        }
}

TEST(ProjectBackward, parameters_beyond_their_limits_have_no_gradient) {
    TestScene s = random_scene({.count = 8, .seed = 56});
    for (size_t i = 0; i < 8; ++i) {
        s.model.opacity_logit[i] = i % 2 == 0 ? 1e4f : 31.0f;
        s.model.log_scale[i * 3] = -50;
    }
    const Partials partials = Partials::random(8, 5);
    const PassState after =
        run_backward_pass(s.model, s.camera, 3, UPDATE_STORE, start_state(s.model), partials);
    const auto d = after.d;
    for (size_t i = 0; i < 8; ++i) {
        EXPECT_EQ(d[kOpacityLogit][i], 0) << "splat " << i;
        EXPECT_EQ(d[kLogScale][i * 3], 0) << "splat " << i;
        EXPECT_EQ(d[kLogScale][i * 3 + 1] != 0, partials.count[i] > 0) << "splat " << i;
    }
    EXPECT_EQ(after.status.bad_gradients, 0U);
}

TEST(ProjectBackward, colours_clamped_at_zero_have_no_gradient) {
    TestScene s = random_scene({.count = 3, .sh_degree = 1, .seed = 57});
    s.model.sh_rest.assign(s.model.sh_rest.size(), 0.0f);
    s.model.sh_dc = {-10, 1, 1, 1, -10, 1, 1, 1, -10};
    const auto d = run_backward_pass(s.model, s.camera, 1, UPDATE_STORE, start_state(s.model),
                                     Partials::random(3, 6))
                       .d;
    for (size_t i = 0; i < 3; ++i)
        for (size_t c = 0; c < 3; ++c) {
            EXPECT_EQ(d[kShDc][i * 3 + c] == 0, i == c) << "splat " << i << " channel " << c;
            EXPECT_EQ(d[kShRest][i * 9 + c] == 0, i == c) << "splat " << i << " channel " << c;
        }
}

/// Splats with these numbers of intersections; their order of depth is not that of the file.
Partials many_intersections(const std::vector<std::uint32_t>& counts) {
    Partials p;
    p.count = counts;
    p.begin.resize(counts.size());
    Pcg32 rng(91);
    for (size_t k = 0; k < counts.size(); ++k) {
        const size_t i = (k * 7 + 3) % counts.size();
        p.begin[i] = static_cast<std::uint32_t>(p.intersections.size());
        for (std::uint32_t e = 0; e < counts[i]; ++e)
            for (float& sum : p.intersections.emplace_back())
                sum = static_cast<float>(rng.uniform(-1, 1));
    }
    return p;
}

/// Intersections after partial_chunks.comp. rests: as RESTS; window: intersections of a binding, or
/// 0 for all in one.
std::vector<IntersectionPartials> add_chunks(const Partials& p, int kernel,
                                             std::uint32_t window = 0, std::uint32_t overflow = 0) {
    Device& device = shared_device();
    SpecConstants constants = kernel_constants(kernel, Footprint::psi);
    constants["WINDOW_INTERSECTIONS"] = static_cast<std::int32_t>(window);
    const auto k = static_cast<std::uint32_t>(p.intersections.size());
    std::vector<std::uint32_t> splats(k);
    for (std::uint32_t i = 0; i < p.count.size(); ++i)
        for (std::uint32_t e = 0; e < p.count[i]; ++e) splats[p.begin[i] + e] = i | 0xA0000000u;
    std::vector<float> sums, rest, exponent;
    for (const IntersectionPartials& one : p.intersections) {
        sums.insert(sums.end(), one.begin(), one.begin() + 8);
        rest.push_back(one[8]);
        exponent.push_back(one[9]);
    }
    std::vector<gpu::FrameStatus> frame(1);
    frame[0].overflow = overflow;
    const GuardedBuffer status(device, "status", frame),
        in_use(device, "in use", std::vector<std::uint32_t>{k}), splat(device, "splats", splats),
        count(device, "count", p.count), first(device, "first", p.begin),
        partials(device, "partials", sums), rests(device, "rest", rest),
        exponents(device, "exponent", exponent);
    std::vector<BufferRange> buffers{status, in_use, splat, count, first};
    for (std::uint32_t w = 0; w < PARTIAL_WINDOWS; ++w) {
        const std::uint64_t begin = std::uint64_t{w} * window * 32;
        buffers.push_back(
            window == 0 || begin >= sums.size() * 4
                ? BufferRange(partials)
                : BufferRange(partials.buffer(), GuardedBuffer::offset() + begin,
                              std::min<std::uint64_t>(window * 32, sums.size() * 4 - begin)));
    }
    buffers.insert(buffers.end(), {rests, exponents});
    const Pipeline pipeline(device, "partial_chunks", constants);
    Commands commands(device);
    commands.begin();
    const Groups g = groups_for(k);
    commands.dispatch(pipeline, NoArgs{}, buffers, g.x, g.y);
    commands.submit_and_wait();
    EXPECT_TRUE(partials.intact() && rests.intact() && exponents.intact());
    sums = partials.read<float>();
    rest = rests.read<float>();
    exponent = exponents.read<float>();
    std::vector<IntersectionPartials> after(k);
    for (size_t e = 0; e < k; ++e) {
        std::copy_n(sums.begin() + static_cast<std::ptrdiff_t>(8 * e), 8, after[e].begin());
        after[e][8] = rest[e];
        after[e][9] = exponent[e];
    }
    return after;
}

/// The same on the host, in the same order; values: 9, or 10 with a shape.
std::vector<IntersectionPartials> chunks_in_order(const Partials& p, size_t values) {
    std::vector<IntersectionPartials> after = p.intersections;
    for (size_t i = 0; i < p.count.size(); ++i) {
        if (p.count[i] <= SUM_CHUNK) continue;
        for (std::uint32_t at = 0; at < p.count[i]; at += SUM_CHUNK)
            for (size_t c = 0; c < values; ++c) {
                std::array<float, 8> sums{};
                for (std::uint32_t e = at; e < std::min(at + SUM_CHUNK, p.count[i]); ++e)
                    sums[(e - at) % 8] += p.intersections[p.begin[i] + e][c];
                float sum = sums[0];
                for (size_t row = 1; row < 8; ++row) sum += sums[row];
                after[p.begin[i] + at][c] = sum;
            }
    }
    return after;
}

const std::vector<std::uint32_t> kManyCounts{1,  64, 65, 0,   66,  128, 129, 700, 3,
                                             65, 65, 2,  192, 193, 63,  1,   500, 5};

TEST(PartialChunks, chunks_of_large_splats_are_added_in_a_fixed_order) {
    const Partials p = many_intersections(kManyCounts);
    EXPECT_EQ(add_chunks(p, KERNEL_GAUSSIAN), chunks_in_order(p, 9));
    EXPECT_EQ(add_chunks(p, KERNEL_BETA), chunks_in_order(p, 10));
    EXPECT_NE(chunks_in_order(p, 9), p.intersections) << "there is nothing to add";
}

TEST(PartialChunks, windows_of_a_small_binding_hold_the_same_sums) {
    const Partials p = many_intersections(kManyCounts);
    ASSERT_LT(p.intersections.size(), 4 * 640U);
    EXPECT_EQ(add_chunks(p, KERNEL_GAUSSIAN, 640), chunks_in_order(p, 9));
}

TEST(PartialChunks, a_frame_that_overflowed_is_left_alone) {
    const Partials p = many_intersections(kManyCounts);
    EXPECT_EQ(add_chunks(p, KERNEL_GAUSSIAN, 0, OVERFLOW_LISTS), p.intersections);
}

TEST(PartialChunks, gradients_from_chunks_match_double) {
    const TestScene s = random_scene({.count = kManyCounts.size(), .seed = 59});
    Partials p = many_intersections(kManyCounts);
    const DoubleGradients expected = gradients_in_double(s.model, s.camera, 3, p);
    p.intersections = add_chunks(p, KERNEL_GAUSSIAN);
    const auto got = run_backward_pass(s.model, s.camera, 3, UPDATE_STORE, start_state(s.model), p,
                                       {}, {}, {0.0f}, true)
                         .d;
    for (int a = 0; a < kAttributeCount; ++a)
        if (!expected.d[a].empty()) {
            EXPECT_TRUE(compare_scaled(attribute_name(a), expected.d[a], got[a],
                                       tolerance("project_gradient_float32")));
        }
}

// Every tile of the largest image that one buffer binding of 128 MiB holds.
TEST(ProjectBackward, a_splat_with_43000_intersections_sums_all_of_them) {
    const TestScene s = random_scene({.count = 1, .seed = 58});
    Partials partials;
    partials.begin = {0};
    partials.count = {43'000};
    partials.intersections.assign(43'000, {1, 0.5f, -0.25f, 1, 2, 1, 1, 1, 0.5f});
    const DoubleGradients expected = gradients_in_double(s.model, s.camera, 3, partials);
    const auto got =
        run_backward_pass(s.model, s.camera, 3, UPDATE_STORE, start_state(s.model), partials).d;
    for (int a = 0; a < kAttributeCount; ++a)
        if (!expected.d[a].empty()) {
            EXPECT_TRUE(compare_scaled(attribute_name(a), expected.d[a], got[a],
                                       tolerance("project_gradient_float32")));
        }
}

}  // namespace
}  // namespace darb::test
