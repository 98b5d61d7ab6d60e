// SPDX-License-Identifier: MIT
// The reference vectors of the kernels, computed elsewhere with 50 digits and rounded once to
// double. The file is named by DARB_KERNEL_VECTORS, else shared/reference/kernels.json beside the
// sources.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/kernels/kernel_family.h"

namespace darb::test {

struct KernelVector {
    int kernel = 0;
    int index = 0;  // place among its kernel's vectors in the file
    std::string tag;
    double a = 0, b = 0, c = 0, dx = 0, dy = 0;  // q = a dx^2 + 2 b dx dy + c dy^2; floats
    double opacity = 0, q = 0, w = 0, slope = 0, alpha = 0;
    double d_dx = 0, d_dy = 0, d_a = 0, d_b = 0, d_c = 0,
           d_opacity = 0;  // derivatives of opacity * w
};

inline std::filesystem::path kernel_vectors_path() {
    if (const char* path = std::getenv("DARB_KERNEL_VECTORS")) return path;
    return std::filesystem::path(DARB_SOURCE_DIR) / ".." / "shared" / "reference" / "kernels.json";
}

/// Nothing where the file is missing; throws where it is malformed or names an unknown kernel.
inline std::optional<std::vector<KernelVector>> load_kernel_vectors() {
    std::ifstream file(kernel_vectors_path());
    if (!file) return std::nullopt;
    std::vector<KernelVector> vectors;
    const nlohmann::json document = nlohmann::json::parse(file);
    for (const auto& [name, cases] : document.at("cases").items()) {
        // The file's half_cosine is this program's cosine.
        const int kernel = kernel_from_name(name == "half_cosine" ? "cosine" : name).value();
        int index = 0;
        for (const auto& row : cases) {
            const auto number = [&](const char* key) { return row.at(key).get<double>(); };
            const auto gradient = [&](const char* key) {
                return row.at("grad_passthrough").at(key).get<double>();
            };
            vectors.push_back({kernel, index++, row.at("tag"), number("a"), number("b"),
                               number("c"), number("dx"), number("dy"), number("opacity"),
                               number("q"), number("w"), number("dw_dq"), number("alpha"),
                               gradient("ddx"), gradient("ddy"), gradient("da"), gradient("db"),
                               gradient("dc"), gradient("dopacity")});
        }
    }
    return vectors;
}

}  // namespace darb::test
