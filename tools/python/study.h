// SPDX-License-Identifier: MIT
// darb.psi, darb.sim1d and darb.plan.
#pragma once

#include <pybind11/pybind11.h>

namespace darb::python {

void bind_study(pybind11::module_& module);

}  // namespace darb::python
