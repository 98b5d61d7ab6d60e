// SPDX-License-Identifier: MIT
#include "trainer/options/option_table.h"

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/text.h"
#include "engine/plan/effect_plan.h"
#include "trainer/options/memory_size.h"
#include "trainer/options/strategy.h"

namespace darb {

namespace {

using Json = nlohmann::json;

template <class T>
struct ValueOf {
    using Type = T;
};
template <class T>
struct ValueOf<std::optional<T>> {
    using Type = T;
};
template <class Member>
struct MemberOf;
template <class T>
struct MemberOf<T TrainOptions::*> {
    using Field = T;
    using Value = typename ValueOf<T>::Type;
};

Error bad_value(const OptionRow& row, OptionKind kind, const std::string& text,
                const std::string& what) {
    const std::string usual = default_text(row);
    return Error(option_name(row) + " " + text, what,
                 fmt::format("It takes {}{}.", limits_text(row, kind),
                             usual.empty() ? "" : "; default: " + usual));
}

double real_number(const OptionRow& row, OptionKind kind, const std::string& text) {
    char* end = nullptr;
    double number = std::strtod(text.c_str(), &end);
    if (end == text.c_str()) throw bad_value(row, kind, text, "is no number");
    if (row.is_size) {
        const auto bytes = parse_bytes(text);
        if (!bytes) throw bad_value(row, kind, text, "has no unit of bytes");
        number = *bytes;
    } else if (*end != '\0') {
        throw bad_value(row, kind, text, "is no number");
    }
    if (!std::isfinite(number)) throw bad_value(row, kind, text, "is no finite number");
    return number;
}

template <class T>
T number_of(const OptionRow& row, const std::string& text) {
    const OptionKind kind = row.is_size             ? OptionKind::size
                            : std::is_integral_v<T> ? OptionKind::whole
                                                    : OptionKind::real;
    const double real = real_number(row, kind, text);
    if (real < row.least || real > row.most)
        throw bad_value(row, kind, text, fmt::format("must be {}", limits_text(row, kind)));
    if constexpr (std::is_integral_v<T>) {
        if (row.is_size) return static_cast<T>(real);
        T whole{};
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), whole);
        if (error == std::errc() && end == text.data() + text.size()) return whole;
        if (real != std::floor(real)) throw bad_value(row, kind, text, "is no whole number");
        if (real >= static_cast<double>(std::numeric_limits<T>::max()))
            throw bad_value(row, kind, text, "is too large");
        return static_cast<T>(real);  // 1e4
    } else {
        if (std::abs(real) > double{std::numeric_limits<float>::max()})
            throw bad_value(row, kind, text, "is too large");
        return static_cast<T>(std::strtold(text.c_str(), nullptr));
    }
}

std::string number_text(double value) {
    if (value == std::floor(value) && std::abs(value) < 1e15) return fmt::format("{:.0f}", value);
    return fmt::format("{:.6g}", value);
}

}  // namespace

const OptionRow& option_row(std::string_view flag) {
    for (const OptionRow& row : option_rows()) {
        const std::string flags = "," + std::string(row.flags) + ",";
        if (flags.find("," + std::string(flag) + ",") != std::string::npos) return row;
    }
    throw Error(std::string(flag), "is no option of training", "darb train --help-all lists them.");
}

std::string option_name(const OptionRow& row) {
    const std::string flags = row.flags;
    std::string name;
    for (std::size_t at = 0; at < flags.size();) {
        const std::size_t end = std::min(flags.find(',', at), flags.size());
        const std::string one = flags.substr(at, end - at);
        if (name.empty() || (one.starts_with("--") && !name.starts_with("--"))) name = one;
        at = end + 1;
    }
    return name;
}

std::string default_text(const OptionRow& row) {
    if (*row.usual != '\0') return row.usual;
    const TrainOptions defaults;
    const std::string value = std::visit(
        [&](auto member) -> std::string {
            if constexpr (std::is_same_v<decltype(member), std::monostate>) {
                return "";
            } else {
                using Field = typename MemberOf<decltype(member)>::Field;
                const Field& field = defaults.*member;
                if constexpr (std::is_same_v<Field, bool>)
                    return field ? "on" : "off";
                else if constexpr (std::is_arithmetic_v<Field>)
                    return number_text(static_cast<double>(field));
                else
                    return field ? number_text(static_cast<double>(*field)) : "none";
            }
        },
        row.member);
    return *row.unit == '\0' ? value : fmt::format("{} {}", value, row.unit);
}

OptionKind option_kind(const OptionRow& row) {
    if (row.is_size) return OptionKind::size;
    return std::visit(
        [](auto member) {
            if constexpr (std::is_same_v<decltype(member), std::monostate>) {
                return OptionKind::text;
            } else {
                using Value = typename MemberOf<decltype(member)>::Value;
                return std::is_same_v<Value, bool> ? OptionKind::on_off
                       : std::is_integral_v<Value> ? OptionKind::whole
                                                   : OptionKind::real;
            }
        },
        row.member);
}

