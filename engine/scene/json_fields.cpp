// SPDX-License-Identifier: MIT
#include "engine/scene/json_fields.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/text.h"

namespace darb {

namespace {

using nlohmann::json;

constexpr double kAnyNumber = std::numeric_limits<double>::max();

bool is_finite_number(const json& value) {
    return value.is_number() && std::isfinite(value.get<double>());
}

bool is_vector(const json& value, std::size_t size) {
    if (!value.is_array() || value.size() != size) return false;
    for (const json& v : value)
        if (!is_finite_number(v)) return false;
    return true;
}

}  // namespace

JsonFields::JsonFields(const json& json, std::string where, std::string hint)
    : json_(json), where_(std::move(where)), hint_(std::move(hint)) {
    if (!json_.is_object())
        throw Error(where_, fmt::format("holds {} where an object is needed", json_.type_name()),
                    hint_);
}

void JsonFields::refuse(const char* key, const std::string& reason) const {
    throw Error(place(key), reason, hint_);
}

std::string JsonFields::place(const char* key, std::size_t entry) const {
    return fmt::format("{}: {}[{}]", where_, key, entry);
}

const json& JsonFields::value(const char* key) {
    asked_.insert(key);
    const auto at = json_.find(key);
    if (at == json_.end()) throw Error(where_, fmt::format("lacks '{}'", key), hint_);
    return *at;
}

double JsonFields::number(const char* key, double low, double high) {
    const json& v = value(key);
    if (!is_finite_number(v)) refuse(key, "is not a finite number");
    const double number = v.get<double>();
    if (!(number >= low && number <= high))
        refuse(key, high == kAnyNumber
                        ? fmt::format("is {:g}, and {:g} is the least", number, low)
                        : fmt::format("is {:g}; {:g} to {:g} can be", number, low, high));
    return number;
}

double JsonFields::number(const char* key) {
    return number(key, -kAnyNumber, kAnyNumber);
}

double JsonFields::number_or(const char* key, double low, double high, double otherwise) {
    return has(key) ? number(key, low, high) : otherwise;
}

std::string JsonFields::text(const char* key) {
    const json& v = value(key);
    if (!v.is_string()) refuse(key, "is not a text");
    return v.get<std::string>();
}

std::string JsonFields::text_or(const char* key, const std::string& otherwise) {
    return has(key) ? text(key) : otherwise;
}

bool JsonFields::flag_or(const char* key, bool otherwise) {
    if (!has(key)) return otherwise;
    const json& v = value(key);
    if (!v.is_boolean()) refuse(key, "is neither true nor false");
    return v.get<bool>();
}

std::vector<double> JsonFields::numbers(const char* key, std::size_t count) {
    const json& v = value(key);
    if (!is_vector(v, count)) refuse(key, fmt::format("is not a list of {} numbers", count));
    return v.get<std::vector<double>>();
}

glm::dvec3 JsonFields::vector(const char* key) {
    const std::vector<double> v = numbers(key, 3);
    return {v[0], v[1], v[2]};
}

glm::dmat3 JsonFields::matrix(const char* key) {
    const std::vector<std::vector<double>> lines = rows(key, 3, 3);
    if (lines.size() != 3) refuse(key, "is not three rows of three numbers");
    glm::dmat3 m;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            m[column][row] = lines[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
    return m;
}

std::vector<std::vector<double>> JsonFields::rows(const char* key, std::size_t size,
                                                  std::size_t least) {
    const json& v = list(key);
    std::vector<std::vector<double>> rows;
    for (const json& row : v) {
        if (!is_vector(row, size))
            throw Error(place(key, rows.size()), fmt::format("is not a list of {} numbers", size),
                        hint_);
        rows.push_back(row.get<std::vector<double>>());
    }
    if (rows.size() < least)
        refuse(key, fmt::format("has {} entries, and {} are the least", rows.size(), least));
    return rows;
}

const json& JsonFields::list(const char* key) {
    static const json none = json::array();
    asked_.insert(key);
    if (!has(key)) return none;
    const json& v = value(key);
    if (!v.is_array()) refuse(key, "is not a list");
    return v;
}

JsonFields JsonFields::object(const char* key) {
    return {value(key), place(key), hint_};
}

void JsonFields::done() const {
    for (const auto& item : json_.items())
        if (!asked_.contains(item.key()))
            throw Error(where_, fmt::format("has the unknown key '{}'", printable(item.key())),
                        hint_);
}

json json_of(const glm::dvec3& v) {
    return {v.x, v.y, v.z};
}

json json_of(const glm::dmat3& m) {
    json rows = json::array();
    for (int row = 0; row < 3; ++row) rows.push_back({m[0][row], m[1][row], m[2][row]});
    return rows;
}

}  // namespace darb
