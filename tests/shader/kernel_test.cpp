// SPDX-License-Identifier: MIT
// shaders/kernels on the device, through kernel_probe, against engine/kernels in double and against
// the reference vectors: every kernel, footprint, evaluation and degree.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/raster/kernel_constants.h"
#include "shaders/shared/kernel_forms.h"
#include "shaders/shared/kernel_probe_args.h"
#include "tests/support/every_kernel.h"
#include "tests/support/kernel_vectors.h"
#include "tests/support/own_kernels.h"

namespace darb {
namespace {

constexpr double kCutoff = 1 / 255.0;
// By the letter of Vulkan, the built-in sin and cos may be off by 2^-11; no driver is that bad.
constexpr double kBuiltinRounding = 2e-5;

struct Variant {
    int kernel = 0;
    Footprint footprint = Footprint::psi;
    int evaluation = EVALUATION_POLYNOMIAL;
    int degree = kFullDegree;
    std::string name() const {
        return std::string(kernel_name(kernel)) + " " + std::string(footprint_name(footprint)) +
               (evaluation == EVALUATION_BUILTIN ? " builtin"
                                                 : " degree " + std::to_string(degree));
    }
    double value(double q) const { return kernel_value(kernel, footprint, q); }
    double slope(double q) const { return kernel_slope(kernel, footprint, q); }
    double support() const { return kernel_support(kernel); }
    double extent() const { return std::isfinite(support()) ? support() : 20; }
    /// The fit's own error of w, plus rounding.
    double value_tolerance() const {
        const auto& k = kernel_coefficients(kernel, footprint, degree);
        return evaluation == EVALUATION_BUILTIN ? kBuiltinRounding
                                                : 1.1 * k.value_error + float_rounding(k);
    }
};

struct Probe {
    float q, opacity;
};
struct Answer {
    float value, slope, reach, covariance_scale;
};

class KernelShader : public testing::Test {
  protected:
    static void SetUpTestSuite() { device_ = new Device; }
    static void TearDownTestSuite() {
        pipelines_.clear();
        delete device_;
        device_ = nullptr;
    }

    /// exponent: of a kernel with shapes.
    std::vector<Answer> run(const Variant& v, const std::vector<Probe>& probes,
                            float exponent = 0) {
        Pipeline& pipeline = pipelines_[v.name()];
        if (!pipeline)
            pipeline = Pipeline(*device_, "kernel_probe",
                                kernel_constants(v.kernel, v.footprint, v.evaluation, v.degree));
        Buffer input(*device_, "probes", probes.size() * sizeof(Probe));
        Buffer output(*device_, "answers", probes.size() * sizeof(Answer));
        input.upload(probes);
        Commands commands(*device_);
        commands.begin();
        const auto count = static_cast<std::uint32_t>(probes.size());
        commands.dispatch(pipeline, gpu::KernelProbeArgs{count, exponent}, {input, output},
                          (count + KERNEL_PROBE_GROUP - 1) / KERNEL_PROBE_GROUP);
        commands.submit_and_wait();
        return output.download<Answer>(probes.size());
    }

    template <class Check>
    void for_every_variant(Check check) {
        for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel)
            for (const Footprint f : {Footprint::psi, Footprint::exact}) {
                for (int degree = kLeastDegree; degree <= kFullDegree; ++degree)
                    check({kernel, f, EVALUATION_POLYNOMIAL, degree});
                check({kernel, f, EVALUATION_BUILTIN, kFullDegree});
            }
        for (const int own : test::own_kernels())
            for (const Footprint f : {Footprint::psi, Footprint::exact})
                check({own, f, EVALUATION_POLYNOMIAL, kFullDegree});
        for (int rings = KERNEL_COUNT; rings < KERNEL_BETA; ++rings)
            check({rings, Footprint::psi, EVALUATION_BUILTIN, kFullDegree});
    }

