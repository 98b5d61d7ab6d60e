// Blends of two kernels of the list, w = (1 - m) w1 + m w2, m of each splat. With the exact
// footprint m is that of the line integrals divided by their values at the centre. Everything
// follows from what the two kernels have.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>

#include "engine/core/error.h"
#include "engine/kernels/density_quantiles.h"
#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/quadrature.h"
#include "engine/kernels/second_moment.h"
#include "engine/kernels/shaped_kernel.h"
#include "shaders/shared/kernel_forms.h"

namespace darb {
namespace {

constexpr double kMostShape = 30;  // 1 - m is above rounding
constexpr double kLastShape = 6;   // of the tables: m within 0.25 % of 0 and 1

class BlendKernel : public ShapedKernel {
  public:
    explicit BlendKernel(const std::array<int, 2>& kernels) : kernels_(kernels) {
        for (std::size_t i = 0; i < 2; ++i) {
            const DerivedKernel& k = derived_kernel(kernels[i]);
            const double radius = std::sqrt(end_of(i));
            facts_.second[i] = k.radial_moment(radius, 2);
            facts_.fourth[i] = k.radial_moment(radius, 4) / 3;
            facts_.centre[i] = k.radial_moment(radius, 0);
            for (const Footprint f : {Footprint::psi, Footprint::exact}) {
                const auto integral = [&](int power) {
                    return integrate_unit([&](double s) {
                        const double q = end_of(i) * (1 - s * s);
                        return 2 * end_of(i) * s * std::pow(q, power) * k.value(f, q);
                    });
                };
                plane_[static_cast<std::size_t>(f)][i] = {integral(0), integral(1)};
            }
        }
    }

    const BlendFacts& facts() const { return facts_; }

    double exponent_least() const override { return 0; }
    double exponent_most() const override { return 1; }
    double first_shape() const override { return -kLastShape; }
    double last_shape() const override { return kLastShape; }

    double exponent(Footprint footprint, double shape) const override {
        const double m = sigmoid_of(shape);
        return footprint == Footprint::exact ? m * facts_.centre[1] / between(facts_.centre, m) : m;
    }

    double exponent_slope(Footprint footprint, double shape) const override {
        if (!(std::abs(shape) < kMostShape)) return 0;
        const double m = sigmoid_of(shape), centre = between(facts_.centre, m);
        return m * (1 - m) *
               (footprint == Footprint::exact
                    ? facts_.centre[0] * facts_.centre[1] / (centre * centre)
                    : 1);
    }

    ShapedValue value(Footprint footprint, double m, double q) const override {
        double w[2], slope[2];
        for (std::size_t i = 0; i < 2; ++i) {
            w[i] = kernel_value(kernels_[i], footprint, q);
            slope[i] = kernel_slope(kernels_[i], footprint, q);
        }
        return {w[0] + m * (w[1] - w[0]), slope[0] + m * (slope[1] - slope[0]), w[1] - w[0]};
    }

    double extent(double) const override { return std::max(end_of(0), end_of(1)); }

    double reach(Footprint footprint, double m, double opacity, double cutoff) const override {
        double low = 0, high = 0;
        for (const int k : kernels_)
            high = std::max(high, kernel_reach(k, footprint, opacity, cutoff));
        for (int step = 0; step < 60; ++step) {
            const double middle = (low + high) / 2;
            (opacity * value(footprint, m, middle).w >= cutoff ? low : high) = middle;
        }
        return high;
    }

    double covariance_scale(Footprint footprint, double m) const override {
        return footprint == Footprint::psi ? between(facts_.fourth, m) / between(facts_.second, m)
                                           : 1;
    }

    double length_slope(Footprint footprint, double m) const override {
        if (footprint != Footprint::psi) return 0;
        const auto share = [&](const std::array<double, 2>& of) {
            return (of[1] - of[0]) / between(of, m);
        };
        return (share(facts_.fourth) - share(facts_.second)) / 2;
    }

    double second_moment(Footprint footprint, double m) const override {
        const auto& plane = plane_[static_cast<std::size_t>(footprint)];
        const double mass = (1 - m) * plane[0].mass + m * plane[1].mass;
        const double moment = (1 - m) * plane[0].moment + m * plane[1].moment;
        return covariance_scale(footprint, m) * moment / mass / 2;
    }

