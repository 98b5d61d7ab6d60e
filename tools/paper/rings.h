// The rings that the paper's limits remove: raised cosine and sinc oscillate on beyond their first
// pulse. What more pulses would do to psi and to where the mass of a splat lies.
#pragma once

#include <string>
#include <vector>

namespace darb {

struct Rings {
    std::string kernel;  // raised_cosine or sinc
    int pulses = 1;
    double radius = 0;  // of the support, standard deviations
    double psi = 1;
    double outside = 0;  // share of the 3D integral that lies beyond the first pulse
};

/// w at distance d: 1/2 + 1/2 cos(pi d/2.5) up to 2.5 (2 pulses - 1), the modulus |sin x / x|,
/// x = pi d/3, up to 3 pulses; pulses of 1 or more.
double ring_value(bool sinc, int pulses, double d);
double ring_radius(bool sinc, int pulses);
Rings rings_of(bool sinc, int pulses);

/// Both kernels with 1, 2 and 3 pulses.
std::vector<Rings> all_rings();

}  // namespace darb
