// SPDX-License-Identifier: MIT
// Any bytes as an LCC scene: a byte that says how long its index is, the index, then the
// description, beside data of three splats. A model or an Error, never a crash.
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/splat_model.h"
#include "tests/support/lcc_files.h"

namespace {

/// The folder stays.
std::filesystem::path make_folder() {
    const std::filesystem::path folder =
        std::filesystem::temp_directory_path() / ("lcc_fuzz_" + std::to_string(getpid()));
    darb::test::lcc_scene(folder, true).write();
    return folder;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const std::filesystem::path folder = make_folder();
    const auto file = std::as_bytes(std::span(data, size));
    const std::size_t index = size > 0 ? std::min<std::size_t>(data[0], size - 1) : 0;
    try {
        darb::write_file_atomic(folder / "Index.bin", file.subspan(size > 0 ? 1 : 0, index));
        darb::check_splat_shapes(darb::parse_splats(file.subspan(size > 0 ? 1 + index : 0),
                                                    "fuzz.lcc", nullptr, {}, folder));
    } catch (const darb::Error&) {
    }
    return 0;
}
