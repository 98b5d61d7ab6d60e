// What the runs of a comparison have in common, as its files say it: no folder of the machine.
#include <fmt/format.h>

#include "tools/darb/compare_flags.h"
#include "trainer/portable_path.h"

namespace darb {

namespace fs = std::filesystem;

std::vector<fs::path> paths_in_options(const CompareFlags& flags) {
    std::vector<std::string> words = CLI::detail::split_up(flags.train_options);
    words.insert(words.end(), flags.forwarded.begin(), flags.forwarded.end());
    std::vector<fs::path> paths;
    std::error_code none;
    for (const std::string& word : words) {
        const fs::path value = word.starts_with('-') ? word.substr(word.find('=') + 1) : word;
        if (value.is_absolute() || (value.has_parent_path() && fs::exists(value, none)))
            paths.push_back(value);
    }
    return paths;
}

std::string settings_of(const CompareFlags& flags) {
    std::string words;
    for (const std::string& word : flags.forwarded) words += " " + word;
    if (!flags.train_options.empty()) words += " " + flags.train_options;
    for (const fs::path& path : paths_in_options(flags))
        if (const auto at = words.find(path.string()); at != std::string::npos)
            words.replace(at, path.string().size(), shared_name(flags.output, path));
    const std::string growth =
        flags.max_splats > 0
            ? fmt::format("Growth stops at {} splats.", flags.max_splats)
            : "Equal densification threshold, so each kernel has its own number of splats.";
    return fmt::format("{} Options of training:{}.", growth,
                       words.empty() ? " the defaults" : words);
}

}  // namespace darb