    static Device* device_;
    static std::map<std::string, Pipeline> pipelines_;  // by Variant::name
};
Device* KernelShader::device_ = nullptr;
std::map<std::string, Pipeline> KernelShader::pipelines_;

std::vector<Probe> ramp(const Variant& v, int count) {
    std::vector<Probe> probes;
    for (int i = 0; i < count; ++i)
        probes.push_back({static_cast<float>(v.extent() * i / count), 1});
    return probes;
}

TEST_F(KernelShader, Value_isThatOfDouble) {
    for_every_variant([&](const Variant& v) {
        const std::vector<Probe> probes = ramp(v, 4000);
        const std::vector<Answer> answers = run(v, probes);
        double worst = 0, at = 0;
        for (std::size_t i = 0; i < probes.size(); ++i) {
            const double error = std::abs(answers[i].value - v.value(probes[i].q));
            if (error <= worst) continue;
            worst = error;
            at = probes[i].q;
        }
        EXPECT_LE(worst, v.value_tolerance()) << v.name() << ", q = " << at;
        RecordProperty(v.name(), fmt::format("{:.2e}", worst));
    });
}

TEST_F(KernelShader, Slope_isThatOfDouble) {
    for_every_variant([&](const Variant& v) {
        const auto& k = kernel_coefficients(v.kernel, v.footprint, v.degree);
        const std::vector<Probe> probes = ramp(v, 2000);
        const std::vector<Answer> answers = run(v, probes);
        const double support = std::isfinite(v.support()) ? v.support() : 1;
        // Terms that cancel leave the rounding of the largest, as in float_rounding.
        const double rounding = v.evaluation == EVALUATION_BUILTIN
                                    ? 1e-4
                                    : 2e-6 * std::max(1.0, float_rounding(k) / 9e-7);
        for (std::size_t i = 0; i < probes.size(); ++i) {
            const double q = probes[i].q, truth = v.slope(q) * support;
            // Slopes that grow without bound at the edge matter only above the cut-off.
            if (v.value(q) < kCutoff) continue;
            const double steep = k.line_integral ? std::max(1.0, std::sqrt(1e-3 / (1 - q / 9))) : 1;
            ASSERT_NEAR(answers[i].slope * support, truth,
                        1.2 * k.slope_error * steep + rounding * (1 + std::abs(truth)))
                << v.name() << ", q = " << q;
        }
    });
}

TEST_F(KernelShader, CentreEdgeAndBeyond_areExact) {
    for_every_variant([&](const Variant& v) {
        const float edge = static_cast<float>(v.extent());
        const std::vector<Answer> answers =
            run(v, {{0, 1}, {edge, 1}, {std::nextafter(edge, 1e9f), 1}, {1e4f, 1}, {1e30f, 1}});
        const bool rounds = v.evaluation == EVALUATION_BUILTIN ||
                            kernel_profile(v.kernel).form == KERNEL_FORM_QUADRIC;
        const double rounding =
            float_rounding(kernel_coefficients(v.kernel, v.footprint, v.degree));
        EXPECT_NEAR(answers[0].value, 1, rounds ? rounding : 0) << v.name();
        EXPECT_TRUE(std::isfinite(answers[0].slope)) << v.name();
        for (std::size_t i = 1; i < answers.size(); ++i) {
            EXPECT_GE(answers[i].value, 0) << v.name() << " entry " << i;
            EXPECT_LE(answers[i].value, std::isfinite(v.support()) ? 0 : 1e-4) << v.name();
            EXPECT_LE(std::abs(answers[i].slope), std::isfinite(v.support()) ? 0 : 1e-4)
                << v.name();
        }
    });
}

TEST_F(KernelShader, Exponents_of_beta_areThoseOfDoubleFromCentreToEdgeAndBeyond) {
    for (const Footprint footprint : {Footprint::psi, Footprint::exact})
        for (const int evaluation : {EVALUATION_POLYNOMIAL, EVALUATION_BUILTIN})
            for (const double e : {BETA_EXPONENT_LEAST, 1.5, 4.0, 4.5, 20.0, BETA_EXPONENT_MOST}) {
                const Variant v{KERNEL_BETA, footprint, evaluation, kFullDegree};
                SCOPED_TRACE(fmt::format("{}, exponent {}", v.name(), e));
                std::vector<Probe> probes = ramp(v, 500);
                const auto edge = static_cast<float>(BETA_SUPPORT);
                for (const float q : {edge, std::nextafter(edge, 20.0f), 1e4f, 1e30f})
                    probes.push_back({q, 1});
                for (Probe& p : probes) p.opacity = 0.5f;
                const std::vector<Answer> got = run(v, probes, static_cast<float>(e));
                EXPECT_NEAR(got[0].value, 1, evaluation == EVALUATION_BUILTIN ? 1e-4 : 0);
                for (std::size_t i = 0; i < probes.size(); ++i) {
                    const double q = probes[i].q;
                    const ShapedValue truth = beta_kernel().value(footprint, e, q);
                    const double allowed =
                        evaluation == EVALUATION_BUILTIN ? 1e-4 : 3e-7 + 2e-7 * e;
                    ASSERT_NEAR(got[i].value, truth.w, allowed) << q;
                    if (q >= BETA_SUPPORT) {
                        ASSERT_EQ(got[i].value, 0) << q;
                        ASSERT_EQ(got[i].slope, 0) << q;
                    } else if (q < BETA_SUPPORT * (1 - 1e-6)) {
                        ASSERT_NEAR(got[i].slope, truth.slope, e * allowed) << q;
                    }
                    if (0.5 * got[i].value >= kCutoff) {
                        ASSERT_GE(got[i].reach, q);
                    }
                    ASSERT_NEAR(got[i].covariance_scale,
                                beta_kernel().covariance_scale(footprint, e), 1e-6);
                }
                EXPECT_NEAR(got[0].reach, beta_kernel().reach(footprint, e, 0.5, kCutoff), 2e-3);
            }
}

TEST_F(KernelShader, Exponents_of_generalized_exponential_areThoseOfDoubleFromCentreOutwards) {
    const ShapedKernel& kernel = exponential_kernel();
    for (const int evaluation : {EVALUATION_POLYNOMIAL, EVALUATION_BUILTIN})
        for (const double t : {EXPONENTIAL_LEAST, 1.2, 2.0, 3.5, EXPONENTIAL_MOST}) {
            const Variant v{KERNEL_GENERALIZED_EXPONENTIAL, Footprint::psi, evaluation,
                            kFullDegree};
            SCOPED_TRACE(fmt::format("{}, exponent {}", v.name(), t));
            std::vector<Probe> probes = ramp(v, 500);
            for (const float q : {1e-20f, 1e-7f, 1e-4f, 1e-3f, 1e-2f, 300.0f, 1e4f, 1e30f, 3e38f})
                probes.push_back({q, 1});
            for (Probe& p : probes) p.opacity = 0.5f;
            const std::vector<Answer> got = run(v, probes, static_cast<float>(t));
            const bool builtin = evaluation == EVALUATION_BUILTIN;
            const double allowed = builtin ? 1e-4 : kernel.rounding(t);
            EXPECT_NEAR(got[0].value, 1, builtin ? 1e-4 : 0);
            for (std::size_t i = 0; i < probes.size(); ++i) {
                const double q = probes[i].q;
                const ShapedValue truth = kernel.value(Footprint::psi, t, q);
                ASSERT_NEAR(got[i].value, truth.w, allowed) << q;
                ASSERT_NEAR(got[i].slope, truth.slope,
                            t * allowed + (builtin ? 1e-4 : 2e-6) * std::abs(truth.slope))
                    << q;
                if (0.5 * got[i].value >= kCutoff) {
                    ASSERT_GE(got[i].reach, q);
                }
                ASSERT_NEAR(got[i].covariance_scale / kernel.covariance_scale(Footprint::psi, t), 1,
                            2e-6);
            }
            const double reach = kernel.reach(Footprint::psi, t, 0.5, kCutoff);
            EXPECT_NEAR(got[0].reach / reach, 1, 3e-4);
        }
}

TEST_F(KernelShader, Weights_of_blends_areThoseOfDouble) {
    for (const int id : {test::kSmoothBlend, test::kSteepBlend})
        for (const Footprint footprint : {Footprint::psi, Footprint::exact})
            for (const double m : {0.0, 0.3, 1.0}) {
                const ShapedKernel& kernel = shaped_kernel(id);
                const std::array<int, 2> parts = blend_parts(id).value();
                const Variant v{id, footprint, EVALUATION_POLYNOMIAL, kFullDegree};
                SCOPED_TRACE(fmt::format("{}, weight {}", v.name(), m));
                std::vector<Probe> probes = ramp(v, 500);
                for (Probe& p : probes) p.opacity = 0.5f;
                const std::vector<Answer> got = run(v, probes, static_cast<float>(m));
                const double allowed = kernel.rounding(m);
                for (std::size_t i = 0; i < probes.size(); ++i) {
                    const double q = probes[i].q;
                    bool at_edge = false;  // at either kernel's edge, where a rounding of q decides
                    for (const int k : parts) at_edge |= std::abs(q / kernel_support(k) - 1) < 1e-2;
                    const ShapedValue truth = kernel.value(footprint, m, q);
                    if (!at_edge) {
                        ASSERT_NEAR(got[i].value, truth.w, allowed) << q;
                        ASSERT_NEAR(got[i].slope, truth.slope, 4e-6) << q;
                    }
                    if (0.5 * got[i].value >= kCutoff) {
                        ASSERT_GE(got[i].reach, q);
                    }
                    ASSERT_NEAR(got[i].covariance_scale, kernel.covariance_scale(footprint, m),
                                2e-6);
                }
                EXPECT_NEAR(got[0].reach / kernel.reach(footprint, m, 0.5, kCutoff), 1, 1e-3);
            }
}

TEST_F(KernelShader, CovarianceScale_isPsiOrOne) {
    for_every_variant([&](const Variant& v) {
        EXPECT_EQ(run(v, {{0, 1}})[0].covariance_scale,
                  static_cast<float>(covariance_scale(v.kernel, v.footprint)));
    });
}

TEST_F(KernelShader, Reach_boundsEveryComputedValueAboveTheCutoff) {
    for_every_variant([&](const Variant& v) {
        std::vector<Probe> probes;
        for (const double opacity : {kCutoff * 1.00001, 0.005, 0.05, 0.5, 1.0})
            for (const Probe& p : ramp(v, 2000))
                probes.push_back({p.q, static_cast<float>(opacity)});
        const std::vector<Answer> answers = run(v, probes);
        for (std::size_t i = 0; i < probes.size(); ++i) {
            ASSERT_LE(answers[i].reach, v.support()) << v.name();
            if (probes[i].q <= answers[i].reach) continue;
            ASSERT_LT(probes[i].opacity * answers[i].value, static_cast<float>(kCutoff))
                << v.name() << ", opacity " << probes[i].opacity << ", q = " << probes[i].q;
        }
    });
}

TEST_F(KernelShader, Reach_isTight) {
    for_every_variant([&](const Variant& v) {
        const auto& k = kernel_coefficients(v.kernel, v.footprint, v.degree);
        const double margin = (v.evaluation == EVALUATION_BUILTIN ? 2e-4 : 1e-5) +
                              (k.form == KERNEL_FORM_GAUSSIAN ? 2 * k.value_error : 0);
        const std::vector<Probe> probes = {{0, 0.005f}, {0, 0.05f}, {0, 0.5f}, {0, 1}};
        const std::vector<Answer> answers = run(v, probes);
        for (std::size_t i = 0; i < probes.size(); ++i) {
            const double inside = v.value(answers[i].reach * (1 - 3e-5));
            EXPECT_GE(inside, kCutoff / probes[i].opacity * (1 - margin) - v.value_tolerance())
                << v.name() << ", opacity " << probes[i].opacity << ", reach " << answers[i].reach;
        }
    });
}

TEST_F(KernelShader, Reach_ofWhatCannotBeSeen_isZero) {
    for_every_variant([&](const Variant& v) {
        const auto below = static_cast<float>(kCutoff * (1 - 1e-5));
        for (const Answer& a : run(v, {{0, 0}, {0, below}, {0, -1}, {0, NAN}}))
            EXPECT_EQ(a.reach, 0) << v.name();
    });
}

/// q by the Cholesky factor as the blend computes it, in float32, with the bound of its rounding.
struct FloatQ {
    float q;
    double bound;
};
FloatQ float_q(const test::KernelVector& v) {
    const double l11 = std::sqrt(v.a), l21 = v.b / l11, l22 = std::sqrt(v.c - l21 * l21);
    const auto dx = static_cast<float>(v.dx), dy = static_cast<float>(v.dy);
    const float x = static_cast<float>(l11) * dx + static_cast<float>(l21) * dy;
    const float y = static_cast<float>(l22) * dy;
    return {x * x + y * y, 8 * std::ldexp(1.0, -24) *
                               (2 * std::abs(static_cast<double>(x)) *
                                    (std::abs(l11 * v.dx) + std::abs(l21 * v.dy)) +
                                2.0 * y * y)};
}

TEST_F(KernelShader, ReferenceVectors_agreeWithinTheBoundOfQ) {
    const auto vectors = test::load_kernel_vectors();
    if (!vectors)
        GTEST_SKIP() << "no reference vectors at " << test::kernel_vectors_path()
                     << "; set DARB_KERNEL_VECTORS";
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel) {
        const Variant variant{kernel};
        std::vector<Probe> probes;
        std::vector<const test::KernelVector*> cases;
        for (const test::KernelVector& v : *vectors)
            if (v.kernel == kernel) {
                probes.push_back({float_q(v).q, 1});
                cases.push_back(&v);
            }
        const std::vector<Answer> answers = run(variant, probes);
        const double rounding =
            float_rounding(kernel_coefficients(kernel, Footprint::psi, kFullDegree));
        int at_the_edge = 0;
        for (std::size_t i = 0; i < cases.size(); ++i) {
            const test::KernelVector& v = *cases[i];
            const double bound = float_q(v).bound;
            // Within rounding of the edge, a kernel with a jump, and every slope, may be on either
            // side.
            const bool edge = std::abs(v.q - variant.support()) <= bound + 1e-6 * v.q;
            at_the_edge += edge;
            const double alpha = std::min(0.99, v.opacity * answers[i].value);
            const double steepest =
                std::max(std::abs(v.slope), std::abs(variant.slope(v.q - bound)));
            const double jump = edge && kernel_profile(kernel).edge_order == 0
                                    ? v.opacity * variant.value(variant.support() * (1 - 1e-9))
                                    : 0;
            EXPECT_NEAR(v.alpha, alpha, v.opacity * steepest * bound + rounding + jump)
                << kernel_name(kernel) << " case " << v.index << " (" << v.tag << ")";
            const double curvature = 0.5;  // |d2w/dq2| of all kernels is below 2, psi footprint
            if (edge) continue;
            EXPECT_NEAR(v.slope, answers[i].slope, 4 * curvature * bound + 1e-6)
                << kernel_name(kernel) << " case " << v.index << " (" << v.tag << ")";
        }
        EXPECT_LT(2 * at_the_edge, static_cast<int>(cases.size())) << kernel_name(kernel);
    }
}

}  // namespace
}  // namespace darb
