// SPDX-License-Identifier: MIT
// Both footprints, for loops.
#pragma once

#include "engine/kernels/kernel_family.h"

namespace darb::test {

inline constexpr Footprint kFootprints[] = {Footprint::psi, Footprint::exact};

}  // namespace darb::test
