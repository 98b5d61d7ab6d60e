// The rings that the paper's limits remove: raised cosine and sinc oscillate on beyond their first
// pulse. What more pulses would do to psi and to where the mass of a splat lies.
#pragma once

#include <vector>

namespace darb {

struct Rings {
    int kernel = 0;  // KERNEL_RAISED_COSINE or KERNEL_SINC, the latter as its modulus |sin x / x|
    int pulses = 1;
    double radius = 0;  // of the support, standard deviations
    double psi = 1;
    double outside = 0;  // share of the 3D integral that lies beyond the first pulse
};

/// kernel with one pulse or with more; there must be such a row of the family.
Rings rings_of(int kernel, int pulses);

/// Both kernels with 1, 2 and 3 pulses.
std::vector<Rings> all_rings();

}  // namespace darb
