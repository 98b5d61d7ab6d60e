// SPDX-License-Identifier: MIT
// Every gradient of the reference against central differences of its own forward walk, for every
// kernel and footprint, under random weights on colour, alpha, depth and its square. A parameter
// whose two renders blend a different set of samples sits on a cut-off: it is counted, and not
// compared.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "tests/support/compare_arrays.h"
#include "tests/support/every_kernel.h"
#include "tests/support/test_scene.h"
#include "tests/unit/reference/reference_scenes.h"

namespace darb::test {
namespace {

constexpr double kStep = 1e-6;
constexpr double kMaxBandRatio = 0.02;  // share of a scene's parameters

struct GradientCase {
    SceneOptions scene;
    RenderSettings settings;
    double logit_shift = 0;
};

class Differences {
  public:
    Differences(const Splats<double>& splats, const Camera& camera, const RenderSettings& settings)
        : splats_(splats),
          camera_(camera),
          settings_(settings),
          colour_weights_(random_weights(camera, 3, 11)),
          alpha_weights_(random_weights(camera, 1, 12)),
          depth_weights_(random_weights(camera, 2, 13)),
          result_(reference::render(splats, camera, settings)),
          gradients_(reference::backward(splats, camera, settings, result_, colour_weights_,
                                         alpha_weights_, depth_weights_)) {}

    const RenderResult& result() const { return result_; }
    const reference::Gradients& gradients() const { return gradients_; }
    size_t compared() const { return compared_; }

    /// One array of parameters, e.g. &Splats<double>::position.
    void check(const std::string& name, std::vector<double> Splats<double>::*parameters,
               const std::vector<double>& analytic, const Tolerance& allowed) {
        std::vector<double> expected, got;
        size_t band = 0;
        for (size_t i = 0; i < (splats_.*parameters).size(); ++i) {
            const double kept = (splats_.*parameters)[i];
            (splats_.*parameters)[i] = kept + kStep;
            const RenderResult above = reference::render(splats_, camera_, settings_);
            (splats_.*parameters)[i] = kept - kStep;
            const RenderResult below = reference::render(splats_, camera_, settings_);
            (splats_.*parameters)[i] = kept;
            if (above.images.contributions.data != below.images.contributions.data) {
                ++band;
                continue;
            }
            expected.push_back((loss(above) - loss(below)) / (2 * kStep));
            got.push_back(analytic[i]);
        }
        compared_ += got.size();
        EXPECT_LE(static_cast<double>(band),
                  kMaxBandRatio * static_cast<double>(analytic.size()) + 1)
            << name << ": too many parameters on a cut-off";
        EXPECT_TRUE(compare(name, expected, got, allowed));
    }

    void check_all(const std::string& name, const Tolerance& allowed) {
        const auto& d = gradients_.splats;
        check(name + " position", &Splats<double>::position, d.position, allowed);
        check(name + " log_scale", &Splats<double>::log_scale, d.log_scale, allowed);
        check(name + " rotation", &Splats<double>::rotation, d.rotation, allowed);
        check(name + " opacity", &Splats<double>::opacity_logit, d.opacity_logit, allowed);
        check(name + " sh_dc", &Splats<double>::sh_dc, d.sh_dc, allowed);
        if (!splats_.shape.empty()) {
            check(name + " shape", &Splats<double>::shape, d.shape, allowed);
        }
        if (splats_.rest_count() > 0) {
            check(name + " sh_rest", &Splats<double>::sh_rest, d.sh_rest, allowed);
        }
    }

  private:
    double loss(const RenderResult& result) const {
        double sum = weighted_sum(result.images.colour, colour_weights_);
        for (size_t i = 0; i < alpha_weights_.data.size(); ++i) {
            sum += (1 - result.images.transmittance.data[i]) * alpha_weights_.data[i] +
                   result.images.depth.data[i] * depth_weights_.data[2 * i] +
                   result.images.square.data[i] * depth_weights_.data[2 * i + 1];
        }
        return sum;
    }

