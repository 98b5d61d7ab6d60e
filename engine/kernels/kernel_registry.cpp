// SPDX-License-Identifier: MIT
#include "engine/kernels/kernel_registry.h"

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <memory>
#include <mutex>

#include "engine/core/error.h"
#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/shaped_kernel.h"

namespace darb {
namespace {

// Per process; a hostile folder of files could go on for ever, and a run that learns its profile
// registers one at each change.
constexpr int kMostKernels = 10'000;
// The largest error of a footprint's fit that may be drawn: more would be visible beside the
// reference.
constexpr double kDrawable = 1e-6;

struct Registered {
    explicit Registered(KernelDefinition d)
        : definition(std::move(d)), row(profile_of(definition)), derived(row) {
        exact = row.form == KERNEL_FORM_GAUSSIAN ||
                fit_coefficients(derived, Footprint::exact, kFullDegree).value_error <= kDrawable;
    }
    KernelDefinition definition;
    KernelProfile row;
    DerivedKernel derived;
    bool exact = false;
};

/// Entries are written once, before `count` includes them, and never move.
struct Registry {
    std::mutex writing;
    std::array<std::unique_ptr<const Registered>, kMostKernels> entries;
    std::atomic<int> count = 0;
};

Registry& registry() {
    static Registry all;
    return all;
}

const Registered* registered(int kernel) {
    const int at = kernel - KERNEL_ROWS;
    Registry& all = registry();
    if (at < 0 || at >= all.count.load(std::memory_order_acquire)) return nullptr;
    return all.entries[static_cast<std::size_t>(at)].get();
}

}  // namespace

const KernelProfile& kernel_profile(int kernel) {
    if (const Registered* entry = registered(kernel)) return entry->row;
    if (blend_parts(kernel)) return blend_profile(kernel);
    return listed_profile(kernel);
}

const DerivedKernel& derived_kernel(int kernel) {
    static const auto kernels = [] {
        std::vector<DerivedKernel> all;
        for (int k = 0; k < KERNEL_ROWS; ++k) all.emplace_back(listed_profile(k));
        return all;
    }();
    if (const Registered* entry = registered(kernel)) return entry->derived;
    if (blend_parts(kernel))
        throw Error(std::string(kernel_name(kernel)),
                    "has no profile of its own: each splat blends its two kernels",
                    "Name one of the two.");
    static_cast<void>(listed_profile(kernel));  // throws for ids that do not exist
    return kernels[static_cast<std::size_t>(kernel)];
}

std::optional<int> kernel_from_name(std::string_view name) {
    for (int kernel = 0; kernel < KERNEL_ROWS; ++kernel)
        if (listed_profile(kernel).name == name) return kernel;
    for (int kernel = KERNEL_ROWS; const Registered* entry = registered(kernel); ++kernel)
        if (entry->definition.name == name) return kernel;
    return blend_from_name(name);
}

bool has_exact_footprint(int kernel) {
    const Registered* entry = registered(kernel);
    if (entry != nullptr) return entry->exact;
    if (const auto parts = blend_parts(kernel)) {
        // The slope of a quadric's line integral grows without bound at its edge. This matters
        // where the other kernel extends further, as w is then not below every cut-off there.
        const auto ends_inside = [](const KernelProfile& one, const KernelProfile& other) {
            return one.form == KERNEL_FORM_QUADRIC && one.support < other.support;
        };
        const KernelProfile &first = listed_profile((*parts)[0]),
                            &second = listed_profile((*parts)[1]);
        return !ends_inside(first, second) && !ends_inside(second, first);
    }
    const int form = listed_profile(kernel).form;
    return form != KERNEL_FORM_RINGS && form != KERNEL_FORM_EXPONENTIAL && form != KERNEL_FORM_GES;
}

const KernelDefinition* kernel_definition(int kernel) {
    const Registered* entry = registered(kernel);
    return entry != nullptr ? &entry->definition : nullptr;
}

std::vector<int> known_kernels() {
    std::vector<int> kernels;
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel) kernels.push_back(kernel);
    for (int kernel = KERNEL_ROWS; registered(kernel) != nullptr; ++kernel)
        kernels.push_back(kernel);
    return kernels;
}

int register_kernel(const KernelDefinition& definition) {
    Registry& all = registry();
    const std::scoped_lock lock(all.writing);
    if (const std::optional<int> known = kernel_from_name(definition.name)) {
        const KernelDefinition* other = kernel_definition(*known);
        if (other != nullptr && other->same_kernel(definition)) return *known;
        throw Error("kernel " + definition.name,
                    other == nullptr ? "is a name of the family"
                                     : "is the name of another kernel: " + other->source,
                    "Choose another name.");
    }
    check_definition(definition);
    const int count = all.count.load(std::memory_order_relaxed);
    if (count == kMostKernels)
        throw Error("kernel " + definition.name,
                    fmt::format("{} kernels are known already", kMostKernels),
                    "Start the program again.");
    all.entries[static_cast<std::size_t>(count)] = std::make_unique<const Registered>(definition);
    all.count.store(count + 1, std::memory_order_release);
    return KERNEL_ROWS + count;
}

int register_kernel(std::string_view name, double support, const std::function<double(double)>& w) {
    return register_kernel(define_kernel(name, support, w, "a function"));
}

int register_kernel_of_file(KernelDefinition definition, const std::string& where,
                            std::vector<std::string>& notes) {
    try {
        check_definition(definition);
        const std::string name = definition.name;
        for (int suffix = 2;; ++suffix) {
            const std::optional<int> known = kernel_from_name(definition.name);
            // The family may have got this name after the file was written.
            const KernelDefinition* other = known ? kernel_definition(*known) : nullptr;
            if (!known || (other != nullptr && other->same_kernel(definition))) break;
            definition.name = fmt::format("{}_{}", name.substr(0, kMostNameLength - 4), suffix);
        }
        if (definition.name != name)
            notes.push_back(
                fmt::format("its kernel {} is another than the one of this name: it is "
                            "called {} here",
                            name, definition.name));
        return register_kernel(definition);
    } catch (const Error& e) {
        throw Error(where, "its kernel: " + e.reason, e.hint);
    }
}

}  // namespace darb
