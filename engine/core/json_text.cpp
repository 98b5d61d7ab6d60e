// SPDX-License-Identifier: MIT
#include "engine/core/json_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/core/text.h"

namespace darb {

namespace {

constexpr std::size_t kShown = 20;  // bytes of the text that a message quotes

/// The text from `at` to the end of its line.
std::string shown_at(std::string_view text, std::size_t at) {
    std::string_view rest = text.substr(std::min(at, text.size()));
    rest = rest.substr(0, std::min(rest.find_first_of("\r\n"), kShown));
    return printable(rest);
}

}  // namespace

std::string json_fault(std::string_view text, const nlohmann::json::parse_error& error) {
    if (text.find_first_not_of(" \t\r\n") == std::string_view::npos) return "is empty";
    if (text.size() > 1 && (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")))
        return "is text in UTF-16, but JSON is read in UTF-8";
    // The library counts bytes from 1 and points at the last byte it read.
    const std::size_t at = std::min(error.byte > 0 ? error.byte - 1 : 0, text.size());
    const std::string_view before = text.substr(0, at);
    const auto line = 1 + std::count(before.begin(), before.end(), '\n');
    const std::size_t begin =
        before.rfind('\n') == std::string_view::npos ? 0 : before.rfind('\n') + 1;
    if (text.find_first_not_of(" \t\r\n", at) == std::string_view::npos)
        return fmt::format("is no valid JSON: it ends in line {} before it is complete", line);
    // A word is quoted from its beginning.
    std::size_t word = at;
    const auto is_letter = [](char c) { return (c | 32) >= 'a' && (c | 32) <= 'z'; };
    while (word > begin && is_letter(text[word]) && is_letter(text[word - 1])) --word;
    const std::string shown = shown_at(text, word);
    const char* const reason = shown.starts_with("N") || shown.starts_with("Inf") ||
                                       shown.starts_with("nan") || shown.starts_with("inf")
                                   ? ", as JSON has no NaN and no infinity"
                                   : "";
    return fmt::format("is no valid JSON: line {}, column {}, at '{}'{}", line, word - begin + 1,
                       shown, reason);
}

std::string json_reason(const nlohmann::json::exception& error) {
    std::string what = error.what();
    if (const std::size_t end = what.find("] "); what.starts_with('[') && end != what.npos)
        what.erase(0, end + 2);
    if (what.starts_with("parse error")) return "is no valid JSON";
    if (const std::size_t key = what.find("key '"), end = what.find("' not found");
        key != what.npos && end != what.npos)
        return fmt::format("lacks '{}'", what.substr(key + 5, end - key - 5));
    if (const std::size_t index = what.find("array index "), end = what.find(" is out of range");
        index != what.npos && end != what.npos)
        return fmt::format("names entry {} of a list that is shorter",
                           what.substr(index + 12, end - index - 12));
    const std::size_t needed = what.find("type must be "), is = what.find(", but is ");
    if (needed != what.npos && is != what.npos)
        return fmt::format("holds {} where {} is needed", what.substr(is + 9),
                           what.substr(needed + 13, is - needed - 13));
    if (const std::size_t with = what.find(" with "); what.starts_with("cannot use "))
        return with == what.npos ? "holds a value of another type than is needed"
                                 : fmt::format("holds {} where an object or a list is needed",
                                               what.substr(with + 6));
    return what;
}

nlohmann::json parse_json_text(std::string_view text, const std::string& where,
                               const std::string& hint) {
    try {
        return nlohmann::json::parse(text);
    } catch (const nlohmann::json::parse_error& error) {
        throw Error(where, json_fault(text, error), hint);
    } catch (const nlohmann::json::exception& error) {  // a number beyond the range of double
        std::string reason = json_reason(error);
        const std::size_t quote = reason.find('\'');
        if (reason.starts_with("number overflow") && quote != reason.npos)
            reason = fmt::format("holds a number that is too large: {}...",
                                 printable(reason.substr(quote + 1, kShown)));
        throw Error(where, reason, hint);
    }
}

double positive_number(const nlohmann::json& object, const char* key) {
    if (!object.is_object() || !object.contains(key) || !object[key].is_number()) return 0;
    const double value = object[key].get<double>();
    return std::isfinite(value) && value > 0 ? value : 0;
}

}  // namespace darb