    Splats<double> splats_;
    Camera camera_;
    RenderSettings settings_;
    Image<double> colour_weights_, alpha_weights_, depth_weights_;
    RenderResult result_;
    reference::Gradients gradients_;
    size_t compared_ = 0;
};

Differences differences_of(const GradientCase& c) {
    const TestScene scene = random_scene(c.scene);
    Splats<double> splats = reference::make_splats<double>(scene.model);
    for (double& logit : splats.opacity_logit) {
        logit += c.logit_shift;
    }
    return {splats, scene.camera, c.settings};
}

std::string case_name(const SceneOptions& scene) {
    return fmt::format("{} {} seed {}", kernel_name(scene.kernel), footprint_name(scene.footprint),
                       scene.seed);
}

class EveryKernel : public testing::TestWithParam<std::tuple<int, Footprint>> {
  protected:
    GradientCase base() const {
        GradientCase c;
        std::tie(c.scene.kernel, c.scene.footprint) = GetParam();
        c.scene.count = 12;
        c.settings.threads = 1;
        c.settings.background[0] = 0.3;
        c.settings.background[2] = -0.2;
        return c;
    }
};

TEST_P(EveryKernel, AllParameters_MatchDifferences) {
    GradientCase c = base();
    // The slope of the exact footprints of the kernels with a jump grows without bound towards the
    // edge, and so does the error of the difference: a larger cut-off keeps away from it.
    c.settings.alpha_cutoff = c.scene.footprint == Footprint::exact ? 0.02 : 1.0 / 255;
    for (const std::uint64_t seed : {1, 2}) {
        c.scene.seed = seed;
        Differences differences = differences_of(c);
        ASSERT_GT(differences.result().visible_count(), 6U);
        differences.check_all(case_name(c.scene), tolerance("difference"));
        EXPECT_GT(differences.compared(), 12U * 59U * 97U / 100U);
    }
}

TEST_P(EveryKernel, Antialiased_MatchesDifferences) {
    GradientCase c = base();
    c.scene.antialias = true;
    c.scene.sh_degree = 0;
    c.scene.min_log_scale = -4;  // about the low-pass and below
    c.scene.max_log_scale = -2.5;
    c.settings.alpha_cutoff = 0.02;
    Differences differences = differences_of(c);
    ASSERT_GT(differences.result().visible_count(), 3U);
    differences.check_all(case_name(c.scene) + " antialias", tolerance("difference"));
}

INSTANTIATE_TEST_SUITE_P(Reference, EveryKernel,
                         testing::Combine(testing::Range(0, KERNEL_COUNT),
                                          testing::Values(Footprint::psi, Footprint::exact)),
                         [](const auto& i) {
                             return std::string(kernel_name(std::get<0>(i.param))) + "_" +
                                    std::string(footprint_name(std::get<1>(i.param)));
                         });

INSTANTIATE_TEST_SUITE_P(Shaped, EveryKernel,
                         testing::Combine(testing::Values(KERNEL_BETA),
                                          testing::Values(Footprint::psi, Footprint::exact)),
                         [](const auto& i) {
                             return std::string(footprint_name(std::get<1>(i.param)));
                         });

INSTANTIATE_TEST_SUITE_P(Exponential, EveryKernel,
                         testing::Combine(testing::Values(KERNEL_GENERALIZED_EXPONENTIAL,
                                                          KERNEL_GES_PUBLISHED),
                                          testing::Values(Footprint::psi)));

INSTANTIATE_TEST_SUITE_P(Blend, EveryKernel,
                         testing::Combine(testing::Values(kSmoothBlend),
                                          testing::Values(Footprint::psi, Footprint::exact)),
                         [](const auto& i) {
                             return std::string(footprint_name(std::get<1>(i.param)));
                         });

class EveryRing : public EveryKernel {};

TEST_P(EveryRing, Parameters_MatchDifferences) {
    GradientCase c = base();
    c.scene.count = 6;
    c.scene.sh_degree = 0;
    Differences differences = differences_of(c);
    ASSERT_GT(differences.result().visible_count(), 3U);
    differences.check_all(case_name(c.scene), tolerance("difference"));
}

INSTANTIATE_TEST_SUITE_P(Reference, EveryRing,
                         testing::Combine(testing::Range(KERNEL_COUNT, KERNEL_BETA),
                                          testing::Values(Footprint::psi)),
                         [](const auto& i) {
                             return std::string(kernel_name(std::get<0>(i.param)));
                         });

TEST(ReferenceGradient, OpaqueLayers_MatchDifferencesThroughClampAndStop) {
    GradientCase c;
    c.scene = {.count = 20, .kernel = KERNEL_HALF_COSINE_SQUARED, .sh_degree = 1, .seed = 5};
    c.scene.min_log_scale = -1.5;
    c.scene.max_log_scale = 0;
    c.logit_shift = 6;
    c.settings.threads = 1;
    Differences differences = differences_of(c);
    int stopped = 0;
    for (const double transmittance : differences.result().images.transmittance.data) {
        stopped += transmittance < 0.01 ? 1 : 0;
    }
    ASSERT_GT(stopped, 50) << "the scene is meant to be opaque";
    differences.check_all("opaque", tolerance("difference_banded"));
}

TEST(ReferenceGradient, LowerActiveDegree_LeavesHigherBandsAtZero) {
    GradientCase c;
    c.scene.sh_degree = 3;
    c.settings.sh_degree = 1;
    c.settings.threads = 1;
    Differences differences = differences_of(c);
    differences.check_all("active degree 1", tolerance("difference"));
    const auto& d_rest = differences.gradients().splats.sh_rest;
    double low = 0;
    for (size_t i = 0; i < d_rest.size(); ++i) {
        if (i % 45 >= 9) {
            EXPECT_EQ(d_rest[i], 0) << "index " << i;
        } else {
            low += std::abs(d_rest[i]);
        }
    }
    EXPECT_GT(low, 0);
}

TEST(ReferenceGradient, Background_IsTheSumOfWeightedTransmittance) {
    const TestScene scene = random_scene();
    RenderSettings settings;
    const Image<double> weights = random_weights(scene.camera, 3, 3);
    const RenderResult result = reference::render(scene.model, scene.camera, settings);
    const auto gradients =
        reference::backward(scene.model, scene.camera, settings, result, weights);
    for (int c = 0; c < 3; ++c) {
        settings.background[c] = 0.5;  // the image is linear in it
        const double above = weighted_sum(
            reference::render(scene.model, scene.camera, settings).images.colour, weights);
        settings.background[c] = 0;
        const double below = weighted_sum(
            reference::render(scene.model, scene.camera, settings).images.colour, weights);
        EXPECT_NEAR(gradients.background[c], (above - below) / 0.5, 1e-11) << "channel " << c;
    }
}

TEST(ReferenceGradient, MeanGradientNdc_ScalesPixelsByHalfTheImage) {
    const TestScene scene = random_scene();
    const Image<double> weights = random_weights(scene.camera, 3, 3);
    const RenderResult result = reference::render(scene.model, scene.camera, {});
    const auto gradients = reference::backward(scene.model, scene.camera, {}, result, weights);
    for (size_t i = 0; i < scene.model.size(); ++i) {
        const auto d = gradients.projected[i].d_mean_px;
        EXPECT_DOUBLE_EQ(gradients.mean_gradient_ndc[i],
                         std::sqrt(d.x * 16 * d.x * 16 + d.y * 12 * d.y * 12))
            << "splat " << i;
    }
}

}  // namespace
}  // namespace darb::test
