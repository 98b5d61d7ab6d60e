// SPDX-License-Identifier: MIT
#include "engine/kernels/kernel_words.h"

#include <fmt/format.h>

#include "engine/core/error.h"
#include "engine/kernels/kernel_expression.h"
#include "engine/kernels/kernel_family.h"
#include "engine/kernels/kernel_file.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/shaped_kernel.h"

namespace darb {

namespace {

int registered_with_notes(const KernelDefinition& definition, std::vector<std::string>& notes) {
    const int kernel = register_kernel(definition);
    for (const std::string& note : definition.notes)
        notes.push_back(fmt::format("kernel {}: {}", kernel_name(kernel), note));
    return kernel;
}

}  // namespace

int kernel_of_word(const std::string& option, const std::string& word,
                   std::vector<std::string>& notes) {
    if (is_kernel_expression(word))
        return registered_with_notes(kernel_from_expression(word, option), notes);
    const auto kernel = kernel_from_name(word);
    if (!kernel)
        throw Error(option + " " + word, "no such kernel",
                    "There are " + kernel_names() + ", and \"expr: (1 - q/9)^3, support 9\".");
    if (kernel_pulses(*kernel) > 1)
        throw Error(option + " " + word, "has more than one pulse",
                    fmt::format("Write {}: darb train and compare have --pulses, and darb psi "
                                "lists more pulses below its table.",
                                kernel_name(kernel_with_pulses(*kernel, 1).value())));
    return *kernel;
}

int kernel_of_option(const std::string& word, std::vector<std::string>& notes) {
    const std::vector<std::string> items = split_kernel_list(word);
    if (items.size() != 1)
        throw Error("--kernel " + word, fmt::format("names {} kernels", items.size()),
                    "One is wanted here.");
    return kernel_of_word("--kernel", items.front(), notes);
}

std::vector<int> kernels_of_file(const std::filesystem::path& path,
                                 std::vector<std::string>& notes) {
    std::vector<int> kernels;
    for (const KernelDefinition& definition : read_kernel_file(path)) try {
            kernels.push_back(registered_with_notes(definition, notes));
        } catch (const Error& e) {
            throw Error(path.string() + ": " + e.where, e.reason, e.hint);
        }
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
