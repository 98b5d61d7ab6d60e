// SPDX-License-Identifier: MIT
// The passes of the strategy mcmc against double precision, one by one and together; and the law
// that they serve: a splat replaced by several looks as it did.
#include "trainer/growth/mcmc.h"

#include "engine/core/rng.h"
#include "engine/kernels/relocation_table.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/primitives/groups.h"
#include "engine/reference/reference_density_control.h"
#include "engine/reference/reference_render.h"
#include "engine/scene/splat_model.h"
#include "shaders/shared/kernel_forms.h"
#include "shaders/shared/strategy_args.h"
#include "tests/support/compare_arrays.h"
#include "tests/support/every_kernel.h"
#include "tests/support/guarded_buffer.h"
#include "tests/support/shared_device.h"
#include "tests/support/test_scene.h"
#include "trainer/growth/density_control.h"

namespace darb::test {
namespace {

constexpr float kDead = 0.005f;
const SpecConstants kThreads{{"THREADS", SPLAT_GROUP}};

SplatModel population(size_t count, std::uint64_t seed = 31) {
    return random_scene({.count = count,
                         .sh_degree = 1,
                         .min_log_scale = -5,
                         .max_log_scale = 0,
                         .min_logit = -8,
                         .max_logit = 6,
                         .seed = seed})
        .model;
}

template <class Args>
void run_pass(const char* shader, const Args& args, std::initializer_list<BufferRange> buffers,
              std::uint32_t count, const SpecConstants& more = {}) {
    SpecConstants constants = kThreads;
    constants.insert(more.begin(), more.end());
    const Pipeline pipeline(shared_device(), shader, constants);
    Commands commands(shared_device());
    commands.begin();
    const Groups g = groups_for(count);
    commands.dispatch(pipeline, args, buffers, g.x, g.y);
    commands.submit_and_wait();
}

TEST(RelocationWeight, is_the_opacity_of_the_living) {
    SplatModel model = population(1000);
    model.opacity_logit[7] = std::nanf("");
    Device& d = shared_device();
    const float scale = 1e6f;
    const GuardedBuffer opacity(d, "opacity", model.opacity_logit), dead(d, "dead", 4000),
        weight(d, "weight", 4000), copies(d, "copies", 4000);
    const gpu::RelocationArgs args{1000, 1000, 0, 0, kDead, scale, 0};
    run_pass("relocation_weight", args, {opacity, dead, weight, copies}, 1000);
    const auto expected =
        reference::relocation_weights(model.opacity_logit, double{kDead}, double{scale});
    const auto got = weight.read<std::uint32_t>(), no = dead.read<std::uint32_t>();
    int dead_count = 0;
    for (size_t i = 0; i < 1000; ++i) {
        EXPECT_NEAR(got[i], expected[i], 1 + 1e-5 * expected[i]) << i;
        EXPECT_EQ(no[i], expected[i] == 0 ? 1U : 0U) << i;
        dead_count += expected[i] == 0;
    }
    EXPECT_EQ(no[7], 1U) << "no number";
    EXPECT_GT(dead_count, 50);
    EXPECT_EQ(copies.read<std::uint32_t>(), std::vector<std::uint32_t>(1000, 0));
    EXPECT_TRUE(dead.intact() && weight.intact() && copies.intact());
}

TEST(RelocationDraw, draws_and_places_are_those_of_the_reference) {
    for (const std::uint32_t n : {1U, 2U, 7U, 1000U}) {
        SCOPED_TRACE(n);
        Pcg32 rng(n);
        std::vector<std::uint32_t> weights, offsets, dead, dead_offsets;
        std::uint32_t sum = 0, dead_sum = 0;
        for (std::uint32_t i = 0; i < n; ++i) {
            weights.push_back(i > 0 && rng.below(3) == 0 ? 0 : 1 + rng.below(4'000'000));
            dead.push_back(weights[i] == 0 ? 1 : 0);
            offsets.push_back(sum);
            dead_offsets.push_back(dead_sum);
            sum += weights[i];
            dead_sum += dead[i];
        }
        const std::uint32_t grown = 3 + n / 20, draws = dead_sum + grown;
        const auto plan = reference::relocation_plan(weights, grown, 77);
        Device& d = shared_device();
        const GuardedBuffer offset(d, "offset", offsets), drawn(d, "drawn", draws * 4),
            copies(d, "copies", std::vector<std::uint32_t>(n, 0)), is_dead(d, "dead", dead),
            dead_offset(d, "dead offset", dead_offsets), sources(d, "sources", (n + grown) * 8);
        const gpu::RelocationArgs args{n, n + grown, dead_sum, sum, kDead, 0, 77};
        run_pass("relocation_draw", args, {offset, drawn, copies}, draws);
        EXPECT_EQ(drawn.read<std::uint32_t>(), plan.drawn);
        EXPECT_EQ(copies.read<std::uint32_t>(), plan.copies);
        run_pass("relocation_sources", args, {is_dead, dead_offset, drawn, copies, sources},
                 n + grown);
        const auto got = sources.read<glm::uvec2>();
        ASSERT_EQ(got.size(), plan.sources.size());
        for (size_t i = 0; i < got.size(); ++i) {
            EXPECT_EQ(got[i].x, plan.sources[i].splat) << i;
            EXPECT_EQ(got[i].y != DENSIFY_KEEP, plan.sources[i].changed) << i;
        }
        EXPECT_TRUE(drawn.intact() && copies.intact() && sources.intact());
    }
}

TEST(RelocationDraw, follows_the_weights) {
    const std::vector<std::uint32_t> weights{1000, 3000, 0, 6000};
    const auto plan = reference::relocation_plan(weights, 20'000, 5);
    for (size_t i = 0; i < 4; ++i)
        EXPECT_NEAR(plan.copies[i] / 20'001.0, weights[i] / 10'000.0, 0.014) << i;  // 4 sigma
}

TEST(Relocate, opacity_and_scale_match_double_for_every_kernel) {
    Device& d = shared_device();
    const size_t n = 600;
    SplatModel model = population(n);
    Pcg32 rng(3);
    std::vector<std::uint32_t> copies(n);
    std::vector<glm::uvec2> sources(n);
    for (size_t i = 0; i < n; ++i) {
        model.opacity_logit[i] = static_cast<float>(rng.uniform(-5.3, 6));
        copies[i] = i % 7 == 0 ? 70 : rng.below(8);  // more than the table has rows for
        sources[i] = {static_cast<std::uint32_t>(i), copies[i] > 0 ? DENSIFY_CLONE : DENSIFY_KEEP};
    }
    for (const int kernel : every_kernel()) {
        SCOPED_TRACE(std::string(kernel_name(kernel)));
        const bool shaped = kernel_has_shape(kernel);
        set_kernel(model, kernel);
        for (float& shape : model.shape) shape = static_cast<float>(rng.uniform(-2.5, 3.2));
        const GuardedBuffer shapes(d, "shape", model.shape), source(d, "sources", sources),
            copy(d, "copies", copies),
            table(
                d, "table",
                relocation_table(kernel, Footprint::psi, RELOCATION_OPACITIES, RELOCATION_COUNTS)),
            scale(d, "log_scale", model.log_scale), opacity(d, "opacity", model.opacity_logit);
        const auto count = static_cast<std::uint32_t>(n);
        run_pass("relocate", gpu::RelocationArgs{count, count, 0, 0, kDead, 0, 0},
                 {source, copy, table, scale, opacity, shapes}, count, shape_row_constants(kernel));
        const auto logit = opacity.read<float>(), log_scale = scale.read<float>();
        for (size_t i = 0; i < n; ++i) {
            if (copies[i] == 0) {
                ASSERT_EQ(logit[i], model.opacity_logit[i]) << i;
                ASSERT_EQ(log_scale[3 * i], model.log_scale[3 * i]) << i;
                continue;
            }
            auto expected =
                reference::relocated(kernel, Footprint::psi, model.opacity_logit[i], copies[i] + 1);
            if (shaped)
                expected.log_factor = std::log(shaped_kernel(kernel).relocation_scale(
                    Footprint::psi,
                    splat_exponent(kernel, Footprint::psi, static_cast<double>(model.shape[i])),
                    std::min(sigmoid(static_cast<double>(model.opacity_logit[i])),
                             double{ALPHA_MAX}),
                    static_cast<int>(std::min<std::uint32_t>(copies[i] + 1, RELOCATION_COUNTS))));
            ASSERT_NEAR(logit[i], expected.opacity_logit,
                        3e-5 + 1e-5 * std::abs(expected.opacity_logit))
                << i;
            // Between the table's columns: up to 0.3 %; between its shapes as much again.
            for (size_t c = 0; c < 3; ++c)
                ASSERT_NEAR(log_scale[3 * i + c] - model.log_scale[3 * i + c], expected.log_factor,
                            shaped ? 7e-3 : 4e-3)
                    << i << ": " << model.opacity_logit[i] << ", " << copies[i];
        }
        EXPECT_TRUE(scale.intact() && opacity.intact());
    }
}

TEST(PositionNoise, matches_double_and_spares_the_opaque) {
    Device& d = shared_device();
    const std::uint32_t n = 800;
    const SplatModel model = population(n);
    gpu::FrameStatus status{};
    const gpu::NoiseArgs args{n, 4711, 3.5f, kDead};
    for (const std::uint32_t overflow : {1U, 0U}) {
        status.overflow = overflow;
        const GuardedBuffer position(d, "position", model.position),
            scale(d, "log_scale", model.log_scale), rotation(d, "rotation", model.rotation),
            opacity(d, "opacity", model.opacity_logit), frame(d, "status", std::vector{status});
        run_pass("position_noise", args, {position, scale, rotation, opacity, frame}, n);
        const auto got = position.read<float>();
        EXPECT_TRUE(position.intact());
        if (overflow == 1) {
            EXPECT_EQ(got, model.position);
            continue;
        }
        int moved = 0, still = 0;
        for (std::uint32_t i = 0; i < n; ++i) {
            const glm::dvec3 noise =
                reference::position_noise(&model.rotation[4 * i], &model.log_scale[3 * i],
                                          model.opacity_logit[i], double{kDead}, 3.5, 4711, i);
            for (int c = 0; c < 3; ++c) {
                const double before = model.position[3 * i + static_cast<std::uint32_t>(c)];
                // The gate rounds with 100 times the opacity in its exponent.
                ASSERT_NEAR(got[3 * i + static_cast<std::uint32_t>(c)], before + noise[c],
                            1e-6 * (1 + std::abs(before)) + 3e-4 * glm::length(noise))
                    << i;
            }
            moved += glm::length(noise) > 1e-3;
            still += glm::length(noise) < 1e-9;
        }
        EXPECT_GT(moved, 50);
        EXPECT_GT(still, 200);
    }
}

TEST(PositionNoise, spreads_as_the_covariance_squared) {
    const float rotation[] = {1, 0, 0, 0}, log_scale[] = {0, -1, -2};
    glm::dmat3 second(0.0);
    for (std::uint32_t i = 0; i < 20'000; ++i) {
        const auto o = reference::position_noise(rotation, log_scale, -20, double{kDead}, 1, 9, i);
        second += glm::outerProduct(o, o) / 20'000.0;
    }
    const double gate = 1 / (1 + std::exp(-0.5));
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) {
            const double unit = gate * gate * std::exp(2.0 * log_scale[r] + 2.0 * log_scale[c]);
            EXPECT_NEAR(second[r][c] / unit, r == c ? 1 : 0, 0.05) << r << c;
        }
}

struct Round {
    SplatModel model;
    std::array<std::vector<float>, kAttributeCount> moments;
    DensityResult result;
};

/// Moments are 1 before.
Round run_round(const SplatModel& model, std::uint32_t grown, std::uint32_t seed = 5,
                std::span<const std::uint8_t> fixed = {}) {
    Device& d = shared_device();
    GpuSplats splats(d, model, true);
    for (int a = 0; a < kAttributeCount; ++a)
        splats.upload_moments(a, std::vector<float>(attribute_values(model, a).size() * 2, 1.0f));
    DensityControl density(d, model.kernel);
    Relocation relocation(d, model.kernel, model.footprint);
    Round round;
    round.result = relocation.run(splats, density, {kDead, grown, seed, fixed});
    round.model = splats.download();
    for (int a = 0; a < kAttributeCount; ++a) round.moments[a] = splats.download_moments(a);
    return round;
}

TEST(Relocation, nothing_moves_onto_fixed_splats) {
    SplatModel model = population(400);
    std::vector<std::uint8_t> fixed(model.size());
    for (std::size_t i = 0; i < fixed.size(); ++i) {
        fixed[i] = i % 2 == 0 ? 1 : 0;
        model.position[3 * i] = fixed[i] != 0 ? -1.0f : 1.0f;  // fixed ones lie on one side
        model.opacity_logit[i] = i % 5 == 0 ? -8.0f : 0.0f;    // of both, some are dead
    }
    const Round after = run_round(model, 100, 5, fixed);
    ASSERT_EQ(after.model.size(), 500U);
    EXPECT_EQ(after.result.pruned, 80U);
    for (std::size_t i = 0; i < 500; ++i) {
        const bool was_fixed_and_lives = i < 400 && fixed[i] != 0 && i % 5 != 0;
        EXPECT_EQ(after.model.position[3 * i], was_fixed_and_lives ? -1.0f : 1.0f) << i;
        if (was_fixed_and_lives) {
            EXPECT_EQ(after.model.opacity_logit[i], 0.0f) << i;
        }
    }
}

// Opacities of exactly 1/2, so that the weights are those of the reference to the bit.
TEST(Relocation, a_round_moves_the_dead_grows_and_clears_the_moments_of_what_changed) {
    SplatModel model = population(500);
    std::uint32_t dead = 0;
    for (size_t i = 0; i < 500; ++i) {
        model.opacity_logit[i] = i % 5 == 3 ? -9.0f : 0.0f;
        dead += i % 5 == 3;
    }
    const Round round = run_round(model, 25);
    EXPECT_EQ(round.result.before, 500U);
    EXPECT_EQ(round.result.after, 525U);
    EXPECT_EQ(round.result.pruned, dead);
    EXPECT_EQ(round.result.grown, 25U);
    const double scale = 0.99 * 4'294'967'295.0 / 500;
    const auto weights =
        reference::relocation_weights(model.opacity_logit, double{kDead},
                                      double{static_cast<float>(std::min(scale, 16'777'216.0))});
    const auto plan = reference::relocation_plan(weights, 25, 5);
    ASSERT_EQ(round.model.size(), plan.sources.size());
    for (size_t i = 0; i < plan.sources.size(); ++i) {
        const auto [from, changed] = plan.sources[i];
        for (size_t c = 0; c < 3; ++c) {
            ASSERT_EQ(round.model.position[3 * i + c], model.position[3 * from + c]) << i;
            ASSERT_EQ(round.model.sh_dc[3 * i + c], model.sh_dc[3 * from + c]) << i;
        }
        const auto expected = reference::relocated(
            model.kernel, model.footprint, model.opacity_logit[from], plan.copies[from] + 1);
        ASSERT_NEAR(round.model.opacity_logit[i], changed ? expected.opacity_logit : 0, 1e-4) << i;
        ASSERT_NEAR(round.model.log_scale[3 * i] - model.log_scale[3 * from],
                    changed ? expected.log_factor : 0, 4e-3);
        for (int a = 0; a < kAttributeCount; ++a) {
            if (round.moments[a].empty()) continue;
            ASSERT_EQ(round.moments[a][round.moments[a].size() / 525 * i], changed ? 0 : 1) << i;
        }
    }
}

TEST(Relocation, a_round_repeats_with_its_seed_and_differs_with_another) {
    const SplatModel model = population(400);
    const Round one = run_round(model, 20, 8), same = run_round(model, 20, 8),
                other = run_round(model, 20, 9);
    EXPECT_EQ(one.model.position, same.model.position);
    EXPECT_EQ(one.model.opacity_logit, same.model.opacity_logit);
    EXPECT_NE(one.model.position, other.model.position);
}

TEST(Relocation, without_a_live_splat_or_without_work_nothing_happens) {
    SplatModel model = population(50);
    model.opacity_logit.assign(50, -9.0f);
    EXPECT_EQ(run_round(model, 5).model.opacity_logit, model.opacity_logit);
    model.opacity_logit.assign(50, 0.0f);
    const Round idle = run_round(model, 0);
    EXPECT_EQ(idle.model.log_scale, model.log_scale);
    EXPECT_EQ(idle.moments[kOpacityLogit], std::vector<float>(100, 1.0f));
    model.resize(0);
    EXPECT_EQ(run_round(model, 5).model.size(), 0U);
}

double sum_of(const Image<double>& image) {
    double sum = 0;
    for (const double value : image.data) sum += value;
    return sum;
}

double sum_of_differences(const Image<double>& a, const Image<double>& b) {
    double sum = 0;
    for (size_t i = 0; i < a.data.size(); ++i) sum += std::abs(a.data[i] - b.data[i]);
    return sum;
}

/// The middle row, through the centre of the splat.
double line(const Image<double>& image) {
    double sum = 0;
    const size_t row = static_cast<size_t>(image.height / 2) * static_cast<size_t>(image.width) * 3;
    for (size_t x = 0; x < static_cast<size_t>(image.width); ++x) sum += image.data[row + 3 * x];
    return sum;
}

class RelocationPicture : public testing::TestWithParam<std::pair<int, Footprint>> {};

// One splat with opacity 1/2 and two dead ones become three in its place. The law preserves the
// integral along a line through the centre. The picture as a whole changes by a few per cent (less
// than a quarter of what copies that are not adapted change).
TEST_P(RelocationPicture, stays_when_three_take_the_place_of_one) {
    const auto [kernel, footprint] = GetParam();
    TestScene scene = random_scene({.count = 3, .sh_degree = 0, .seed = 2});
    Camera& camera = scene.camera;
    camera.width = camera.height = 129;
    camera.fx = camera.fy = 100;
    camera.cx = camera.cy = 64.5;
    camera.rotation = glm::dmat3(1.0);
    camera.translation = glm::dvec3(0.0);
    SplatModel& model = scene.model;
    model.kernel = kernel;
    model.footprint = footprint;
    for (size_t i = 0; i < 3; ++i) {
        for (size_t c = 0; c < 3; ++c) {
            model.position[3 * i + c] = c == 2 ? 4.0f : 0.0f;
            model.log_scale[3 * i + c] = -0.7f;  // 12 px: the low-pass is a thousandth of it
            model.sh_dc[3 * i + c] = 1.0f;
        }
        model.opacity_logit[i] = i == 0 ? 0.0f : -9.0f;
    }
    const Round round = run_round(model, 0);
    ASSERT_EQ(round.result.pruned, 2U);
    SplatModel copied = model;
    copied.opacity_logit.assign(3, 0.0f);
    const auto picture = [&](const SplatModel& m) {  // in double: the round alone is the device's
        return reference::render(m, camera, reference::RenderSettings{}).images.colour;
    };
    const Image<double> before = picture(model), after = picture(round.model),
                        naive = picture(copied);
    ASSERT_GT(sum_of(before), 100);
    // Each of three is cut off at 1/255 where one was at 3/255: up to 2 % of the line.
    EXPECT_NEAR(line(after) / line(before), 1, 0.025);
    EXPECT_LT(sum_of_differences(after, before), 0.25 * sum_of_differences(naive, before));
    EXPECT_LT(sum_of_differences(after, before), 0.16 * sum_of(before));
}

std::vector<std::pair<int, Footprint>> every_profile() {
    std::vector<std::pair<int, Footprint>> all;
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel) {
        all.emplace_back(kernel, Footprint::psi);
        if (kernel != KERNEL_GAUSSIAN) all.emplace_back(kernel, Footprint::exact);
    }
    return all;
}

INSTANTIATE_TEST_SUITE_P(every_kernel, RelocationPicture, testing::ValuesIn(every_profile()),
                         [](const auto& p) {
                             return fmt::format("{}_{}", kernel_name(p.param.first),
                                                footprint_name(p.param.second));
                         });

}  // namespace
}  // namespace darb::test
