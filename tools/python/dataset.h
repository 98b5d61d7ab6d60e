// SPDX-License-Identifier: MIT
// darb.Dataset: photos with their cameras and the sparse points.
#pragma once

#include "engine/data/dataset.h"
#include "tools/python/arguments.h"

namespace darb::python {

struct PyDataset {
    Dataset data;
};

/// options: resolution, eval, images, lens, as for `darb train`.
PyDataset read_dataset(const py::object& path, const py::dict& options);

void bind_dataset(py::module_& module);

}  // namespace darb::python
