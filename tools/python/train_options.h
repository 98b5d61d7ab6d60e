// The options of `darb train` as keywords.
#pragma once

#include "tools/python/arguments.h"
#include "trainer/job/request.h"

namespace darb::python {

/// Names with underscores for dashes; True for a flag, False for its no- form. Throws Error as the
/// command does, and for options of what only the command has: output folder, window, saving.
TrainRequest take_train_options(const py::dict& options);

}  // namespace darb::python
