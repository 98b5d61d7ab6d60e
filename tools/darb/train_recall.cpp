#include "tools/darb/train_recall.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string_view>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "tools/darb/numbers.h"
#include "trainer/portable_path.h"

namespace darb {

namespace {

constexpr const char* kReplacement = "\xef\xbf\xbd";  // U+FFFD, of bytes that are no UTF-8
constexpr const char* kRemedy = "Repeat the whole command with --resume.";
constexpr std::array<std::string_view, 12> kBeside{
    "--resume", "-o",      "-m",     "--output", "--model-path", "--device",
    "-q",       "--quiet", "--view", "--tune",   "--retune",     "--verbose"};

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

namespace {

bool is_one_of(std::string_view name, std::initializer_list<std::string_view> names) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

// What an option with a path gets in its place; paths are relative to the output folder, that of
// photos to the data set.
std::string shared_value(std::string_view option, const std::string& value,
                         const TrainFlags& flags) {
    if (is_one_of(option, {"-o", "-m", "--output", "--model-path"})) return ".";
    if (is_one_of(option, {"-i", "--images"}))
        return value.starts_with('/') ? seen_from(flags.dataset, value).string() : value;
    return seen_from(flags.run.output, value).string();
}

bool takes_path(std::string_view option) {
    return is_one_of(option, {"-o", "-m", "--output", "--model-path", "-s", "--source-path",
                              "--start-checkpoint", "--kernel-file", "-i", "--images"});
}

// The word that is the data set, where no option names it: the first one behind "train", or one
// that no option is before.
size_t place_of_dataset(const std::vector<std::string>& arguments, const std::string& dataset) {
    if (arguments.size() > 1 && arguments[1] == dataset) return 1;
    size_t first = arguments.size();
    for (size_t i = arguments.size(); i-- > 1;)
        if (arguments[i] == dataset) {
            first = i;
            if (!arguments[i - 1].starts_with('-')) return i;
        }
    return first;
}

}  // namespace

std::string command_text(std::vector<std::string> arguments, const TrainFlags& flags) {
    const std::filesystem::path& output = flags.run.output;
    bool named = false;  // the data set, by an option
    for (size_t i = 0; i < arguments.size(); ++i) {
        std::string& word = arguments[i];
        const size_t equals = word.find('=');
        const std::string name = word.substr(0, equals), attached = word.substr(0, 2);
        named = named || is_one_of(name, {"-s", "--source-path"});
        if (takes_path(name) && equals != std::string::npos) {
            word = name + "=" + shared_value(name, word.substr(equals + 1), flags);
        } else if (takes_path(name) && i + 1 < arguments.size()) {
            arguments[i + 1] = shared_value(name, arguments[i + 1], flags);
            ++i;
        } else if (takes_path(attached) && word.size() > 2) {
            named = named || attached == "-s";
            word = attached + shared_value(attached, word.substr(2), flags);
        }
    }
    if (!named)
        if (const size_t at = place_of_dataset(arguments, flags.dataset); at < arguments.size())
            arguments[at] = seen_from(output, flags.dataset).string();
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
        refuse_no_numbers(arguments);
        app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    } catch (const std::runtime_error& e) {  // of the parser, or Error
        throw Error(path.string(), e.what(), kRemedy);
    }
    if (recalled.dataset.empty()) throw Error(path.string(), "names no data set", kRemedy);
    const auto there = [&](const std::filesystem::path& seen) {
        return seen.empty() ? seen : std::filesystem::weakly_canonical(flags.run.output / seen);
    };
    recalled.dataset = there(recalled.dataset).string();
    recalled.start_checkpoint = there(recalled.start_checkpoint);
    for (std::filesystem::path& file : recalled.kernel.files) file = there(file);
    recalled.resume = true;
    recalled.run.output = flags.run.output;
    if (!flags.device.empty()) recalled.device = flags.device;
    recalled.run.quiet = flags.run.quiet;
    recalled.view = flags.view;
    flags = recalled;
    if (tune.choice.empty()) tune.choice = recalled_tune.choice;
}

}  // namespace darb
