// SPDX-License-Identifier: MIT
#include "trainer/job/request_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/text.h"

namespace darb {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

// Dashes before it gone, dashes within.
std::string plain_name(std::string_view name) {
    std::string plain(name.substr(std::min(name.find_first_not_of('-'), name.size())));
    std::replace(plain.begin(), plain.end(), '_', '-');
    return plain;
}

struct Found {
    const RequestOption* option = nullptr;
    bool opposite = false;  // the name is that of the flag for false
};

Found find_option(std::string_view name) {
    const std::string wanted = plain_name(name);
    if (wanted.empty()) return {};
    for (const RequestOption& option : request_options()) {
        const std::string_view flags = option.row.flags;
        for (std::size_t at = 0; at < flags.size();) {
            const std::size_t end = std::min(flags.find(',', at), flags.size());
            std::string_view one = flags.substr(at, end - at);
            const bool opposite = one.starts_with('!');
            if (opposite) one.remove_prefix(1);
            if (plain_name(one) == wanted) return {&option, opposite};
            at = end + 1;
        }
    }
    return {};
}

RequestPlace place_in(const RequestOption& option, TrainRequest& request) {
    return option.place == nullptr ? RequestPlace{} : option.place(request);
}

bool has_member(const RequestOption& option) {
    return !std::holds_alternative<std::monostate>(option.row.member);
}

void take_typed(const RequestOption& option, const std::string& text, TrainRequest& request) {
    const OptionRow& row = option.row;
    if (option.take) return option.take(request, text);
    if (has_member(option)) return set_option(row, text, request.train);
    const RequestPlace place = place_in(option, request);
    if (auto* const* on = std::get_if<bool*>(&place)) **on = option_on(row, text);
    if (auto* const* whole = std::get_if<int*>(&place)) **whole = option_whole(row, text);
    if (auto* const* words = std::get_if<std::string*>(&place)) **words = text;
    if (auto* const* path = std::get_if<fs::path*>(&place)) **path = text;
    if (auto* const* real = std::get_if<std::optional<double>*>(&place))
        **real = option_real(row, text);
    if (auto* const* list = std::get_if<std::vector<int>*>(&place)) {
        std::string one;
        for (const char c : text + " ") {
            if (c != ' ' && c != ',') {
                one += c;
                continue;
            }
            if (!one.empty()) (*list)->push_back(option_whole(row, one));
            one.clear();
        }
    }
}

Error of_another_type(const RequestOption& option, const Json& value) {
    return Error(option.key + " " + value.dump(), "is of another type",
                 fmt::format("It takes {}.", limits_text(option.row, option_kind(option))));
}

}  // namespace

const RequestOption& request_option(std::string_view name) {
    const Found found = find_option(name);
    if (found.option == nullptr) {
        const std::string plain = plain_name(name);
        throw Error((plain.size() == 1 ? "-" : "--") + plain, "is no option of training",
                    "`darb train --help-all` lists them.");
    }
    return *found.option;
}

OptionKind option_kind(const RequestOption& option) {
    if (has_member(option) || option.row.is_size) return option_kind(option.row);
    TrainRequest unused;
    const RequestPlace place = place_in(option, unused);
    if (std::holds_alternative<bool*>(place)) return OptionKind::on_off;
    if (std::holds_alternative<int*>(place) || std::holds_alternative<std::vector<int>*>(place))
        return OptionKind::whole;
    return std::holds_alternative<std::optional<double>*>(place) ? OptionKind::real
                                                                 : OptionKind::text;
}

void set_request_option(TrainRequest& request, std::string_view name, const std::string& text) {
    const RequestOption& option = request_option(name);
    const std::string own = option_name(option.row);
    if (text.empty())
        throw Error(own, "has an empty value", "Give a value, or leave the option out.");
    const bool opposite = find_option(name).opposite;
    take_typed(option, opposite ? (option_on(option.row, text) ? "off" : "on") : text, request);
    if (!was_given(request, own)) request.given.push_back(own);
}

void set_request_options(TrainRequest& request, const GivenOptions& given) {
    std::vector<std::pair<const RequestOption*, const std::pair<std::string, std::string>*>> sorted;
    sorted.reserve(given.size());
    for (const auto& one : given) sorted.emplace_back(&request_option(one.first), &one);
    std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
        if (a.first->before_others != b.first->before_others) return a.first->before_others;
        return a.first < b.first;
    });
    for (const auto& one : sorted)
        set_request_option(request, one.second->first, one.second->second);
}

bool was_given(const TrainRequest& request, std::string_view name) {
    const std::string own = option_name(request_option(name).row);
    return std::find(request.given.begin(), request.given.end(), own) != request.given.end();
}

Json saved_value(const RequestOption& option, const TrainRequest& request) {
    if (option.saved) return option.saved(request);
    if (has_member(option)) return member_json(option.row, request.train);
    TrainRequest copy = request;
    Json json;
    std::visit(
        [&](auto at) {
            using At = decltype(at);
            if constexpr (std::is_same_v<At, fs::path*>) {
                json = at->string();
            } else if constexpr (std::is_same_v<At, std::optional<double>*>) {
                if (*at) json = **at;
            } else if constexpr (!std::is_same_v<At, std::monostate>) {
                json = *at;
            }
        },
        place_in(option, copy));
    return json;
}

void restore_value(const RequestOption& option, const Json& value, TrainRequest& request) {
    if (has_member(option)) return set_member(option.row, value, request.train);
    if (option.restore || !option.place) {
        if (!value.is_string()) throw of_another_type(option, value);
        return option.restore ? option.restore(request, value) : option.take(request, value);
    }
    std::visit(
        [&](auto at) {
            using At = decltype(at);
            bool fits = true;
            if constexpr (std::is_same_v<At, bool*>) {
                if ((fits = value.is_boolean())) *at = value.get<bool>();
            } else if constexpr (std::is_same_v<At, int*>) {
                if ((fits = value.is_number_integer())) *at = value.get<int>();
            } else if constexpr (std::is_same_v<At, std::string*>) {
                if ((fits = value.is_string())) *at = value.get<std::string>();
            } else if constexpr (std::is_same_v<At, fs::path*>) {
                if ((fits = value.is_string())) *at = value.get<std::string>();
            } else if constexpr (std::is_same_v<At, std::optional<double>*>) {
                if ((fits = value.is_number() || value.is_null()))
                    *at = value.is_null() ? std::nullopt : std::optional(value.get<double>());
            } else if constexpr (std::is_same_v<At, std::vector<int>*>) {
                fits = value.is_array() &&
                       std::all_of(value.begin(), value.end(),
                                   [](const Json& i) { return i.is_number_integer(); });
                if (fits) *at = value.get<std::vector<int>>();
            }
            if (!fits) throw of_another_type(option, value);
        },
        place_in(option, request));
}

}  // namespace darb
