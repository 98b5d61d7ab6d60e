// SPDX-License-Identifier: MIT
#include "tools/darb/help.h"

#include <fmt/format.h>
#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "engine/core/system.h"
#include "trainer/options/option_table.h"

namespace darb {

namespace {

constexpr std::size_t kNames = 30;  // columns for the names of options

std::size_t terminal_width() {
    long columns = 80;
    if (const char* given = std::getenv("COLUMNS"))
        columns = std::strtol(given, nullptr, 10);
    else if (const int shown = terminal_columns(); shown > 0)
        columns = shown;
    return static_cast<std::size_t>(std::clamp(columns, 60L, 100L));
}

/// Breaks words into lines, of which all but the first are indented. at: the column where the text
/// begins.
std::string wrapped(const std::string& text, std::size_t at, std::size_t indent) {
    const std::size_t width = terminal_width();
    std::istringstream words(text);
    std::string lines, word;
    for (std::size_t column = at; words >> word; column += word.size()) {
        if (column > indent && column + 1 + word.size() > width) {
            lines += "\n" + std::string(indent, ' ');
            column = indent;
        } else if (!lines.empty()) {
            lines += " ";
            ++column;
        }
        lines += word;
    }
    return lines;
}

std::string entry(const std::string& names, const std::string& text, std::size_t indent) {
    std::string line = "  " + names;
    if (line.size() + 2 > indent)
        line += "\n" + std::string(indent, ' ');
    else
        line.resize(indent, ' ');
    return line + wrapped(text, indent, indent) + "\n";
}

std::string names_of(const CLI::Option& option, bool all) {
    std::string names;
    if (option.get_positional()) return option.get_name(true);
    const auto add = [&](const char* dashes, const std::vector<std::string>& list) {
        for (std::size_t i = 0; i < (all ? list.size() : std::min<std::size_t>(list.size(), 1));
             ++i)
            names += (names.empty() ? "" : ", ") + (dashes + list[i]);
    };
    add("-", option.get_snames());
    add("--", option.get_lnames());
    return names;
}

class HelpFormatter : public CLI::Formatter {
  public:
    std::string make_help(const CLI::App* app, std::string name,
                          CLI::AppFormatMode mode) const override {
        const bool all = mode == CLI::AppFormatMode::All;
        std::string text = wrapped(app->get_description(), 0, 0) + "\n\n" + usage(*app, name);
        std::size_t left_out = 0;
        std::vector<std::string> groups = app->get_groups();
        std::stable_sort(groups.begin(), groups.end(), [](const auto& a, const auto& b) {
            return is_for_few(a) < is_for_few(b);  // options for many users come first
        });
        for (const std::string& group : groups) {
            const auto options = app->get_options(
                [&](const CLI::Option* option) { return option->get_group() == group; });
            if (group.empty() || options.empty()) continue;
            if (!all && is_for_few(group)) {
                left_out += options.size();
                continue;
            }
            text += "\n" + group + ":\n";
            for (const CLI::Option* option : options)
                text += entry(names_of(*option, all), described(*option), kNames);
        }
        text += commands(*app);
        if (left_out > 0) text += fmt::format("\n--help-all lists {} more options.\n", left_out);
        return text;
    }

  private:
    static std::string usage(const CLI::App& app, const std::string& name) {
        std::string line = "Usage: ";
        line += name.empty() ? app.get_name() : name;
        if (!app.get_subcommands({}).empty()) return line + " COMMAND [options]\n";
        for (const CLI::Option* option : app.get_options())
            if (option->get_positional()) {
                const std::string what = option->get_name(true);
                line += option->get_required() ? " " + what : " [" + what + "]";
            }
        return line + " [options]\n";
    }
    static std::string described(const CLI::Option& option) {
        std::string text = option.get_description();
        if (!option.get_default_str().empty())
            text += fmt::format(" [{}]", option.get_default_str());
        return text;
    }
    static std::string commands(const CLI::App& app) {
        std::string text, group;
        for (const CLI::App* one : app.get_subcommands({})) {
            if (one->get_group() != group) text += "\n" + one->get_group() + ":\n";
            group = one->get_group();
            text += entry(one->get_name(), one->get_description(), 12);
        }
        if (!text.empty()) text += "\n`darb COMMAND --help` has the options of each.\n";
        return text;
    }
};

}  // namespace

bool is_for_few(const std::string& group) {
    for (const char* few :
         {help_group::kSaving, help_group::kAccuracy, help_group::kDevice, option_group::kPhotos,
          option_group::kRates, option_group::kDensity, option_group::kLimits, option_group::kStart,
          option_group::kEffects, option_group::kRegion})
        if (group == few) return true;
    return false;
}

std::shared_ptr<CLI::Formatter> make_help_formatter() {
    return std::make_shared<HelpFormatter>();
}

// What darb answers to a command line that it does not accept.

namespace {

// How many letters to change, add or remove (Levenshtein).
std::size_t distance(const std::string& a, const std::string& b) {
    std::vector<std::size_t> row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t changed = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
            diagonal = row[j];
            row[j] = std::min({row[j] + 1, row[j - 1] + 1, changed});
        }
    }
    return row[b.size()];
}

