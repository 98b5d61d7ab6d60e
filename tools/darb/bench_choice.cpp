#include "tools/darb/bench_choice.h"

#include <fmt/format.h>

#include <regex>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "trainer/job/scene_file.h"

namespace darb {

std::vector<BenchCase> chosen_cases(const std::string& what, const std::filesystem::path& dataset,
                                    bool full) {
    std::error_code none;
    if (!what.empty() && std::filesystem::exists(what, none))
        return own_cases(find_scene(what), dataset);
    if (!dataset.empty())
        throw Error(what, "is no scene", "Name a splat file: darb bench SCENE DATASET.");
    std::vector<BenchCase> cases = bench_cases(full);
    try {
        const std::regex filter(what);
        std::erase_if(cases,
                      [&](const BenchCase& one) { return !std::regex_search(one.name, filter); });
    } catch (const std::regex_error& e) {
        throw Error("darb bench " + what, fmt::format("is no regular expression: {}", e.what()),
                    "Use part of a name; darb bench --list shows them.");
    }
    if (cases.empty())
        throw Error("darb bench " + what, "fits no case",
                    "darb bench --list shows them; a scene of your own is a file.");
    return cases;
}

std::vector<BenchCase> possible_cases(std::vector<BenchCase> cases, const BenchOptions& options) {
    std::error_code error;
    std::erase_if(cases, [&](const BenchCase& one) {
        if (one.file.empty()) return false;
        if (options.data && std::filesystem::exists(*options.data / one.file, error)) return false;
        say("warning: {} is left out: no {}; name its folder with --data\n", one.name,
            ((options.data ? *options.data : "DATA") / one.file).string());
        return true;
    });
    return cases;
}

}  // namespace darb
