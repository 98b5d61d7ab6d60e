// What is wrong with a text that should be JSON, by line and column and in words of this program:
// those of the library are for its callers.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace darb {

/// Throws Error(where, place and reason, hint) where the text is no JSON.
nlohmann::json parse_json_text(std::string_view text, const std::string& where,
                               const std::string& hint);

/// The place of an error of the parser in its text, and the reason.
std::string json_fault(std::string_view text, const nlohmann::json::parse_error& error);

/// An error of the library in words for people: what is lacking, or of another type.
std::string json_reason(const nlohmann::json::exception& error);

}  // namespace darb
