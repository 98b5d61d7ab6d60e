// SPDX-License-Identifier: MIT
// Scenes with the kernel beta: which files keep each splat's shape and which refuse it, scenes of
// Deformable Beta Splatting, and the nearest Gaussians.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/reference/splats.h"
#include "engine/scene/dot_splat.h"
#include "engine/scene/merge_splats.h"
#include "engine/scene/ply.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/splat_model.h"
#include "shaders/shared/kernel_forms.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

SplatModel shaped_scene(Footprint footprint = Footprint::psi) {
    return reference::random_scene(
               {.count = 40, .kernel = KERNEL_BETA, .footprint = footprint, .sh_degree = 1})
        .model;
}

TEST(ShapedScene, ply_keeps_kernel_and_shapes) {
    for (const Footprint footprint : {Footprint::psi, Footprint::exact}) {
        const SplatModel model = shaped_scene(footprint);
        const SplatModel read = parse_ply(encode_ply(model), "memory");
        EXPECT_EQ(read.kernel, KERNEL_BETA);
        EXPECT_EQ(read.footprint, footprint);
        EXPECT_EQ(read.shape, model.shape);
        EXPECT_EQ(read.sh_rest, model.sh_rest);
    }
}

TEST(ShapedScene, set_kernel_gives_and_takes_shapes) {
    SplatModel model = reference::random_scene({.count = 3}).model;
    EXPECT_TRUE(model.shape.empty());
    set_kernel(model, KERNEL_BETA);
    EXPECT_EQ(model.shape, std::vector<float>(3, 0.0f));
    EXPECT_NO_THROW(check_splat_shapes(model));
    set_kernel(model, KERNEL_SINC);
    EXPECT_TRUE(model.shape.empty());
    model.kernel = KERNEL_BETA;  // without set_kernel
    EXPECT_THROW(check_splat_shapes(model), Error);
}

TEST(ShapedScene, a_shape_of_another_kernel_is_not_kept) {
    SplatModel model = shaped_scene();
    std::vector<std::byte> file = encode_ply(model);
    const std::string name = "SplatKernel: beta", other = "SplatKernel: sinc";
    const auto at = std::search(file.begin(), file.end(), name.begin(), name.end(),
                                [](std::byte a, char b) { return a == std::byte(b); });
    ASSERT_NE(at, file.end());
    std::transform(other.begin(), other.end(), at, [](char c) { return std::byte(c); });
    PlyFacts facts;
    const SplatModel read = parse_ply(file, "memory", &facts);
    EXPECT_EQ(read.kernel, KERNEL_SINC);
    EXPECT_TRUE(read.shape.empty());
    ASSERT_FALSE(facts.notes.empty());
    EXPECT_NE(facts.notes.back().find("shape"), std::string::npos) << facts.notes.back();
}

TEST(ShapedScene, a_file_of_the_kernel_without_shapes_gets_those_of_the_start_and_says_so) {
    SplatModel model = reference::random_scene({.count = 40, .kernel = KERNEL_SINC}).model;
    for (const SplatFormat format : {SplatFormat::ply, SplatFormat::compressed_ply}) {
        std::vector<std::byte> file = encode_splats(format, model, "memory");
        const std::string name = "SplatKernel: sinc", other = "SplatKernel: beta";
        const auto at = std::search(file.begin(), file.end(), name.begin(), name.end(),
                                    [](std::byte a, char b) { return a == std::byte(b); });
        ASSERT_NE(at, file.end());
        std::transform(other.begin(), other.end(), at, [](char c) { return std::byte(c); });
        SplatFile said;
        const SplatModel read = parse_splats(file, "memory.ply", &said);
        EXPECT_EQ(read.shape, std::vector<float>(read.size(), 0.0f));
        EXPECT_NO_THROW(as_gaussians(read, false, nullptr));
        EXPECT_TRUE(std::ranges::any_of(said.notes, [](const std::string& note) {
            return note.find("takes a shape of each splat") != std::string::npos;
        }));
    }
}

TEST(ShapedScene, formats_without_a_place_refuse_and_name_the_remedy) {
    const SplatModel model = shaped_scene();
    for (const char* name : {"a.compressed.ply", "a.spz", "a.sog", "a.splat", "a.glb"}) {
        const auto format = format_to_write(name);
        ASSERT_TRUE(format) << name;
        try {
            encode_splats(*format, model, name);
            ADD_FAILURE() << name << " was written";
        } catch (const Error& e) {
            EXPECT_NE(e.reason.find("shape"), std::string::npos) << e.reason;
            EXPECT_NE(e.hint.find("--kernel gaussian"), std::string::npos) << e.hint;
        }
        EXPECT_NO_THROW(encode_splats(*format, as_gaussians(model, false), name)) << name;
    }
}

