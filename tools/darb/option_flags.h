// The flags of the table of training options.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <utility>
#include <vector>

#include "trainer/options/option_table.h"

namespace darb {

/// Flags that were given and the strategies that know them.
using GivenOfStrategies = std::vector<std::pair<std::string, std::string>>;

/// A flag for each row that has one. Values land in options in the order of the table; both must
/// outlive the parse, which throws Error for a value that a row does not take.
void add_option_rows(CLI::App& command, TrainOptions& options, GivenOfStrategies& given);

/// Options that are no more, as flags that are not shown: Error that says what replaced them.
void add_removed_options(CLI::App& command);

}  // namespace darb
