// What the runs of a comparison have in common, as its files say it: no folder of the machine.
#include <fmt/format.h>

#include "engine/core/say.h"
#include "tools/darb/compare_flags.h"
#include "trainer/run/run_folder.h"
#include "trainer/step/checkpoint.h"
#include "trainer/step/rank_group.h"

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

void leave_folders_out(ComparedDataset& dataset, const CompareFlags& flags) {
    std::vector<std::filesystem::path> paths = paths_in_options(flags);
    paths.insert(paths.end(), {dataset_path(dataset.path.string()), flags.output});
    for (ComparedRun& run : dataset.runs)
        for (std::string* text : {&run.failure, &run.notes})
            for (const std::filesystem::path& path : paths) *text = without_folders(*text, path);
}

void check_same_runs(Ranks& ranks, const CompareFlags& flags, const std::string& dataset,
                     const std::vector<int>& kernels, const std::string& fingerprint,
                     const std::string& measurements) {
    if (ranks.count() == 1) return;
    std::string runs = fmt::format("with seeds {}, kernels", flags.seeds);
    for (const int kernel : kernels) runs += fmt::format(" {}", kernel_name(kernel));
    RankFacts facts = rank_facts();
    facts.emplace_back("data set", fingerprint.empty() ? "unread" : fingerprint);
    facts.emplace_back("runs", runs);
    facts.emplace_back("measurements", measurements);
    facts.emplace_back("settings",
                       settings_text(train_request_of(flags, dataset, kernels.front(), 0).train));
    check_same(ranks, facts);
}

std::optional<Lpips> load_lpips(const CompareFlags& flags, std::string& note) {
    note = "LPIPS was left out: no weights were given (--lpips FILE).";
    for (const auto& file : flags.lpips)
        if (!std::filesystem::exists(file)) {
            constexpr const char* left_out = "LPIPS was left out: {} does not exist.";
            note = fmt::format(left_out, file.filename().string());
            say("warning: {}\n", fmt::format(left_out, file.string()));
            return std::nullopt;
        }
    if (flags.lpips.empty()) return std::nullopt;
    std::optional<Lpips> lpips(std::in_place, flags.lpips, LpipsOptions{flags.lpips_as_3dgs, 0});
    note = fmt::format("LPIPS: {}, colours from {} to 1{}.", lpips->net_name(),
                       flags.lpips_as_3dgs ? "0" : "-1",
                       flags.lpips_as_3dgs ? " as in the evaluation of 3DGS" : "");
    return lpips;
}

}  // namespace darb