std::string limits_text(const OptionRow& row, OptionKind kind) {
    if (kind == OptionKind::on_off) return "on or off";
    if (kind == OptionKind::text) return "text";
    const char* what = kind == OptionKind::size    ? "a size as 800MB or 1.5GB,"
                       : kind == OptionKind::whole ? "a whole number"
                                                   : "a number";
    if (row.most < 1e18)
        return fmt::format("{} from {} to {}", what, number_text(row.least), number_text(row.most));
    const bool open = row.least > 0 && row.least < 1e-29;
    return fmt::format("{} {}", what,
                       open ? "above 0" : fmt::format("of at least {}", number_text(row.least)));
}

std::string limits_text(const OptionRow& row) {
    return limits_text(row, option_kind(row));
}

bool option_on(const OptionRow& row, const std::string& text) {
    if (text == "on" || text == "true" || text == "1") return true;
    if (text == "off" || text == "false" || text == "0") return false;
    throw bad_value(row, OptionKind::on_off, text, "is neither on nor off");
}

int option_whole(const OptionRow& row, const std::string& text) {
    return number_of<int>(row, text);
}

double option_real(const OptionRow& row, const std::string& text) {
    return number_of<double>(row, text);
}

void set_option(const OptionRow& row, const std::string& text, TrainOptions& options) {
    std::visit(
        [&](auto member) {
            using Member = decltype(member);
            if constexpr (!std::is_same_v<Member, std::monostate>) {
                using Value = typename MemberOf<Member>::Value;
                if constexpr (std::is_same_v<Value, bool>)
                    options.*member = option_on(row, text);
                else
                    options.*member = number_of<Value>(row, text);
            }
        },
        row.member);
}

Json member_json(const OptionRow& row, const TrainOptions& options) {
    Json json;
    std::visit(
        [&](auto member) {
            using Member = decltype(member);
            if constexpr (!std::is_same_v<Member, std::monostate>) {
                if constexpr (std::is_arithmetic_v<typename MemberOf<Member>::Field>)
                    json = options.*member;
                else if (options.*member)
                    json = *(options.*member);
            }
        },
        row.member);
    return json;
}

void set_member(const OptionRow& row, const Json& value, TrainOptions& options) {
    const std::string text = value.is_boolean() ? (value.get<bool>() ? "on" : "off") : value.dump();
    const bool is_switch = std::holds_alternative<bool TrainOptions::*>(row.member);
    if (!value.is_null()) {
        if (!(is_switch ? value.is_boolean() : value.is_number()))
            throw Error(option_name(row) + " " + text, "is of another type",
                        fmt::format("It takes {}.", limits_text(row)));
        return set_option(row, text, options);
    }
    std::visit(
        [&](auto member) {
            using Member = decltype(member);
            if constexpr (!std::is_same_v<Member, std::monostate>) {
                if constexpr (std::is_arithmetic_v<typename MemberOf<Member>::Field>)
                    throw Error(option_name(row), "has no value",
                                fmt::format("It takes {}.", limits_text(row)));
                else
                    (options.*member).reset();
            }
        },
        row.member);
}

void use_3dgs_schedule(TrainOptions& options) {
    for (const OptionRow& row : option_rows()) {
        if (!row.in_3dgs) continue;
        std::visit(
            [&](auto member) {
                using Member = decltype(member);
                if constexpr (!std::is_same_v<Member, std::monostate>) {
                    using Value = typename MemberOf<Member>::Value;
                    options.*member = static_cast<Value>(*row.in_3dgs);
                }
            },
            row.member);
    }
}

Json settings_json(const Schedule& schedule) {
    const TrainOptions& options = schedule.options;
    Json settings = Json::object();
    for (const OptionRow& row : option_rows()) {
        if (*row.setting == '\0' || (row.stands && !row.stands(options, schedule))) continue;
        Json& place = settings[Json::json_pointer(row.setting)];
        if (row.resolved) {
            place = row.resolved(options, schedule);
            continue;
        }
        std::visit(
            [&](auto member) {
                using Member = decltype(member);
                if constexpr (!std::is_same_v<Member, std::monostate>)
                    if constexpr (std::is_arithmetic_v<typename MemberOf<Member>::Field>)
                        place = options.*member;
            },
            row.member);
    }
    for (const ProjectionSwitch& p : kProjectionSwitches)
        if (p.effect != kNoEffect && p.effect != EFFECT_ANTIALIAS)
            settings["effects"][effect_name(p.effect)] = options.projection.*p.on;
    return settings;
}

}  // namespace darb
