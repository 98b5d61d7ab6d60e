// SPDX-License-Identifier: MIT
// The options of `darb train` as keywords.
#pragma once

#include <string>

#include "tools/python/arguments.h"
#include "trainer/job/request.h"

namespace darb::python {

/// Makes the complete request. Names have underscores for dashes, and switches take True and False.
/// dataset: its path, empty where it has been read already. Throws Error as the command does, and
/// for options that only the command has: output folder, window, saving.
TrainRequest take_train_options(const py::dict& options, std::string dataset);

/// Every option that take_train_options() takes, by name, with its value in the request.
py::dict asked_options(const TrainRequest& request);

}  // namespace darb::python
