// darb psi: the correction factor of a kernel three ways, and how far its splats are from the true
// projection.

#include <fmt/format.h>

#include <memory>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "tools/darb/command_list.h"
#include "tools/darb/kernel_flags.h"
#include "tools/darb/outputs.h"
#include "tools/paper/psi_report.h"

namespace darb {

namespace {

struct PsiFlags {
    std::string kernels = "all";
    PsiGridOptions grid;
    std::filesystem::path json, html;
};

int psi(const PsiFlags& flags) {
    refuse_to_overwrite_inputs({flags.json, flags.html}, {});
    std::vector<PsiResult> results;
    std::vector<const DerivedKernel*> kernels;
    for (const int k : kernels_from_list("--kernel", flags.kernels)) {
        kernels.push_back(&derived_kernel(k));
        results.push_back(measure_psi(*kernels.back(), flags.grid));
    }
    fmt::print("{}", psi_table(results));
    if (!flags.json.empty())
        write_file_atomic(flags.json, psi_json(results, flags.grid).dump(2) + "\n");
    if (!flags.html.empty()) write_file_atomic(flags.html, psi_html(results, kernels, flags.grid));
    return 0;
}

}  // namespace

void add_psi(CLI::App& app, Action& action) {
    auto flags = std::make_shared<PsiFlags>();
    CLI::App* command = app.add_subcommand(
        "psi", "The correction factor of a kernel three ways, and its splats beside the truth");
    command->add_option("--kernel,--kernels", flags->kernels, "names with commas, or all")
        ->capture_default_str();
    command->add_option("--samples", flags->grid.samples, "random covariances of the grid")
        ->capture_default_str()
        ->check(CLI::Range(1, 100'000));
    command->add_option("--cells", flags->grid.cells, "of the grid, along each axis")
        ->capture_default_str()
        ->check(CLI::Range(8, 1024));
    command->add_option("--seed", flags->grid.seed)->capture_default_str();
    command->add_option("--json", flags->json, "write every number to this file");
    command->add_option("--html", flags->html, "write a page with plots to this file");
    command->callback([flags, &action] { action = [flags] { return psi(*flags); }; });
}

}  // namespace darb
