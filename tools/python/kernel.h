// SPDX-License-Identifier: MIT
// Kernels and footprints, given by name or as an object.
#pragma once

#include <optional>

#include "engine/kernels/kernel_family.h"
#include "tools/python/arguments.h"

namespace darb::python {

/// The kernel of a darb.Kernel; nothing for anything else.
std::optional<int> kernel_of_object(const py::object& value);
/// A row of engine/kernels, given by name or as a darb.Kernel.
int take_kernel(const py::object& value, const char* name);
Footprint take_footprint(const py::object& value);

void bind_kernel(py::module_& module);

}  // namespace darb::python
