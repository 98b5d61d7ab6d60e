// Kernels beyond the list that shaders know. A registered kernel has an id as the others have, from
// KERNEL_ROWS on, and all of kernel_family.h, kernel_coefficients.h and what takes a kernel accept
// it. Ids are of one process; files hold the definition.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/kernels/kernel_definition.h"

namespace darb {

/// The id of this kernel; the same for the same kernel. Safe from several threads. Throws Error
/// where the name belongs to another kernel, and ProfileFault as check_definition.
int register_kernel(const KernelDefinition& definition);
/// w(q) on (0, support) as a kernel of this name, in one call.
int register_kernel(std::string_view name, double support, const std::function<double(double)>& w);
/// As the first, for what a file holds: where the name belongs to another kernel the new one is
/// called NAME_2 or so, and notes say so. Throws Error at `where`.
int register_kernel_of_file(KernelDefinition definition, const std::string& where,
                            std::vector<std::string>& notes);

/// Null for the kernels of the list.
const KernelDefinition* kernel_definition(int kernel);
/// The list, without rows of more pulses, and behind it what was registered.
std::vector<int> known_kernels();

}  // namespace darb
