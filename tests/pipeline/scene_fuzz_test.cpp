// SPDX-License-Identifier: MIT
// Random scenes with poison among their splats, through the whole walk: NaN, infinities, denormals
// and numbers whose square overflows, in any parameter. No crash, no value that is not finite, no
// message of the validation layers, and what is culled changes no bit of the others' image and
// gradients. DARB_FUZZ_SECONDS: how long, in place of some scenes; DARB_FUZZ_SEED: the first, to
// repeat one.
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "engine/check/device_walk.h"
#include "engine/core/rng.h"
#include "engine/scene/edit_splats.h"
#include "tests/support/test_walk.h"

namespace darb::test {
namespace {

constexpr int kScenes = 10;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kValues[] = {std::numeric_limits<float>::quiet_NaN(),
                             kInfinity,
                             -kInfinity,
                             std::numeric_limits<float>::max(),
                             1e38f,
                             -1e38f,
                             1e29f,
                             1e19f,
                             -1e19f,
                             1e5f,
                             -1e5f,
                             50,
                             -50,
                             1e-20f,
                             1e-39f,
                             std::numeric_limits<float>::denorm_min(),
                             -0.0f};

constexpr int kOrders[] = {DEPTH_ORDER_CENTRE, DEPTH_ORDER_CENTRE, DEPTH_ORDER_CENTRE,
                           DEPTH_ORDER_CENTRE16, DEPTH_ORDER_PIXEL};

template <class T, size_t N>
T one_of(const T (&values)[N], Pcg32& rng) {
    return values[rng.below(N)];
}

struct FuzzScene {
    TestScene scene;
    WalkSettings settings;
    bool gradient = true;
};

// One to four numbers of a splat become poison.
void poison(SplatModel& model, size_t splat, Pcg32& rng) {
    for (std::uint32_t left = 1 + rng.below(4); left > 0; --left) {
        std::vector<float>& values =
            attribute_values(model, static_cast<int>(rng.below(kAttributeCount)));
        const size_t stride = values.size() / model.size();
        if (stride == 0) continue;  // no harmonics
        values[splat * stride + rng.below(static_cast<std::uint32_t>(stride))] =
            one_of(kValues, rng);
    }
}

FuzzScene fuzz_scene(std::uint64_t seed) {
    Pcg32 rng(seed, 77);
    const int sizes[] = {1, 3, 15, 16, 17, 33, 64, 97};
    FuzzScene f;
    f.scene = random_scene({.count = rng.below(150),
                            .width = one_of(sizes, rng),
                            .height = one_of(sizes, rng),
                            .kernel = static_cast<int>(rng.below(KERNEL_COUNT)),
                            .footprint = rng.below(2) ? Footprint::psi : Footprint::exact,
                            .sh_degree = static_cast<int>(rng.below(4)),
                            .antialias = rng.below(4) == 0,
                            .min_log_scale = rng.uniform(-20, -2),
                            .max_log_scale = rng.uniform(-2, 1),
                            .min_logit = rng.uniform(-8, 0),
                            .max_logit = rng.uniform(0, 12),
                            .seed = seed});
    Camera& camera = f.scene.camera;
    camera.translation.z *= rng.uniform(0, 1.5);  // from within the splats to far away
    camera.fx *= std::exp(rng.uniform(-1, 3));
    camera.fy = camera.fx * rng.uniform(0.5, 2);
    const double share = rng.uniform();
    for (size_t i = 0; i < f.scene.model.size(); ++i)
        if (rng.uniform() < share) poison(f.scene.model, i, rng);
    f.settings.evaluation = rng.below(2) ? EVALUATION_POLYNOMIAL : EVALUATION_BUILTIN;
    f.settings.polynomial_degree = static_cast<int>(2 + rng.below(4));
    f.settings.storage = rng.below(4) == 0 ? STORAGE_FLOAT16 : STORAGE_FLOAT32;
    f.settings.sh_degree = static_cast<int>(rng.below(4));
    f.settings.intersections = 1 + rng.below(2000);  // often too few at first
    f.settings.depth_order = one_of(kOrders, rng);
    f.gradient = f.settings.depth_order != DEPTH_ORDER_PIXEL;
    return f;
}

size_t not_finite(const std::vector<float>& values) {
    size_t count = 0;
    for (const float v : values) count += std::isfinite(v) ? 0 : 1;
    return count;
}

// The rows of the kept splats, in order.
std::vector<float> rows_of(const std::vector<float>& values,
                           const std::vector<std::uint32_t>& intersections) {
    std::vector<float> rows;
    const size_t stride = intersections.empty() ? 0 : values.size() / intersections.size();
    for (size_t i = 0; i < intersections.size(); ++i)
        if (intersections[i] > 0)
            rows.insert(rows.end(), values.begin() + static_cast<std::ptrdiff_t>(i * stride),
                        values.begin() + static_cast<std::ptrdiff_t>((i + 1) * stride));
    return rows;
}

/// Returns the splats that were seen.
size_t expect_sound(std::uint64_t seed) {
    SCOPED_TRACE(fmt::format("DARB_FUZZ_SEED={}", seed));
    const FuzzScene f = fuzz_scene(seed);
    const Image<double> weights =
        f.gradient ? check::random_weights(f.scene.camera) : Image<double>{};
    const DeviceWalk walk = walk_on_device(f.scene.model, f.scene.camera, weights, f.settings);
    EXPECT_EQ(not_finite(walk.image.data), 0U) << "pixels";
    for (int a = 0; a < kAttributeCount; ++a)
        EXPECT_EQ(not_finite(walk.d[a]), 0U) << "d_" << attribute_name(a);

    SplatModel seen = f.scene.model;
    keep_splats([&](size_t i) { return walk.intersection_count[i] > 0; }, seen);
    EXPECT_EQ(seen.size(), walk.status.visible);
    const DeviceWalk alone = walk_on_device(seen, f.scene.camera, weights, f.settings);
    EXPECT_EQ(alone.image.data, walk.image.data) << "culled splats change the picture";
    for (int a = 0; a < kAttributeCount; ++a)
        EXPECT_EQ(alone.d[a], rows_of(walk.d[a], walk.intersection_count))
            << "culled splats change d_" << attribute_name(a);
    return seen.size();
}

TEST(SceneFuzz, poison_harms_nobody) {
    const char* first = std::getenv("DARB_FUZZ_SEED");
    const char* limit = std::getenv("DARB_FUZZ_SECONDS");
    std::uint64_t seed = first ? std::strtoull(first, nullptr, 10) : 1;
    const double seconds = limit ? std::strtod(limit, nullptr) : 0;
    const auto start = std::chrono::steady_clock::now();
    size_t scenes = 0, seen = 0;
    const auto more = [&] {
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
        return limit ? taken.count() < seconds : scenes < (first ? 1 : kScenes);
    };
    for (; more() && !HasFailure(); ++scenes) seen += expect_sound(seed++);
    if (!first) {
        EXPECT_GT(seen, scenes) << "nearly nothing was visible";
    }
    fmt::print("{} scenes, {} visible splats\n", scenes, seen);
    RecordProperty("scenes", static_cast<int>(scenes));
}

}  // namespace
}  // namespace darb::test
