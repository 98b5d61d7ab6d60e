// Numbers and values of a command line, typed or kept by a run.
#pragma once

#include <string>
#include <vector>

namespace darb {

/// Throws Error for an option whose value is "": it would count as not given.
void refuse_empty_values(const std::vector<std::string>& arguments);

/// Throws Error for values that the parser takes for numbers and lets through every limit: nan,
/// infinities, and what float32 holds as infinity.
void refuse_no_numbers(const std::vector<std::string>& arguments);

}  // namespace darb
