#include "tools/paper/rings.h"

#include <cmath>
#include <numbers>

#include "engine/core/check.h"
#include "engine/kernels/quadrature.h"

namespace darb {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kCosineRadius = 2.5, kSincRadius = 3;  // of the first pulse

/// Integral of r^power w over the ball of the first `pulses`, zero to zero, where w is smooth.
double moment(bool sinc, int pulses, int power) {
    double sum = 0, from = 0;
    for (int p = 1; p <= pulses; ++p) {
        const double to = ring_radius(sinc, p), width = to - from;
        sum += width * integrate_unit([&](double s) {
                   const double r = from + width * s;
                   return std::pow(r, power) * ring_value(sinc, pulses, r);
               });
        from = to;
    }
    return sum;
}

}  // namespace

double ring_radius(bool sinc, int pulses) {
    DARB_CHECK(pulses >= 1, "{} pulses", pulses);
    return sinc ? kSincRadius * pulses : kCosineRadius * (2 * pulses - 1);
}

double ring_value(bool sinc, int pulses, double d) {
    if (d >= ring_radius(sinc, pulses)) return 0;
    if (!sinc) return 0.5 + 0.5 * std::cos(kPi * d / kCosineRadius);
    const double x = kPi * d / kSincRadius;
    return x < 1e-8 ? 1 : std::abs(std::sin(x) / x);
}

Rings rings_of(bool sinc, int pulses) {
    const double mass = moment(sinc, pulses, 2);
    return {sinc ? "sinc" : "raised_cosine", pulses, ring_radius(sinc, pulses),
            moment(sinc, pulses, 4) / mass / 3, 1 - moment(sinc, 1, 2) / mass};
}

std::vector<Rings> all_rings() {
    std::vector<Rings> all;
    for (const bool sinc : {false, true})
        for (int pulses = 1; pulses <= 3; ++pulses) all.push_back(rings_of(sinc, pulses));
    return all;
}

}  // namespace darb
