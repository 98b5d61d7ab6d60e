// SPDX-License-Identifier: MIT
// darb psi: the correction factor of a kernel, computed in three ways, and how far its splats are
// from the true projection.

#include <fmt/format.h>

#include <memory>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "tools/darb/command_list.h"
#include "tools/darb/flags.h"
#include "tools/darb/outputs.h"
#include "tools/paper/psi_report.h"

namespace darb {

namespace {

struct PsiFlags {
    std::string kernels = "all";
    PsiGridOptions grid;
    std::vector<std::filesystem::path> kernel_files;
    std::filesystem::path json, html, paper;
    bool quiet = false;
};

int psi(const PsiFlags& flags) {
    refuse_to_overwrite_inputs({flags.json, flags.html}, flags.kernel_files);
    check_paper_folder(flags.paper);
    std::vector<PsiResult> results;
    std::vector<const DerivedKernel*> kernels;
    const std::vector<int> list = kernels_from_list("--kernel", flags.kernels, flags.kernel_files);
    for (const int k : list) {
        kernels.push_back(&derived_kernel(k));
        results.push_back(measure_psi(*kernels.back(), flags.grid));
    }
    const std::vector<KernelFit> fits = fits_of(list);
    nlohmann::json numbers = psi_json(results, flags.grid);
    numbers["in_the_shaders"] = fits_json(fits);
    numbers["shapes"] = shapes_json(list);
    write_json(flags.json, numbers);
    if (!flags.html.empty() || !flags.paper.empty()) {
        const Report report = psi_report(results, kernels, fits, flags.grid);
        if (!flags.html.empty()) write_file_atomic(flags.html, report.page());
        write_paper(flags.paper, report, flags.kernel_files);
    }
    tell(stream_beside_json(flags.json, flags.quiet), "{}{}{}", psi_table(results),
         fits_table(fits), shapes_table(list));
    tell_paths(flags.quiet, {flags.json, flags.html, flags.paper});
    return 0;
}

}  // namespace

void add_psi(CLI::App& app, Action& action) {
    auto flags = std::make_shared<PsiFlags>();
    CLI::App* command = app.add_subcommand("psi",
                                           "Compute the correction factor of a kernel in three "
                                           "ways, and compare its splats with the truth");
    command
        ->add_option("--kernel,--kernels", flags->kernels,
                     "names and expressions with commas, or all")
        ->capture_default_str();
    add_kernel_file_flag(*command, flags->kernel_files);
    command
        ->add_option("--samples", flags->grid.samples,
                     "random covariances to integrate on the grid")
        ->capture_default_str()
        ->check(CLI::Range(1, 100'000));
    command->add_option("--cells", flags->grid.cells, "cells of the grid along each axis")
        ->capture_default_str()
        ->check(CLI::Range(8, 1024));
    command->add_option("--seed", flags->grid.seed)->capture_default_str();
    add_json_option(*command, flags->json);
    command->add_option("--html", flags->html, "write a page with plots to this file");
    add_paper_option(*command, flags->paper);
    add_quiet_flag(*command, flags->quiet);
    command->callback([flags, &action] { action = [flags] { return psi(*flags); }; });
}

}  // namespace darb
