// The options of `darb train` as keywords.
#pragma once

#include "tools/darb/train_flags.h"
#include "tools/python/arguments.h"

namespace darb::python {

/// Names with underscores for dashes; True for a flag, False for its no- form. Throws Error as the
/// command does, and for options of what only the command has: output folder, window, saving.
TrainFlags take_train_options(const py::dict& options);

}  // namespace darb::python
