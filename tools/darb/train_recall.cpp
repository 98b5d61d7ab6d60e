#include "tools/darb/train_recall.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string_view>

#include "engine/core/error.h"
#include "engine/core/files.h"

namespace darb {

namespace {

constexpr const char* kReplacement = "\xef\xbf\xbd";  // U+FFFD, of bytes that are no UTF-8
constexpr const char* kRemedy = "Repeat the whole command with --resume.";
constexpr std::array<std::string_view, 11> kBeside{
    "--resume", "-o",      "-m",     "--output", "--model-path", "--device",
    "-q",       "--quiet", "--view", "--tune",   "--retune"};

void check_typed(const std::vector<std::string>& typed) {
    for (const std::string& word : typed) {
        const std::string_view name = std::string_view(word).substr(0, word.find('='));
        if (name.starts_with('-') &&
            std::find(kBeside.begin(), kBeside.end(), name) == kBeside.end())
            throw Error(word, "is not taken beside --resume without the data set", kRemedy);
    }
}

std::vector<std::string> saved_arguments(const std::filesystem::path& path) {
    const auto saved = nlohmann::json::parse(read_text_file(path), nullptr, false);
    const auto is_text = [](const nlohmann::json& word) { return word.is_string(); };
    if (!saved.is_array() || !std::all_of(saved.begin(), saved.end(), is_text))
        throw Error(path.string(), "is no list of arguments", kRemedy);
    const auto arguments = saved.get<std::vector<std::string>>();
    for (const std::string& argument : arguments)
        if (argument.find(kReplacement) != std::string::npos)
            throw Error(
                path.string(),
                fmt::format("'{}' is not as it was typed: JSON holds UTF-8 alone", argument),
                kRemedy);
    return arguments;
}

}  // namespace

std::string command_text(std::vector<std::string> arguments, const std::string& dataset) {
    const std::string absolute = std::filesystem::absolute(dataset).string();
    for (std::string& word : arguments) {
        if (word == dataset) word = absolute;
        if (word.starts_with('-') && word.ends_with("=" + dataset))
            word.replace(word.size() - dataset.size(), dataset.size(), absolute);
    }
    return nlohmann::json(arguments).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void recall_arguments(const std::vector<std::string>& typed, TrainFlags& flags, TuneFlags& tune) {
    check_typed(typed);
    const std::filesystem::path path = flags.run.output / "command.json";
    const std::vector<std::string> arguments = saved_arguments(path);
    TrainFlags recalled;
    TuneFlags recalled_tune;
    CLI::App app;
    CLI::App* command = app.add_subcommand("train");
    add_train_flags(*command, recalled);
    add_tune_flags(*command, recalled_tune);
    try {
        app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    } catch (const CLI::ParseError& e) {
        throw Error(path.string(), e.what(), kRemedy);
    }
    if (recalled.dataset.empty()) throw Error(path.string(), "names no data set", kRemedy);
    recalled.resume = true;
    recalled.run.output = flags.run.output;
    if (!flags.device.empty()) recalled.device = flags.device;
    recalled.run.quiet = flags.run.quiet;
    recalled.view = flags.view;
    flags = recalled;
    if (tune.choice.empty()) tune.choice = recalled_tune.choice;
}

}  // namespace darb
