// SPDX-License-Identifier: MIT
// The options of `darb train` as keywords.
#pragma once

#include <string>

#include "tools/python/arguments.h"
#include "trainer/job/request.h"

namespace darb::python {

/// The complete request of names with underscores for dashes; True and False for a switch. dataset:
/// its path, empty where it is read already. Throws Error as the command does, and for options of
/// what only the command has: output folder, window, saving.
TrainRequest take_train_options(const py::dict& options, std::string dataset);

/// Every option that take_train_options() takes, by its name, as the request has it.
py::dict asked_options(const TrainRequest& request);

}  // namespace darb::python
