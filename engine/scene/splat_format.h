// SPDX-License-Identifier: MIT
// What is known about a format of splat files: its row in the table of splat_file.h. Only the
// formats themselves and splat_file.cpp include this.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/splat_file.h"

namespace darb {

/// The input of a reader.
struct SplatSource {
    std::span<const std::byte> bytes;
    std::string where;             // the file's name, in errors
    std::filesystem::path folder;  // where files beside it are; empty: none can be read
    ReadProgress progress;         // may be empty
    ReadPoints read_points = {};   // for a PLY that is a point cloud; may be empty
    StoredUnits units = {};        // parse_splats applies these to the result
};

/// What a format can store beyond Gaussians; bits.
enum SplatFeature : unsigned {
    kKeepsKernel = 1,  // and the footprint
    kKeepsRenderMode = 2,
    kKeepsHarmonics = 4,
    kKeepsDoublePositions = 8,  // or `cuts` says what happens to them
    kKeepsUnturned = 16,        // splats without a rotation, which are never drawn
    kKeepsShape = 32,           // one per splat; other formats refuse kernels with shapes
    kKeepsUnit = 64,            // metres_per_unit
    kKeepsPlace = 128,          // on earth
};

struct SplatFormatRow {
    const char* name;  // as in sentences
    /// File name endings that ask for this format when writing; one without a leading dot is a
    /// whole file name. The longest that matches wins.
    std::vector<std::string> endings;
    /// The file by which a folder is recognised as a scene of this format; null: there is none.
    const char* folder_file = nullptr;
    /// Recognises the content; null: another row's reader finds it. Throws Error as parse does.
    bool (*recognise)(const SplatSource&) = nullptr;
    /// Sets what it knows about `file`. Throws Error naming file, place, reason and remedy.
    SplatModel (*parse)(const SplatSource&, SplatFile& file) = nullptr;
    /// null: the format cannot be written. The model has been through drop_unwritable.
    EncodedSplats (*encode)(const SplatModel&, const std::string& where,
                            const EncodeOptions&) = nullptr;
    unsigned keeps = 0;       // SplatFeature
    bool has_levels = false;  // of detail: StoredUnits::level chooses one
    /// What exceeds the format's ranges, one sentence each; null: nothing can. Throws as encode
    /// does.
    std::vector<std::string> (*cuts)(const SplatModel&, const std::string& where) = nullptr;
    /// How many values EncodeOptions::precision has; null: one.
    int (*precisions)(const SplatModel&) = nullptr;
};

#define DARB_SPLAT_FORMAT(name) const SplatFormatRow& name##_format();
DARB_SPLAT_FORMATS(DARB_SPLAT_FORMAT)
#undef DARB_SPLAT_FORMAT

/// The level of detail to read of a file that has so many. Throws Error where it has not the one
/// that was asked for.
std::size_t level_to_read(const SplatSource& source, std::size_t levels);
/// For SplatFile::notes, where the finest of several levels is read and nobody asked for one.
std::string level_note(std::size_t levels);

/// Whether the bytes begin with `text`.
bool starts_with(std::span<const std::byte> bytes, std::string_view text);

}  // namespace darb
