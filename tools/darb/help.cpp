#include "tools/darb/help.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "trainer/options/option_table.h"

namespace darb {

namespace {

constexpr std::size_t kNames = 30;  // columns of the options' names

std::size_t terminal_width() {
    winsize size{};
    long columns = 80;
    if (const char* given = std::getenv("COLUMNS"))
        columns = std::strtol(given, nullptr, 10);
    else if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0)
        columns = size.ws_col;
    return static_cast<std::size_t>(std::clamp(columns, 60L, 100L));
}

/// Words into lines; those after the first are indented. at: the column where the text begins.
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
            return is_for_few(a) < is_for_few(b);  // those of many users first
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
    for (const char* few : {help_group::kSaving, help_group::kAccuracy, help_group::kDevice,
                            option_group::kPhotos, option_group::kRates, option_group::kDensity,
                            option_group::kLimits, option_group::kStart, option_group::kEffects})
        if (group == few) return true;
    return false;
}

std::shared_ptr<CLI::Formatter> make_help_formatter() {
    return std::make_shared<HelpFormatter>();
}

}  // namespace darb
