// SPDX-License-Identifier: MIT
// Any bytes as the lod-meta.json of a streamed SOG scene of one file: a model or an Error, never a
// crash.
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "engine/core/error.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/splat_model.h"

namespace {

/// A file of three splats, 0_0; the folder stays.
std::filesystem::path make_folder() {
    const std::filesystem::path folder =
        std::filesystem::temp_directory_path() / ("streamed_sog_fuzz_" + std::to_string(getpid()));
    darb::SplatModel model;
    model.resize(3);
    for (std::size_t i = 0; i < 3; ++i) model.rotation[4 * i] = 1;
    darb::save_splats(folder / "lod-meta.json", darb::SplatFormat::streamed_sog, model);
    return folder;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const std::filesystem::path folder = make_folder();
    const auto file = std::as_bytes(std::span(data, size));
    try {
        darb::check_splat_shapes(darb::parse_splats(file, "lod-meta.json", nullptr, {}, folder));
    } catch (const darb::Error&) {
    }
    return 0;
}