    std::vector<double> radius_quantiles(Footprint footprint, double m, int count) const override {
        const auto& [first, second] = facts_.centre;
        const double space =
            footprint == Footprint::exact ? m * first / (m * first + (1 - m) * second) : m;
        const double end = extent(m);
        return density_quantiles(std::sqrt(end), count, [&](double x) {
            return x * x * value(Footprint::psi, space, end * x * x).w;
        });
    }

    double rounding(double) const override {
        double most = 0;
        for (const Footprint f : {Footprint::psi, Footprint::exact})
            for (const int k : kernels_) {
                const KernelCoefficients& c = kernel_coefficients(k, f, kFullDegree);
                most = std::max(most, float_rounding(c) + 1.1 * c.value_error);
            }
        return most + 1e-7;
    }

    std::vector<double> exponents_to_check() const override { return {0, 0.25, 0.5, 0.9, 1}; }

  private:
    static double sigmoid_of(double shape) {
        return 1 / (1 + std::exp(-std::clamp(shape, -kMostShape, kMostShape)));
    }
    static double between(const std::array<double, 2>& of, double m) {
        return of[0] + m * (of[1] - of[0]);
    }
    double end_of(std::size_t i) const {
        return std::min(kernel_support(kernels_[i]), kGaussRadius * kGaussRadius);
    }

    struct Plane {
        double mass = 0, moment = 0;
    };
    std::array<int, 2> kernels_;
    BlendFacts facts_;
    std::array<std::array<Plane, 2>, 2> plane_;
};

/// Built at first use; entries never move.
struct Blend {
    std::once_flag once;
    std::unique_ptr<const BlendKernel> shaped;
    std::string name;
    KernelProfile row{};
};

Blend& blend_of(int kernel) {
    static std::array<Blend, KERNEL_COUNT * KERNEL_COUNT> all;
    Blend& blend = all[static_cast<std::size_t>(kernel - KERNEL_BLENDS)];
    std::call_once(blend.once, [&] {
        const std::array<int, 2> parts = *blend_parts(kernel);
        const KernelProfile &first = listed_profile(parts[0]), &second = listed_profile(parts[1]);
        blend.shaped = std::make_unique<const BlendKernel>(parts);
        blend.name = fmt::format("{}{},{}", kBlendMark, first.name, second.name);
        blend.row = {blend.name,
                     std::max(first.support, second.support),
                     std::min(first.edge_order, second.edge_order),
                     KERNEL_FORM_BLEND,
                     [first, second](std::complex<double> q) {
                         const auto part = [&](const KernelProfile& k) {
                             return q.real() < k.support ? k.profile(q) : 0.0;
                         };
                         return (part(first) + part(second)) / 2.0;
                     },
                     parts[0]};
    });
    return blend;
}

}  // namespace

std::optional<std::array<int, 2>> blend_parts(int kernel) {
    const int at = kernel - KERNEL_BLENDS;
    if (at < 0 || at >= KERNEL_COUNT * KERNEL_COUNT || at / KERNEL_COUNT == at % KERNEL_COUNT)
        return std::nullopt;
    return std::array{at / KERNEL_COUNT, at % KERNEL_COUNT};
}

const ShapedKernel& blend_kernel(int kernel) {
    return *blend_of(kernel).shaped;
}

const BlendFacts& blend_facts(int kernel) {
    return blend_of(kernel).shaped->facts();
}

const KernelProfile& blend_profile(int kernel) {
    return blend_of(kernel).row;
}

std::optional<int> blend_from_name(std::string_view name) {
    const std::size_t comma = name.find(',');
    if (!name.starts_with(kBlendMark) || comma == std::string_view::npos) return std::nullopt;
    const auto listed = [](std::string_view part) {
        part.remove_prefix(std::min(part.find_first_not_of(' '), part.size()));
        while (part.ends_with(' ')) part.remove_suffix(1);
        for (int k = 0; k < KERNEL_COUNT; ++k)
            if (listed_profile(k).name == part) return k;
        return -1;
    };
    const int first = listed(name.substr(kBlendMark.size(), comma - kBlendMark.size()));
    const int second = listed(name.substr(comma + 1));
    if (first < 0 || second < 0 || first == second) return std::nullopt;
    return blend_of(first, second);
}

}  // namespace darb
