// SPDX-License-Identifier: MIT
// The options of a training run by name, in one table: the flags of `darb train` with their help,
// the keywords of Python and the entries of OUT/request.json are made from it. The rows of
// trainer/options/option_table.h are among its rows.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "trainer/job/request.h"
#include "trainer/options/option_table.h"

namespace darb {

/// Where a request keeps a value; std::monostate: in several places, or in TrainOptions.
using RequestPlace = std::variant<std::monostate, bool*, int*, std::string*, std::filesystem::path*,
                                  std::vector<int>*, std::optional<double>*>;

struct RequestOption {
    OptionRow row = {};      // names, heading, help, default, limits; its member, where it has one
    const char* words = "";  // words that it accepts, with commas; "": any of its kind
    const char* section = "";    // section of request.json that holds the entry; "": none
    std::string key = {};        // key of the entry; "": none, other entries hold what it sets
    bool several = false;        // may be given several times, and keeps every value
    bool before_others = false;  // whatever stands after it may name what it brings
    RequestPlace (*place)(TrainRequest&) = nullptr;
    /// What a typed value does, the text of an entry, and what that does when it is read back;
    /// empty: as the place or the member has it.
    std::function<void(TrainRequest&, const std::string&)> take = {};
    std::function<std::string(const TrainRequest&)> saved = {};
    std::function<void(TrainRequest&, const std::string&)> restore = {};
};

/// Every row, in the order of `darb train --help-all`. Rows without flags are for files alone.
const std::vector<RequestOption>& request_options();

/// The row of this name: one of its flags, with or without dashes in front, with underscores or
/// dashes inside. Throws Error where there is none.
const RequestOption& request_option(std::string_view name);

/// What a row takes.
OptionKind option_kind(const RequestOption& option);

/// Takes over a value by the option's name, as it would be typed; a switch takes on and off, and
/// the name of its opposite turns it round. Throws Error with the option, the value, the reason and
/// what it takes. Where order matters (a preset, then what differs from it), the caller keeps it.
void set_request_option(TrainRequest& request, std::string_view name, const std::string& text);

/// Names with their values.
using GivenOptions = std::vector<std::pair<std::string, std::string>>;

/// Takes them all over, in the order of the table, whatever order they come in: a preset and a
/// schedule count less than what is given beside them.
void set_request_options(TrainRequest& request, const GivenOptions& given);

/// Whether set_request_option() was called for this option.
bool was_given(const TrainRequest& request, std::string_view name);

/// The value of a row for request.json, and back. Throws Error where the type is another, or the
/// value is none that the row takes.
nlohmann::json saved_value(const RequestOption& option, const TrainRequest& request);
void restore_value(const RequestOption& option, const nlohmann::json& value, TrainRequest& request);

}  // namespace darb
