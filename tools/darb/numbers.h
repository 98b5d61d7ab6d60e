// Numbers and values of a command line, typed or kept by a run.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace darb {

/// Throws Error for an option whose value is "": it would count as not given.
void refuse_empty_values(const std::vector<std::string>& arguments);

/// Throws Error for values that the parser took for numbers and lets through every limit: nan,
/// infinities, and what float32 holds as infinity. Text is none of them, so that files and folders
/// may have such names. app: after it has parsed.
void refuse_no_numbers(const CLI::App& app);

/// Checks of an option: CLI11's own ones answer with a limit of 309 digits. Infinity passes them,
/// as refuse_no_numbers() has the better message for it.
CLI::Validator above_zero();
CLI::Validator zero_or_more();

}  // namespace darb