// A splat of Deformable Beta Splatting, (1 - d^2)^b with b = 4 exp(beta), is drawn with that
// profile.
TEST(ShapedScene, scenes_of_deformable_beta_splatting_are_read) {
    const std::string header =
        "ply\nformat ascii 1.0\nelement vertex 3\n"
        "property float x\nproperty float y\nproperty float z\n"
        "property float sh0_0\nproperty float sh0_1\nproperty float sh0_2\n"
        "property float sb_params_0\nproperty float sb_params_1\n"
        "property float opacity\nproperty float beta\n"
        "property float scale_0\nproperty float scale_1\nproperty float scale_2\n"
        "property float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3\n"
        "end_header\n";
    const std::string rows =
        "0 0 1 0.1 0.2 0.3 7 8 0.5 0 -1 -2 -3 1 0 0 0\n"
        "1 0 1 0.1 0.2 0.3 7 8 0.5 0.7 -1 -2 -3 1 0 0 0\n"
        "2 0 1 0.1 0.2 0.3 7 8 0.5 -5 -1 -2 -3 1 0 0 0\n";
    FileBytes bytes;
    append_text(header + rows, bytes);
    SplatFile file;
    const SplatModel model = parse_splats(bytes, "theirs", &file);
    ASSERT_EQ(model.size(), 3u);
    EXPECT_EQ(model.kernel, KERNEL_BETA);
    EXPECT_EQ(model.footprint, Footprint::exact);
    EXPECT_EQ(model.sh_dc[1], 0.2f);
    for (std::size_t i = 0; i < 2; ++i) {
        const double b = 4 * std::exp(i == 0 ? 0 : 0.7), theirs_scale = std::exp(-2.0);
        const double ours_scale = std::exp(double{model.log_scale[3 * i + 1]});
        const double exponent = beta_kernel().exponent(model.footprint, double{model.shape[i]});
        for (double x = 0; x < theirs_scale; x += 0.011) {  // along an axis, in the world
            const double d = x / theirs_scale, q = std::pow(x / ours_scale, 2);
            EXPECT_NEAR(beta_kernel().value(model.footprint, exponent, q).w, std::pow(1 - d * d, b),
                        2e-6)
                << x;
        }
    }
    EXPECT_NEAR(beta_kernel().exponent(model.footprint, double{model.shape[2]}),
                BETA_EXPONENT_LEAST, 1e-5);
    std::string notes;
    for (const std::string& note : file.notes) notes += note + "\n";
    EXPECT_NE(notes.find("Deformable Beta Splatting"), std::string::npos) << notes;
    EXPECT_NE(notes.find("1 of its exponents"), std::string::npos) << notes;
    EXPECT_NE(notes.find("sb_params"), std::string::npos) << notes;
    EXPECT_EQ(notes.find("sb_params_0"), std::string::npos) << notes;
    for (std::size_t cut = 0; cut < bytes.size(); ++cut)  // at every byte
        try {
            parse_splats(std::span(bytes).first(cut), "cut");
        } catch (const Error&) {
        }
}

TEST(ShapedScene, gaussians_of_ges_published_are_what_it_draws) {
    SplatModel model = shaped_scene(Footprint::psi);
    set_kernel(model, KERNEL_GES_PUBLISHED);
    GaussianEquivalent fit{};
    const SplatModel gaussians = as_gaussians(model, false, &fit);
    EXPECT_LT(fit.error, 1e-4);
    for (std::size_t i = 0; i < model.size(); ++i) {
        const double f = 2 / (1 + std::exp(-0.1 * double{model.shape[i]}));
        EXPECT_NEAR(gaussians.log_scale[3 * i] - model.log_scale[3 * i], std::log(f), 1e-5);
        const float logit = std::min(model.opacity_logit[i], 4.0f);  // opacities near 1 are limited
        EXPECT_NEAR(std::min(gaussians.opacity_logit[i], 4.0f), logit, 1e-3);
    }
}

TEST(ShapedScene, gaussians_follow_each_splats_shape) {
    SplatModel model = shaped_scene(Footprint::exact);
    GaussianEquivalent fit{};
    const SplatModel gaussians = as_gaussians(model, false, &fit);
    EXPECT_EQ(gaussians.kernel, KERNEL_GAUSSIAN);
    EXPECT_TRUE(gaussians.shape.empty());
    EXPECT_GT(fit.error, 0.01);
    EXPECT_LT(fit.error, 0.3);
    for (std::size_t i = 0; i < model.size(); ++i) {
        const double e = beta_kernel().exponent(model.footprint, double{model.shape[i]});
        const GaussianEquivalent own = beta_kernel().gaussian(model.footprint, e, false);
        EXPECT_NEAR(2 * (gaussians.log_scale[3 * i] - model.log_scale[3 * i]),
                    std::log(own.covariance), 0.01)
            << model.shape[i];
    }
}

TEST(ShapedScene, merging_keeps_the_width_and_what_is_merged_starts_anew) {
    SplatModel model = shaped_scene();
    model.position.assign(model.position.size(), 0.0f);
    model.rotation.assign(model.rotation.size(), 0.0f);
    for (std::size_t i = 0; i < model.size(); ++i) model.rotation[4 * i] = 1;
    model.log_scale.assign(model.log_scale.size(), -2.0f);
    model.shape.assign(model.size(), 1.5f);
    model.opacity_logit.assign(model.size(), -6.0f);  // nothing saturates
    const SplatModel one = merge_splats(model, 1);
    ASSERT_EQ(one.size(), 1u);
    ASSERT_EQ(one.shape, std::vector<float>(1, 0.0f));
    const auto moment = [](double shape) {
        return beta_kernel().second_moment(Footprint::psi,
                                           beta_kernel().exponent(Footprint::psi, shape));
    };
    const double merged = std::exp(2.0 * one.log_scale[0]) * moment(0);
    EXPECT_NEAR(merged / (std::exp(-4.0) * moment(1.5)), 1, 1e-3);
}

}  // namespace
}  // namespace darb::test
