// SPDX-License-Identifier: MIT
// The double-precision reference, for tests.
#pragma once

#include <pybind11/pybind11.h>

namespace darb::python {

void bind_reference(pybind11::module_& module);

}  // namespace darb::python
