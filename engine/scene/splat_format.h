// What is known of a format of splat files: its row in the table of splat_file.h. Only the
// formats themselves and splat_file.cpp include this.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/splat_file.h"

namespace darb {

/// What a reader gets.
struct SplatSource {
    std::span<const std::byte> bytes;
    std::string where;             // the file's name, in errors
    std::filesystem::path folder;  // of files beside it; empty: there are none to be read
    ReadProgress progress;         // may be empty
    ReadPoints read_points = {};   // of a PLY that is a point cloud; may be empty
    StoredUnits units = {};        // that parse_splats applies to what is read
};

/// What a format has a place for beyond Gaussians with their harmonics; bits.
enum SplatFeature : unsigned {
    kKeepsKernel = 1,  // and footprint
    kKeepsRenderMode = 2,
    kKeepsHarmonics = 4,
    kKeepsDoublePositions = 8,  // or `cuts` says what becomes of them
    kKeepsUnturned = 16,        // splats without a rotation, which are not drawn
    kKeepsShape = 32,           // of each splat; what does not refuses a kernel with shapes
};

struct SplatFormatRow {
    const char* name;  // in sentences
    /// What a name ends in that asks for this format when writing; without a dot at its beginning:
    /// the whole name. The longest that fits wins.
    std::vector<std::string> endings;
    /// The file that a folder is known by which is a scene of this format; null: none is.
    const char* folder_file = nullptr;
    /// By content; null: the reader of another row finds it. Throws Error as parse does.
    bool (*recognise)(const SplatSource&) = nullptr;
    /// Throws Error naming file, place, reason and remedy. Sets what it knows of `file`.
    SplatModel (*parse)(const SplatSource&, SplatFile& file) = nullptr;
    /// null: the format is not written. The model has been through drop_unwritable.
    EncodedSplats (*encode)(const SplatModel&, const std::string& where,
                            const EncodeOptions&) = nullptr;
    unsigned keeps = 0;  // SplatFeature
    /// What lies beyond its ranges, a sentence each; null: nothing does. Throws as encode does.
    std::vector<std::string> (*cuts)(const SplatModel&, const std::string& where) = nullptr;
    /// How many EncodeOptions::precision counts; null: one.
    int (*precisions)(const SplatModel&) = nullptr;
};

#define DARB_SPLAT_FORMAT(name) const SplatFormatRow& name##_format();
DARB_SPLAT_FORMATS(DARB_SPLAT_FORMAT)
#undef DARB_SPLAT_FORMAT

/// Whether the bytes begin with the text.
bool starts_with(std::span<const std::byte> bytes, std::string_view text);

}  // namespace darb
