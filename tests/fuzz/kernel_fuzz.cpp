// SPDX-License-Identifier: MIT
// Any bytes as a file of kernels and as the text of --kernel: kernels or an Error, never a crash.
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string_view>

#include "engine/core/error.h"
#include "engine/kernels/kernel_definition.h"
#include "engine/kernels/kernel_expression.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    try {
        for (const darb::KernelDefinition& kernel : darb::parse_kernel_file(text, "fuzz")) {
            const darb::KernelDefinition again =
                darb::definition_from_json(darb::definition_json(kernel), "again");
            DARB_CHECK(again.same_kernel(kernel), "{}", kernel.name);
        }
    } catch (const darb::Error&) {
    }
    for (const std::string& item : darb::split_kernel_list(text.substr(0, 200))) try {
            if (darb::is_kernel_expression(item)) darb::kernel_from_expression(item, "fuzz");
        } catch (const darb::Error&) {
        }
    return 0;
}
