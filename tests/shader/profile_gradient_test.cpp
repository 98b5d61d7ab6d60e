// SPDX-License-Identifier: MIT
// profile_gradient.comp and profile_sums.comp alone against the reference, and the reference's
// gradient of a profile against its own central differences.
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/learned_profile.h"
#include "tests/support/blend_scene.h"
#include "tests/support/compare_arrays.h"

namespace darb::test {
namespace {

/// A profile away from any start.
LearnedProfile some_profile() {
    LearnedProfile profile(KERNEL_RAISED_COSINE);
    profile.set_logits({-1.5f, -2, -3, -1, -0.4f, 0});
    return profile;
}

struct Loss {
    Image<double> colour, alpha, depth;  // dL/d(image)
    std::vector<float> planes;
};

Loss some_loss(const BlendScene& scene) {
    Loss loss{Image<double>(scene.width, scene.height, 3), {}, {}, {}};
    const size_t pixels = size_t(scene.width) * scene.height;
    loss.planes.resize(3 * pixels);
    Pcg32 rng(23);
    for (size_t i = 0; i < pixels; ++i)
        for (size_t c = 0; c < 3; ++c)
            loss.colour.data[3 * i + c] = loss.planes[c * pixels + i] =
                static_cast<float>(rng.uniform(-1, 1));
    for (Image<double>* plane : {&loss.alpha, &loss.depth}) {
        if (!scene.depth_sum) continue;
        *plane = Image<double>(scene.width, scene.height, 1);
        for (double& d : plane->data) {
            loss.planes.push_back(static_cast<float>(rng.uniform(-1, 1)));
            d = loss.planes.back();
        }
    }
    return loss;
}

std::vector<double> sums_in_double(const BlendScene& scene, const Loss& loss) {
    std::vector<double> sums(PROFILE_SUMS, 0.0);
    const reference::TileLists lists = scene.lists();
    for (size_t t = 0; t < lists.tile_count(); ++t)
        reference::add_tile_profile<double>(lists, t, scene.splats, scene.table(), scene.settings(),
                                            {loss.colour, loss.alpha, loss.depth},
                                            {kernel_support(scene.kernel), sums});
    return sums;
}

/// Both passes, twice in a row, so that the second adds to the first; overflow: of the frame.
std::vector<float> sums_on_device(const BlendScene& scene, const Loss& loss,
                                  std::uint32_t overflow = 0) {
    Device& device = shared_device();
    const reference::TileLists lists = scene.lists();
    const BlendOutput frame = blend_on_device(scene, lists);
    const ShuffledIntersections shuffled(scene, lists, false);
    std::vector<glm::vec4> shape, light, bound;
    for (const auto& s : scene.splats) {
        shape.emplace_back(s.mean_px.x, s.mean_px.y, s.l11, s.l21);
        light.emplace_back(s.colour.x, s.colour.y, s.colour.z, s.opacity);
        bound.emplace_back(s.l22, s.reach * (1 + 1e-5), s.depth, 0.0);
    }
    SpecConstants constants = kernel_constants(scene.kernel, scene.footprint);
    const std::uint32_t subgroup = add_block_constants(device, constants);
    constants["THREADS"] = static_cast<std::int32_t>(subgroup);
    constants["SEGMENT"] = static_cast<std::int32_t>(scene.segment);
    constants["DEPTH_SUM"] = constants["ALPHA_GRADIENT"] = scene.depth_sum ? 1 : 0;
    const Pipeline gradient(device, "profile_gradient", for_several_passes(constants), true,
                            subgroup);
    const Pipeline add(device, "profile_sums", {}, false);
    gpu::FrameStatus status{};
    status.overflow = overflow;
    const auto rows_count = static_cast<std::uint32_t>(lists.tile_count());
    const size_t pixels = size_t(scene.width) * scene.height;
    const GuardedBuffer ranges(device, "tile range", shuffled.ranges),
        order(device, "intersection from sorted", shuffled.order),
        splats(device, "splat from intersection", shuffled.splat_from_intersection),
        shapes(device, "shape", shape), lights(device, "light", light),
        bounds(device, "bound", bound), d_image(device, "d_image", loss.planes),
        final_t(device, "final T", frame.transmittance),
        state(device, "state", frame.transmittance), last(device, "last", frame.last),
        rows(device, "rows", std::vector<float>(size_t{rows_count} * PROFILE_SUMS, NAN)),
        behind(device, "behind", std::vector<float>(scene.segment > 0 ? pixels : 1, NAN)),
        statuses(device, "status", std::vector{status}),
        sums(device, "sums", std::vector<float>(PROFILE_SUMS, 0.0f));
    std::uint32_t longest = 0;
    for (const glm::uvec2& r : shuffled.ranges) longest = std::max(longest, r.y - r.x);
    gpu::BlendArgs args{static_cast<std::uint32_t>(scene.width),
                        static_cast<std::uint32_t>(scene.height),
                        static_cast<std::uint32_t>(lists.tiles_x),
                        scene.background.r,
                        scene.background.g,
                        scene.background.b,
                        0,
                        scene.segment > 0 ? longest / scene.segment + 1 : 1};
    Commands commands(device);
    commands.begin();
    for (int frame_number = 0; frame_number < 2; ++frame_number) {
        commands.copy(final_t, state, pixels * 4);
        for (args.segment = args.segments; args.segment-- > 0;)
            commands.dispatch(
                gradient, args,
                {ranges, order, splats, shapes, lights, bounds, d_image, state, last, rows, behind},
                static_cast<std::uint32_t>(lists.tiles_x),
                static_cast<std::uint32_t>(lists.tiles_y));
        commands.dispatch(add, gpu::ProfileSumArgs{rows_count}, {rows, statuses, sums}, 1);
    }
    commands.submit_and_wait();
    for (const GuardedBuffer* buffer : {&ranges, &order, &splats, &d_image, &final_t, &last, &rows,
                                        &state, &behind, &statuses, &sums})
        EXPECT_TRUE(buffer->intact());
    return sums.read<float>();
}

BlendScene scene_of(int kernel, Footprint footprint) {
    BlendScene scene = BlendVariant{kernel, footprint}.scene(53, 37);
    return scene;
}

TEST(ProfileGradient, sums_match_double_for_both_footprints_segments_and_depths) {
    const int kernel = register_kernel(some_profile().definition());
    for (const Footprint footprint : {Footprint::psi, Footprint::exact})
        for (const std::uint32_t segment : {0u, 128u})
            for (const bool depth_sum : {false, true}) {
                SCOPED_TRACE(fmt::format("{} segment {} depth {}", footprint_name(footprint),
                                         segment, depth_sum));
                BlendScene scene = scene_of(kernel, footprint);
                scene.segment = segment;
                scene.depth_sum = depth_sum;
                scene.add_random(900, 4, 0.01, 1);  // some beyond the clamp
                for (auto& s : scene.splats) s.depth = 1 + s.depth / 256;
                const Loss loss = some_loss(scene);
                std::vector<double> expected = sums_in_double(scene, loss);
                for (double& sum : expected) sum *= 2;  // two frames
                const std::vector<float> got = sums_on_device(scene, loss);
                EXPECT_TRUE(compare_scaled("sums", expected,
                                           std::vector<double>(got.begin(), got.end()),
                                           tolerance("gradient_scaled_float32")));
                EXPECT_EQ(sums_on_device(scene, loss), got) << "the same bits again";
            }
}

TEST(ProfileGradient, a_frame_that_overflowed_adds_nothing) {
    BlendScene scene = scene_of(register_kernel(some_profile().definition()), Footprint::psi);
    scene.add_random(50, 4, 0.1, 0.9);
    EXPECT_EQ(sums_on_device(scene, some_loss(scene), OVERFLOW_INTERSECTIONS),
              std::vector<float>(PROFILE_SUMS, 0.0f));
}

/// L = sum dL/d(image) image of the same splats with another profile. Nothing is cut off, as a
/// threshold has no derivative.
BlendScene smooth_scene(const LearnedProfile& profile, Footprint footprint) {
    BlendScene scene = scene_of(register_kernel(profile.definition()), footprint);
    scene.cutoff = 1e-12f;
    scene.stop = 1e-12f;
    scene.add_random(40, 9, 0.05, 0.8);
    return scene;
}

double value_of_loss(const BlendScene& scene, const Loss& loss) {
    const auto images = blend_in_double(scene, scene.lists());
    double sum = 0;
    for (size_t i = 0; i < images.colour.data.size(); ++i)
        sum += images.colour.data[i] * loss.colour.data[i];
    return sum;
}

TEST(ProfileGradient, of_the_reference_is_that_of_central_differences) {
    constexpr float kStep = 1.0f / 256;
    const LearnedProfile profile = some_profile();
    for (const Footprint footprint : {Footprint::psi, Footprint::exact}) {
        const BlendScene scene = smooth_scene(profile, footprint);
        const Loss loss = some_loss(scene);
        const std::vector<double> sums = sums_in_double(scene, loss);
        const auto got = profile.gradient(footprint, std::vector<float>(sums.begin(), sums.end()));
        for (size_t j = 0; j < got.size(); ++j) {
            const auto at = [&](float step) {
                LearnedProfile moved = profile;
                auto logits = profile.logits();
                logits[j] += step;
                moved.set_logits(logits);
                return value_of_loss(smooth_scene(moved, footprint), loss);
            };
            const double difference = (at(kStep) - at(-kStep)) / (2 * kStep);
            EXPECT_NEAR(got[j], difference, 1e-3 * (1 + std::abs(difference)))
                << footprint_name(footprint) << " " << j;
        }
    }
}

}  // namespace
}  // namespace darb::test
