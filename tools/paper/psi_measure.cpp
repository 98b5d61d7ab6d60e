// SPDX-License-Identifier: MIT
#include "tools/paper/psi_measure.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/rng.h"
#include "engine/kernels/quadrature.h"
#include "engine/reference/parallel.h"

namespace darb {

namespace {

constexpr double kGaussSupport = 36;  // here the Gaussian is cut at this q: e^-18
constexpr int kMaximumSamples = 4000;

double support_of(const DerivedKernel& kernel) {
    return std::min(kernel.row().support, kGaussSupport);
}

glm::dmat3 random_rotation(Pcg32& rng) {
    const double w = rng.normal(), x = rng.normal(), y = rng.normal(), z = rng.normal();
    const double s = 2 / (w * w + x * x + y * y + z * z);
    return {1 - s * (y * y + z * z), s * (x * y + w * z),     s * (x * z - w * y),
            s * (x * y - w * z),     1 - s * (x * x + z * z), s * (y * z + w * x),
            s * (x * z + w * y),     s * (y * z - w * x),     1 - s * (x * x + y * y)};
}

glm::dmat3 random_covariance(Pcg32& rng) {
    for (;;) {
        const glm::dmat3 axes = random_rotation(rng);
        glm::dmat3 scaled = axes;
        for (int i = 0; i < 3; ++i) scaled[i] *= std::exp2(rng.uniform(-1, 1));
        const glm::dmat3 s = scaled * glm::transpose(scaled);
        if (std::abs(s[0][1]) >= 0.2 * std::sqrt(s[0][0] * s[1][1])) return s;
    }
}

/// One experiment: {xx, xy, yy} of the weighted 2D covariance, divided by those of the 3D one.
std::array<double, 3> grid_ratios(const DerivedKernel& kernel, const glm::dmat3& covariance,
                                  const glm::dvec3& mean, int cells) {
    const double support = support_of(kernel);
    const glm::dmat3 inverse = glm::inverse(covariance);
    glm::dvec3 step, first;  // cell centres on the world's lattice, whatever the mean
    for (int a = 0; a < 3; ++a) {
        step[a] = 2 * std::sqrt(support * covariance[a][a]) / (cells - 1);
        first[a] = step[a] * (std::floor(mean[a] / step[a]) - 0.5 * (cells - 1));
    }
    double total = 0;
    glm::dvec2 centre(0);
    glm::dmat2 second(0);
    for (int j = 0; j < cells; ++j)
        for (int i = 0; i < cells; ++i) {
            double column = 0;  // the density summed along z
            for (int k = 0; k < cells; ++k) {
                const glm::dvec3 d = first + step * glm::dvec3(i, j, k) - mean;
                const double q = glm::dot(d, inverse * d);
                if (q < support) column += kernel.value(Footprint::psi, q);
            }
            const glm::dvec2 p(first.x + step.x * i, first.y + step.y * j);
            total += column;
            centre += column * p;
            second += column * glm::outerProduct(p, p);
        }
    centre /= total;
    second = second / total - glm::outerProduct(centre, centre);
    return {second[0][0] / covariance[0][0], second[0][1] / covariance[0][1],
            second[1][1] / covariance[1][1]};
}

PsiSpread spread(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    const std::size_t n = values.size();
    double mean = 0, squares = 0;
    for (const double v : values) mean += v / static_cast<double>(n);
    for (const double v : values) squares += (v - mean) * (v - mean);
    return {0.5 * (values[(n - 1) / 2] + values[n / 2]), values.front(), values.back(),
            n > 1 ? std::sqrt(squares / static_cast<double>(n - 1)) : 0.0};
}

/// Integral of f over [from, to], with nodes that crowd at `to`, where footprints fall like a root.
template <class F>
double integrate(double from, double to, const F& f) {
    return 2 * (to - from) *
           integrate_unit([&](double x) { return x * f(to - (to - from) * x * x); });
}

/// Relative L2 and largest difference of `shown` from the projection; the edge of `shown` is at
/// `edge`.
template <class F>
FootprintDistance distance(const DerivedKernel& kernel, double edge, const F& shown) {
    const double support = support_of(kernel);
    const auto truth = [&](double q) { return projected_profile(kernel, q); };
    const auto squared_error = [&](double q) {
        const double error = truth(q) - shown(q);
        return error * error;
    };
    const double inner = std::min(support, edge), outer = std::max(support, edge);
    double error = integrate(0, inner, squared_error);
    if (outer > inner) error += integrate(inner, outer, squared_error);
    const double square = integrate(0, support, [&](double q) { return truth(q) * truth(q); });
    FootprintDistance result{std::sqrt(error / square), 0};
    for (int i = 0; i < kMaximumSamples; ++i) {
        const double q = outer * (i + 0.5) / kMaximumSamples;
        result.linf = std::max(result.linf, std::abs(truth(q) - shown(q)));
    }
    return result;
}

}  // namespace

double projected_profile(const DerivedKernel& kernel, double q) {
    const double support = kernel.row().support;
    if (!std::isfinite(support)) return std::exp(-q / 2);  // as shapes of splats start, too
    if (q >= support) return 0;
    const auto integral = [&](double at) {
        const double half = std::sqrt(support - at);
        double sum = 0;
        for (const auto [x, weight] : even_quadrature())
            sum += weight * kernel.value(Footprint::psi, at + half * half * x * x);
        return sum * half;
    };
    return integral(q) / integral(0);
}

std::array<PsiSpread, 3> psi_on_grid(const DerivedKernel& kernel, const PsiGridOptions& options) {
    DARB_CHECK(options.samples >= 1 && options.cells >= 8, "{} samples, {} cells", options.samples,
               options.cells);
    const auto count = static_cast<std::size_t>(options.samples);
    std::vector<glm::dmat3> covariances;
    std::vector<glm::dvec3> means;
    Pcg32 rng(options.seed);
    for (std::size_t i = 0; i < count; ++i) {
        covariances.push_back(random_covariance(rng));
        means.emplace_back(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1));
    }
    std::array<std::vector<double>, 3> ratios;
    for (std::vector<double>& r : ratios) r.resize(count);
    reference::parallel_for(count, 0, [&](std::size_t i) {
        const auto one = grid_ratios(kernel, covariances[i], means[i], options.cells);
        for (std::size_t e = 0; e < 3; ++e) ratios[e][i] = one[e];
    });
    return {spread(ratios[0]), spread(ratios[1]), spread(ratios[2])};
}

