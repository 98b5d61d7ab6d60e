// SPDX-License-Identifier: MIT
// The table of tolerances, by its short name in tests.
#pragma once

#include "engine/reference/comparison.h"

namespace darb::test {

using reference::Tolerance;
using reference::tolerance;

}  // namespace darb::test
