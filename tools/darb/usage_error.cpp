// What the commands say to a command line that they do not take.
#include <fmt/format.h>

#include <algorithm>

#include "tools/darb/help.h"

namespace darb {

namespace {

// Letters to change, add or take away (Levenshtein).
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

}  // namespace darb
