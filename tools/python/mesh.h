// SPDX-License-Identifier: MIT
// Scene.mesh: what `darb mesh` does, with arrays in and out.
#pragma once

#include "tools/python/arguments.h"

namespace darb::python {

void bind_mesh(py::module_& module);

}  // namespace darb::python
