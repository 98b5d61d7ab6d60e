// SPDX-License-Identifier: MIT
// SOG version 2 (Spatially Ordered Gaussians, PlayCanvas): meta.json and lossless WebP images with
// one pixel per splat, in a folder or in a zip. Source: developer.playcanvas.com, "The SOG format".
//   means_l, means_u        low and high byte of 16 bits between mins and maxs of
//                           sign(x) ln(1 + |x|)
//   scales, sh0             r g b index a codebook of 256 log scales, or dc; alpha of sh0: opacity
//   quats                   the three smaller components of w x y z; alpha: 252 + the largest
//   shN_labels              r + 256 g: the row of the palette
//   shN_centroids           64 palette entries a row, 3, 8 or 15 pixels each, indices of a codebook
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/splat_file.h"
#include "engine/scene/splat_model.h"

namespace darb {

struct SogFacts {
    int version = 0;
    std::string generator;           // as the file names it; may be empty
    std::size_t dropped = 0;         // splats with NaN or infinity
    std::vector<std::string> notes;  // how the file departs from the format, one sentence each
    double position_step = 0;        // world units, where half of the splats are
};

/// Whether the bytes begin like a zip.
bool looks_like_zip(std::span<const std::byte> file);

/// zip: the bytes of a .sog file. Throws Error naming the entry and the reason; sizes are checked
/// before allocating.
SplatModel parse_sog(std::span<const std::byte> zip, const std::string& where,
                     SogFacts* facts = nullptr);

/// folder: holds meta.json. Throws Error naming the file and the reason.
SplatModel read_sog_folder(const std::filesystem::path& folder, SogFacts* facts = nullptr);

/// Encodes a zip or, where `where` is a meta.json, that and its pictures beside it; in Morton
/// order. The error of ln(1 + |x|) of a position is half of 1/65,535 of its range, of opacity
/// 1/510, of a quaternion's component 3e-3. Scales and colours become the nearest of 256 values,
/// harmonics the nearest of 1,024 to 65,536 palette entries. The format cannot store kernel and
/// footprint.
EncodedSplats encode_sog(const SplatModel& model, const std::string& where,
                         const EncodeOptions& options);
/// Without Morton order: `file` is meta.json, and its pictures are in `beside`.
EncodedSplats encode_sog_parts(const SplatModel& model, const std::string& where,
                               const EncodeOptions& options);

/// Loads one level of a streamed SOG scene, by its lod-meta.json; 0 is the finest. Returns no
/// splats where there is no such level. Throws Error as load_splats does.
SplatModel load_streamed_level(const std::filesystem::path& lod_meta, std::size_t level);
/// The level of a file beside lod-meta.json, by the name that darb gives it.
std::size_t level_of_part(const std::string& name);

}  // namespace darb