FootprintDistance footprint_distance(const DerivedKernel& kernel, double scale) {
    return distance(kernel, scale * support_of(kernel),
                    [&](double q) { return kernel.value(Footprint::psi, q / scale); });
}

FootprintDistance footprint_distance(const DerivedKernel& kernel, const KernelCoefficients& exact) {
    return distance(kernel, support_of(kernel), [&](double q) {
        float w, slope;
        evaluate(exact, static_cast<float>(q), w, slope);
        return static_cast<double>(w);
    });
}

double least_squares_psi(const DerivedKernel& kernel) {
    if (!std::isfinite(kernel.row().support)) return 1;
    // Golden section on the squared error, whose only minimum lies well within the bracket.
    constexpr double kGolden = 0.6180339887498949;
    double low = 0.2, high = 3;
    double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
    double at_a = footprint_distance(kernel, a).l2, at_b = footprint_distance(kernel, b).l2;
    while (high - low > 1e-8) {
        if (at_a < at_b) {
            high = b;
            b = a;
            at_b = at_a;
            at_a = footprint_distance(kernel, a = high - kGolden * (high - low)).l2;
        } else {
            low = a;
            a = b;
            at_a = at_b;
            at_b = footprint_distance(kernel, b = low + kGolden * (high - low)).l2;
        }
    }
    return (low + high) / 2;
}

PsiResult measure_psi(const DerivedKernel& kernel, const PsiGridOptions& options) {
    PsiResult result;
    result.kernel = kernel.row().name;
    result.support = kernel.row().support;
    result.grid = psi_on_grid(kernel, options);
    result.exact = kernel.psi();
    result.best = least_squares_psi(kernel);
    result.by_psi = footprint_distance(kernel, result.exact);
    result.by_best = footprint_distance(kernel, result.best);
    result.by_one = footprint_distance(kernel, 1);
    result.by_exact_footprint =
        footprint_distance(kernel, fit_coefficients(kernel, Footprint::exact, kFullDegree));
    return result;
}

}  // namespace darb
