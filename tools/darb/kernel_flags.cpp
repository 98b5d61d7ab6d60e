#include "tools/darb/kernel_flags.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"
#include "engine/kernels/kernel_expression.h"
#include "engine/kernels/kernel_file.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/scene/splat_shapes.h"
#include "tools/darb/outputs.h"

namespace darb {

namespace {

int registered(const KernelDefinition& definition) {
    const int kernel = register_kernel(definition);
    for (const std::string& note : definition.notes)
        say_note(fmt::format("note: kernel {}: {}", kernel_name(kernel), note));
    return kernel;
}

int kernel_of_item(const std::string& option, const std::string& item) {
    if (is_kernel_expression(item)) return registered(kernel_from_expression(item, option));
    const auto kernel = kernel_from_name(item);
    if (!kernel)
        throw Error(option + " " + item, "no such kernel",
                    "There are " + kernel_names() + ", and \"expr: (1 - q/9)^3, support 9\".");
    if (kernel_pulses(*kernel) > 1)
        throw Error(option + " " + item, "has more than one pulse",
                    fmt::format("Write {}: darb train and compare have --pulses, and darb psi "
                                "lists more pulses below its table.",
                                kernel_name(kernel_with_pulses(*kernel, 1).value())));
    return *kernel;
}

}  // namespace

CLI::Option* add_kernel_file_flag(CLI::App& command, std::vector<std::filesystem::path>& files) {
    return command
        .add_option("--kernel-file", files,
                    "JSON with kernels of your own, by expression or table (docs/kernels.md)")
        ->allow_extra_args(false);
}

void add_kernel_flags(CLI::App& command, KernelFlags& flags, const std::string& help,
                      const std::string& group) {
    command.add_option("--kernel", flags.kernel, help)->group(group);
    add_kernel_file_flag(command, flags.files)->group(group);
}

std::vector<int> kernels_of_files(const std::vector<std::filesystem::path>& files) {
    std::vector<int> kernels;
    for (const std::filesystem::path& path : files)
        for (const KernelDefinition& definition : read_kernel_file(path)) try {
                kernels.push_back(registered(definition));
            } catch (const Error& e) {
                throw Error(path.string() + ": " + e.where, e.reason, e.hint);
            }
    return kernels;
}

std::optional<int> chosen_kernel(const KernelFlags& flags) {
    const std::vector<int> of_files = kernels_of_files(flags.files);
    if (flags.kernel.empty())
        return of_files.empty() ? std::nullopt : std::optional(of_files.back());
    const std::vector<std::string> items = split_kernel_list(flags.kernel);
    if (items.size() != 1)
        throw Error("--kernel " + flags.kernel, fmt::format("names {} kernels", items.size()),
                    "One is wanted here.");
    return kernel_of_item("--kernel", items.front());
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
        if (!whole) add(kernel_of_item(option, item));
    }
    for (const int kernel : of_files) add(kernel);
    if (kernels.empty()) throw Error(option, "names no kernel", "Write all, or names with commas.");
    return kernels;
}

std::string shaped_kernel_names() {
    std::string names;
    for (const int k : shaped_kernels()) names += std::string(kernel_name(k)) + ", ";
    return names + "blend:FIRST,SECOND";
}

std::string kernel_names() {
    std::string names;
    for (const int k : known_kernels()) names += std::string(kernel_name(k)) + ", ";
    return names + shaped_kernel_names();
}

}  // namespace darb
