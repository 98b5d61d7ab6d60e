// Quantiles of a radial density that is 0 at both ends.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace darb {

/// At (k + 1/2) / count of a density over [0, radius], density(x) at the radius x * radius. x =
/// sin^2 a: even steps in a are fine at both ends.
template <class Density>
std::vector<double> density_quantiles(double radius, int count, const Density& density) {
    constexpr int kSteps = 4096;
    const auto share = [](double step) {
        const double s = std::sin(std::acos(-1.0) / 2 * step / kSteps);
        return s * s;
    };
    std::vector<double> mass{0};
    for (int i = 0; i < kSteps; ++i) {
        const double x = share(i + 0.5), width = share(i + 1) - share(i);
        mass.push_back(mass.back() + width * density(x));
    }
    std::vector<double> quantiles;
    for (int k = 0; k < count; ++k) {
        const double target = (k + 0.5) / count * mass.back();
        const auto after = std::upper_bound(mass.begin(), mass.end(), target);
        const auto i = static_cast<int>(after - mass.begin()) - 1;
        const double within = (target - *(after - 1)) / (*after - *(after - 1));
        quantiles.push_back(radius * (share(i) + within * (share(i + 1) - share(i))));
    }
    return quantiles;
}

}  // namespace darb
