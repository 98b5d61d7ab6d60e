// The splats of a call, given as arrays.
#pragma once

#include "engine/scene/splat_model.h"
#include "tools/python/arguments.h"

namespace darb::python {

/// A model whose opacities and scales are these themselves (GradientOptions::linear_values).
struct SplatArraysGiven {
    SplatModel model;
    bool direct_colour = false;  // sh_dc holds `colors`
};

/// Of 1, 4, 9 or 16 coefficients; Error for others.
int degree_of_coefficients(py::ssize_t coefficients);
/// sh [N,K,3] into sh_dc and sh_rest; sh_degree is set.
void split_harmonics(const Floats& sh, SplatModel& model);

/// options: means, quats, scales, opacities, colors or sh, kernel, footprint, antialiased.
SplatArraysGiven take_splats(const py::dict& options);

}  // namespace darb::python
