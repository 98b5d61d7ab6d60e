// SPDX-License-Identifier: MIT
// Kernels beyond the list that shaders know. A registered kernel has an id like the others, from
// KERNEL_ROWS on, which kernel_family.h, kernel_coefficients.h and everything else that takes a
// kernel accept. Ids are valid within one process; files store the definition.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/kernels/kernel_definition.h"

namespace darb {

/// The id of this kernel; equal kernels get equal ids. Thread-safe. Throws Error where the name
/// belongs to another kernel, and ProfileFault as check_definition does.
int register_kernel(const KernelDefinition& definition);
/// Defines and registers w(q) on (0, support) under this name, in one call.
int register_kernel(std::string_view name, double support, const std::function<double(double)>& w);
/// Registers a kernel from a file: where its name belongs to another kernel, it is renamed to
/// NAME_2 or so, with a note. Throws Error at `where`.
int register_kernel_of_file(KernelDefinition definition, const std::string& where,
                            std::vector<std::string>& notes);

/// The definition of a registered kernel; null for the kernels of the list.
const KernelDefinition* kernel_definition(int kernel);
/// The kernels of the list, without those of several pulses, followed by the registered ones.
std::vector<int> known_kernels();

}  // namespace darb
