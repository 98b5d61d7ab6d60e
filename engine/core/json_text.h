// SPDX-License-Identifier: MIT
// Says what is wrong with a text that should be JSON, by line and column and in words for users:
// the library's own messages are meant for its callers.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace darb {

/// Throws Error(where, place and reason, hint) where the text is not JSON.
nlohmann::json parse_json_text(std::string_view text, const std::string& where,
                               const std::string& hint);

/// The place of a parser error in its text, and the reason.
std::string json_fault(std::string_view text, const nlohmann::json::parse_error& error);

/// A library error in words for users: which key is missing, or which value has the wrong type.
std::string json_reason(const nlohmann::json::exception& error);

/// object[key] where that is a finite number above 0; else 0, also where `object` is no object.
double positive_number(const nlohmann::json& object, const char* key);

}  // namespace darb
