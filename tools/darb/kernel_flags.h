// Lists of kernels on the command line.
#pragma once

#include <string>
#include <vector>

namespace darb {

/// "all" (the nine of the family), "paper" (the five of the paper's tables) or names with commas,
/// to KERNEL_* without repeats. Throws Error naming `option` for a name that is no kernel, or one
/// of a row with more than one pulse.
std::vector<int> kernels_from_list(const std::string& option, const std::string& list);

/// The names of the family, with commas.
std::string kernel_names();

}  // namespace darb
