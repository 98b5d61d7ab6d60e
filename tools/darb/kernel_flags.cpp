#include "tools/darb/kernel_flags.h"

#include <algorithm>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/kernels/kernel_expression.h"
#include "engine/scene/splat_shapes.h"
#include "trainer/job/request_options.h"

namespace darb {

CLI::Option* add_kernel_file_flag(CLI::App& command, std::vector<std::filesystem::path>& files) {
    return command.add_option("--kernel-file", files, request_option("--kernel-file").row.help)
        ->allow_extra_args(false);
}

void add_kernel_flags(CLI::App& command, KernelFlags& flags, const std::string& help,
                      const std::string& group) {
    command.add_option("--kernel", flags.kernel, help)->group(group);
    add_kernel_file_flag(command, flags.files)->group(group);
}

std::vector<int> kernels_of_files(const std::vector<std::filesystem::path>& files) {
    std::vector<int> kernels;
    std::vector<std::string> notes;
    for (const std::filesystem::path& path : files)
        for (const int kernel : kernels_of_file(path, notes)) kernels.push_back(kernel);
    say_notes(notes);
    return kernels;
}

std::optional<int> chosen_kernel(const KernelFlags& flags) {
    const std::vector<int> of_files = kernels_of_files(flags.files);
    if (flags.kernel.empty())
        return of_files.empty() ? std::nullopt : std::optional(of_files.back());
    std::vector<std::string> notes;
    const int kernel = kernel_of_option(flags.kernel, notes);
    say_notes(notes);
    return kernel;
}

SplatModel in_kernel(const KernelFlags& flags, SplatModel model) {
    set_kernel(model, chosen_kernel(flags).value_or(model.kernel));
    if (!has_exact_footprint(model.kernel)) model.footprint = Footprint::psi;
    return model;
}

std::vector<int> kernels_from_list(const std::string& option, const std::string& list,
                                   const std::vector<std::filesystem::path>& files) {
    std::vector<int> kernels;
    const auto add = [&](int kernel) {
        if (std::find(kernels.begin(), kernels.end(), kernel) == kernels.end())
            kernels.push_back(kernel);
    };
    const std::vector<int> of_files = kernels_of_files(files);
    for (const std::string& item : split_kernel_list(list)) {
        const bool whole = item == "all" || item == "paper";
        const int count = item == "all" ? KERNEL_COUNT : KERNEL_INVERSE_QUADRATIC + 1;
        for (int kernel = 0; kernel < count && whole; ++kernel) add(kernel);
        std::vector<std::string> notes;
        if (!whole) add(kernel_of_word(option, item, notes));
        say_notes(notes);
    }
    for (const int kernel : of_files) add(kernel);
    if (kernels.empty()) throw Error(option, "names no kernel", "Write all, or names with commas.");
    return kernels;
}

}  // namespace darb
