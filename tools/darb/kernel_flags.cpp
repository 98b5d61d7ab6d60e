#include "tools/darb/kernel_flags.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "engine/core/error.h"
#include "engine/kernels/kernel_family.h"

namespace darb {

std::vector<int> kernels_from_list(const std::string& option, const std::string& list) {
    std::vector<int> kernels;
    const auto add = [&](int kernel) {
        if (std::find(kernels.begin(), kernels.end(), kernel) == kernels.end())
            kernels.push_back(kernel);
    };
    if (list == "all" || list == "paper") {
        const int count = list == "all" ? KERNEL_COUNT : KERNEL_INVERSE_QUADRATIC + 1;
        for (int kernel = 0; kernel < count; ++kernel) add(kernel);
        return kernels;
    }
    std::istringstream names(list);
    for (std::string name; std::getline(names, name, ',');) {
        const auto kernel = kernel_from_name(name);
        if (!kernel)
            throw Error(option + " " + name, "no such kernel", "There are " + kernel_names() + ".");
        if (*kernel >= KERNEL_COUNT)
            throw Error(option + " " + name, "has more than one pulse",
                        fmt::format("Write {}: darb train and compare have --pulses, and darb psi "
                                    "lists more pulses below its table.",
                                    kernel_name(kernel_with_pulses(*kernel, 1).value())));
        add(*kernel);
    }
    if (kernels.empty()) throw Error(option, "names no kernel", "Write all, or names with commas.");
    return kernels;
}

std::string kernel_names() {
    std::string names;
    for (int k = 0; k < KERNEL_COUNT; ++k)
        names += (k == 0 ? "" : ", ") + std::string(kernel_name(k));
    return names;
}

}  // namespace darb
