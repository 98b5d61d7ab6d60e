// The splats of a call, given as arrays.
#pragma once

#include "engine/scene/splat_model.h"
#include "tools/python/arguments.h"

namespace darb::python {

/// The arrays where they lie. Opacities and scales are these themselves
/// (GradientOptions::linear_values).
struct SplatArraysGiven {
    SplatModel header;  // of no splats
    Floats means, quats, scales, opacities, colours;
    bool direct_colour = false;  // colours is `colors`, not `sh`

    std::size_t count() const { return opacities.size(); }
    /// Of colours, the largest array, which take_splats leaves to whoever takes it to the device.
    void check_colours() const;
    /// A copy with all; sh_dc holds `colors` where these are given.
    SplatModel model() const;
};

/// Of 1, 4, 9 or 16 coefficients; Error for others.
int degree_of_coefficients(py::ssize_t coefficients);
/// sh [N,K,3] into the first band [N,3] and the others [N,K-1,3].
void split_harmonics(const Floats& sh, std::vector<float>& first, std::vector<float>& others);

/// options: means, quats, scales, opacities, colors or sh, kernel, footprint, antialiased.
SplatArraysGiven take_splats(const py::dict& options);

}  // namespace darb::python
