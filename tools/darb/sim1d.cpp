// SPDX-License-Identifier: MIT
// darb sim1d: the paper's one-dimensional study of kernels.

#include <fmt/format.h>

#include <memory>
#include <sstream>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/core/system.h"
#include "tools/darb/command_list.h"
#include "tools/darb/flags.h"
#include "tools/darb/outputs.h"
#include "tools/paper/study1d.h"

namespace darb {

namespace {

struct Sim1dFlags {
    std::string kernels = "all", signals = "all";
    bool quiet = false;
    Study1dOptions study;
    std::vector<std::filesystem::path> kernel_files;
    std::filesystem::path json, html, paper;
};

std::vector<int> signals_from_list(const std::string& list) {
    std::vector<int> signals;
    std::istringstream names(list);
    for (std::string name; std::getline(names, name, ',');) {
        const std::size_t before = signals.size();
        std::string known;
        for (std::size_t s = 0; s < signals_1d().size(); ++s) {
            const std::string one(signals_1d()[s].name);
            known += (s == 0 ? "" : ", ") + one;
            if (name == one || name == "all") signals.push_back(static_cast<int>(s));
        }
        if (signals.size() == before)
            throw Error("--signals " + name, "no such signal", "There are " + known + ".");
    }
    if (signals.empty()) throw Error("--signals", "names none", "Name some, with commas, or all.");
    return signals;
}

std::vector<int> kernels_1d_from_list(const std::string& list,
                                      const std::vector<std::filesystem::path>& files) {
    const std::string generalised(kernel_1d_name(kGeneralisedExponential));
    if (list == generalised) return {kGeneralisedExponential};
    const bool ends = list.ends_with("," + generalised);
    std::vector<int> kernels = kernels_from_list(
        "--kernels", ends ? list.substr(0, list.size() - generalised.size() - 1) : list, files);
    if (ends || list == "all") kernels.push_back(kGeneralisedExponential);
    return kernels;
}

int sim1d(Sim1dFlags flags) {
    refuse_to_overwrite_inputs({flags.json, flags.html}, flags.kernel_files);
    check_paper_folder(flags.paper);
    flags.study.kernels = kernels_1d_from_list(flags.kernels, flags.kernel_files);
    flags.study.signals = signals_from_list(flags.signals);
    const bool shown = !flags.quiet && is_terminal(stderr);
    const Study1dResult result = study_1d(flags.study, [&](std::size_t done, std::size_t all) {
        if (shown && (done % 20 == 0 || done == all))
            say_text(fmt::format("\r{} of {} runs{}", done, all, done == all ? "\n" : ""));
    });
    write_json(flags.json, study_1d_json(result));
    if (!flags.html.empty() || !flags.paper.empty()) {
        const Report report = study_1d_report(result);
        if (!flags.html.empty()) write_file_atomic(flags.html, report.page());
        write_paper(flags.paper, report, flags.kernel_files);
    }
    tell(stream_beside_json(flags.json, flags.quiet), "{}", study_1d_table(result));
    tell_paths(flags.quiet, {flags.json, flags.html, flags.paper});
    return 0;
}

}  // namespace

void add_sim1d(CLI::App& app, Action& action) {
    auto flags = std::make_shared<Sim1dFlags>();
    CLI::App* command =
        app.add_subcommand("sim1d", "Fit signals by sums of N kernels: the paper's study in 1D");
    command->add_option("--signals", flags->signals, "names with commas, or all")
        ->capture_default_str();
    command
        ->add_option("--kernels", flags->kernels,
                     "names and expressions with commas, generalised_exponential last; or all")
        ->capture_default_str();
    add_kernel_file_flag(*command, flags->kernel_files);
    Study1dOptions& study = flags->study;
    command->add_option("-N,--primitives", study.primitives, "numbers of kernels, with commas")
        ->delimiter(',')
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    command->add_option("--seeds", study.seeds, "runs of each")
        ->capture_default_str()
        ->check(CLI::Range(1, 10'000));
    command->add_option("--steps", study.fit.steps, "steps of Adam")
        ->capture_default_str()
        ->check(CLI::Range(1, 10'000'000));
    command->add_option("--samples", study.fit.samples, "samples on [-10, 10]")
        ->capture_default_str()
        ->check(CLI::Range(16, 1'000'000));
    command->add_option("--lr", study.fit.learning_rate, "learning rate of Adam")
        ->capture_default_str()
        ->check(above_zero());
    command
        ->add_option("--target", study.target_share,
                     "loss whose time is reported, as a share of the signal's mean square")
        ->capture_default_str()
        ->check(above_zero());
    command->add_option("--threads", study.threads, "0: one per core")
        ->capture_default_str()
        ->check(zero_or_more());
    add_json_option(*command, flags->json);
    command->add_option("--html", flags->html, "write a page with plots to this file");
    add_paper_option(*command, flags->paper);
    add_quiet_flag(*command, flags->quiet);
    command->callback([flags, &action] { action = [flags] { return sim1d(*flags); }; });
}

}  // namespace darb