const CLI::App& chosen(const CLI::App& app) {
    const auto parsed = app.get_subcommands();
    return parsed.empty() ? app : *parsed.front();
}

}  // namespace

std::string nearest_name(const std::string& word, const std::vector<std::string>& candidates) {
    std::string nearest;
    std::size_t least = std::max<std::size_t>(2, word.size() / 3) + 1;
    for (const std::string& candidate : candidates)
        if (const std::size_t d = distance(word, candidate); d < least) {
            least = d;
            nearest = candidate;
        }
    return nearest;
}

Error unknown_command(const CLI::App& app, const std::string& word) {
    std::vector<std::string> names;
    for (const CLI::App* one : app.get_subcommands({})) names.push_back(one->get_name());
    const std::string near = nearest_name(word, names);
    return {"darb " + word, "no such subcommand",
            (near.empty() ? "" : "Did you mean " + near + "? ") + "darb --help lists them."};
}

Error usage_error(const CLI::App& app, const CLI::ParseError& error) {
    const CLI::App& command = chosen(app);
    const std::string name =
        &command == &app ? app.get_name() : app.get_name() + " " + command.get_name();
    std::string hint =
        fmt::format("`{} --help{}` lists what it takes.", name, &command == &app ? "" : "-all");
    const std::vector<std::string> rest = app.remaining(true);
    if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr && !rest.empty()) {
        const std::string word = rest.front().substr(0, rest.front().find('='));
        std::vector<std::string> known;
        for (const CLI::Option* option : command.get_options())
            for (const std::string& one : option->get_lnames()) known.push_back("--" + one);
        const std::string near = word.starts_with("-") ? nearest_name(word, known) : "";
        if (!near.empty()) hint = fmt::format("Did you mean {}? {}", near, hint);
        return {name + " " + word,
                word.starts_with("-") ? "no such option" : "is one argument too many", hint};
    }
    const std::string text = error.what();
    const std::size_t colon = text.find(": ");
    if (text.starts_with("-") && colon != std::string::npos)
        return {name + " " + text.substr(0, colon), text.substr(colon + 2), hint};
    return {name, text, hint};
}

namespace {

// Reads "TEXT:{psi,exact}", as CLI11 describes a value that must be one of several.
nlohmann::json choices_of(const CLI::Option& option) {
    nlohmann::json choices = nlohmann::json::array();
    const std::string type = option.get_type_name();
    std::smatch found;
    static const std::regex kSet(R"(\{([^{}]*)\})");
    if (!std::regex_search(type, found, kSet)) return choices;
    for (const std::string& one : CLI::detail::split(found[1].str(), ',')) choices.push_back(one);
    return choices;
}

nlohmann::json option_json(const CLI::Option& option) {
    nlohmann::json names = nlohmann::json::array();
    for (const std::string& name : option.get_snames()) names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
    return {{"names", names},
            {"positional", option.get_positional() ? option.get_name(true) : ""},
            {"required", option.get_required()},
            {"takes_value", option.get_items_expected_max() > 0},
            {"choices", choices_of(option)},
            {"default", option.get_default_str()},
            {"help", option.get_description()},
            {"group", option.get_group()}};
}

nlohmann::json options_of(const CLI::App& app) {
    nlohmann::json options = nlohmann::json::array();
    for (const bool few : {false, true})  // options for many users come first
        for (const CLI::Option* option : app.get_options())
            if (!option->get_group().empty() && is_for_few(option->get_group()) == few)
                options.push_back(option_json(*option));
    return options;
}

}  // namespace

std::string options_json(const CLI::App& app) {
    nlohmann::json commands = nlohmann::json::array();
    for (const CLI::App* one : app.get_subcommands({}))
        commands.push_back({{"name", one->get_name()},
                            {"help", one->get_description()},
                            {"group", one->get_group()},
                            {"options", options_of(*one)}});
    const nlohmann::json all = {{"version", DARB_VERSION},
                                {"help", app.get_description()},
                                {"options", options_of(app)},
                                {"commands", commands}};
    return all.dump(1) + "\n";
}

}  // namespace darb
