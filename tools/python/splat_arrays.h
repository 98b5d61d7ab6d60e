// SPDX-License-Identifier: MIT
// The splats of a call, given as arrays.
#pragma once

#include "engine/render/render_gradients.h"
#include "engine/scene/splat_model.h"
#include "tools/python/arguments.h"

namespace darb::python {

/// The caller's arrays, not copied. Opacities and scales are plain values, neither logits nor
/// logarithms (GradientOptions::linear_values).
struct SplatArraysGiven {
    SplatModel header;  // has no splats
    Floats means, quats, scales, opacities, colours;
    Floats shapes;               // empty for a kernel without shapes
    bool direct_colour = false;  // whether colours holds `colors` rather than `sh`

    std::size_t count() const { return opacities.size(); }
    /// Throws an Error with the place of the first number that is NaN or out of range. take_splats
    /// leaves this check to whoever reads the arrays anyway.
    void check_values() const;
    /// Whether finite values of the attribute (kShDc for colours) are in its range. Does not need
    /// the GIL.
    static bool accepts(int attribute, std::span<const float> values);
    GivenValues values() const;
    /// A checked copy of everything; sh_dc holds `colors` where those are given.
    SplatModel model() const;
};

/// The degree with 1, 4, 9 or 16 coefficients; throws Error for other numbers.
int degree_of_coefficients(py::ssize_t coefficients);
/// [N] for a kernel with shapes; None means zeros, with which training starts. Throws Error where
/// the kernel takes no shapes.
Floats take_shapes(const py::object& value, int kernel, py::ssize_t count);
/// Splits sh [N,K,3] into the first band [N,3] and the others [N,K-1,3].
void split_harmonics(const Floats& sh, std::vector<float>& first, std::vector<float>& others);

/// options: means, quats, scales, opacities, colors or sh, shapes, kernel, footprint, antialiased.
SplatArraysGiven take_splats(const py::dict& options);

}  // namespace darb::python
