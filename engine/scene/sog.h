// SOG version 2 (Spatially Ordered Gaussians, PlayCanvas): meta.json and lossless WebP images, a
// pixel a splat, in a folder or in a zip. Source: developer.playcanvas.com, "The SOG format".
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
    std::string generator;           // as the file says; empty where it does not
    std::size_t dropped = 0;         // splats with NaN or infinity
    std::vector<std::string> notes;  // what was not as the format says, a sentence each
    double position_step = 0;        // world, where half of the splats are
};

/// Begins like a zip.
bool looks_like_zip(std::span<const std::byte> file);

/// The bytes of a .sog file. Throws Error naming the entry and the reason; sizes are checked before
/// allocating.
SplatModel parse_sog(std::span<const std::byte> zip, const std::string& where,
                     SogFacts* facts = nullptr);

/// The folder of meta.json. Throws Error naming the file and the reason.
SplatModel read_sog_folder(const std::filesystem::path& folder, SogFacts* facts = nullptr);

/// A zip, or, where `where` is a meta.json, that and its pictures beside it; in Morton order. The
/// error of ln(1 + |x|) of a position is half of 1/65,535 of its range, of opacity 1/510, of a
/// quaternion's component 3e-3; scales and colours are the nearest of 256, harmonics those of the
/// nearest of 1,024 to 65,536 palette entries. Kernel and footprint have no place.
EncodedSplats encode_sog(const SplatModel& model, const std::string& where,
                         const EncodeOptions& options);
/// Without the Morton order: file is meta.json, its pictures are beside it.
EncodedSplats encode_sog_parts(const SplatModel& model, const std::string& where,
                               const EncodeOptions& options);

/// One level of a streamed SOG scene, 0 the finest, by its lod-meta.json; without splats where it
/// has no such level. Throws Error as load_splats.
SplatModel load_streamed_level(const std::filesystem::path& lod_meta, std::size_t level);
/// The level that a file beside lod-meta.json is of, by the name that darb gives it.
std::size_t level_of_part(const std::string& name);

}  // namespace darb
