#include "engine/scene/splat_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <new>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/text.h"
#include "engine/scene/compressed_ply.h"
#include "engine/scene/dot_splat.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/ply.h"
#include "engine/scene/ply_table.h"
#include "engine/scene/quantise.h"
#include "engine/scene/sog.h"
#include "engine/scene/spz.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

using Bytes = std::span<const std::byte>;

bool starts_with(Bytes bytes, std::string_view text) {
    return bytes.size() >= text.size() &&
           std::equal(text.begin(), text.end(), bytes.begin(),
                      [](char c, std::byte b) { return std::byte(c) == b; });
}

std::string encoding_of(const PlyHeader& header) {
    if (header.format == PlyFormat::ascii) return "ascii";
    return header.format == PlyFormat::big_endian ? "binary, big-endian" : "binary, little-endian";
}

SplatModel load_ply(Bytes bytes, const std::string& where, SplatFile& file,
                    const ReadProgress& progress) {
    const PlyHeader header = parse_ply_header(bytes, where);
    file.format = is_compressed_ply(header) ? SplatFormat::compressed_ply : SplatFormat::ply;
    file.details = encoding_of(header);
    if (is_point_cloud(header))
        throw Error(where, "is a point cloud: its vertices have no opacity, scale and rotation",
                    "darb train starts from it where it lies beside the cameras; a viewer shows it "
                    "as points.");
    PlyFacts facts;
    SplatModel model = parse_ply(bytes, header, where, &facts, progress);
    file.dropped = facts.dropped;
    file.notes = facts.notes;
    return model;
}

SplatModel load_spz(Bytes bytes, const std::string& where, SplatFile& file) {
    SpzFacts facts;
    SplatModel model = parse_spz(bytes, where, &facts);
    file.format = SplatFormat::spz;
    file.version = facts.version;
    if (facts.sh_degree > model.sh_degree)
        file.notes.push_back(fmt::format("harmonics of degree {} were left out", facts.sh_degree));
    if (facts.extensions_cut)
        file.notes.push_back("what follows the splats is no whole extension record: left out");
    if (facts.extensions > 0) file.details = fmt::format("{} extensions", facts.extensions);
    file.dropped = drop_non_finite(model);  // version 1 stores float16
    return model;
}

void take(const SogFacts& facts, SplatFile& file) {
    file.format = SplatFormat::sog;
    file.version = facts.version;
    file.dropped = facts.dropped;
    file.notes = facts.notes;
    file.details += facts.generator.empty() ? "" : ", by " + facts.generator;
}

SplatModel load_sog(Bytes bytes, const std::string& where, SplatFile& file) {
    SogFacts facts;
    SplatModel model = parse_sog(bytes, where, &facts);
    file.details = "zip";
    take(facts, file);
    return model;
}

SplatModel load_folder(const fs::path& folder, SplatFile& file) {
    SogFacts facts;
    SplatModel model = read_sog_folder(folder, &facts);
    file.details = "folder";
    take(facts, file);
    for (const fs::directory_entry& entry : fs::directory_iterator(folder))
        if (entry.is_regular_file()) file.bytes += entry.file_size();
    return model;
}

SplatModel load_dot_splat(Bytes bytes, const std::string& where, SplatFile& file) {
    file.format = SplatFormat::dot_splat;
    return parse_dot_splat(bytes, where, &file.dropped);
}

}  // namespace

std::string_view format_name(SplatFormat format) {
    switch (format) {
        case SplatFormat::ply:
            return "PLY";
        case SplatFormat::compressed_ply:
            return "compressed PLY";
        case SplatFormat::dot_splat:
            return ".splat";
        case SplatFormat::spz:
            return "SPZ";
        case SplatFormat::sog:
            return "SOG";
    }
    return "";
}

bool is_sog_folder(const fs::path& path) {
    std::error_code none;
    return fs::is_regular_file(path / "meta.json", none);
}

bool is_point_cloud(Bytes bytes, const std::string& where) {
    return starts_with(bytes, "ply") && is_point_cloud(parse_ply_header(bytes, where));
}

bool is_point_cloud(const PlyHeader& header) {
    const PlyElement* vertex = header.find("vertex");
    return vertex && vertex->find("x") >= 0 && vertex->find("opacity") < 0 &&
           vertex->find("scale_0") < 0 && vertex->find("f_dc_0") < 0 && !is_compressed_ply(header);
}

SplatModel parse_splats(Bytes bytes, const std::string& where, SplatFile* file,
                        const ReadProgress& progress) {
    SplatFile unused;
    SplatFile& facts = file ? *file : unused;
    facts.bytes = bytes.size();
    if (starts_with(bytes, "ply\n") || starts_with(bytes, "ply\r"))
        return load_ply(bytes, where, facts, progress);
    if (looks_like_spz(bytes)) return load_spz(bytes, where, facts);
    if (looks_like_zip(bytes)) return load_sog(bytes, where, facts);
    if (lower(where).ends_with(".splat") || looks_like_dot_splat(bytes))
        return load_dot_splat(bytes, where, facts);
    if (fs::path(where).filename() == "lod-meta.json")
        throw Error(where, "describes a streamed SOG scene, in levels of detail, which is not read",
                    "Name the folder of one of its parts, which has a meta.json.");
    throw Error(
        where,
        bytes.empty() ? "is empty" : "is no splat file: no PLY, compressed PLY, .splat, SPZ or SOG",
        "Check the path, or export the scene in one of these formats.");
}

SplatModel load_splats(const fs::path& path, SplatFile* file) try {
    SplatFile unused;
    SplatFile& facts = file ? *file : unused;
    facts = {};
    if (is_sog_folder(path)) return load_folder(path, facts);
    if (path.filename() == "meta.json")
        return load_folder(path.has_parent_path() ? path.parent_path() : fs::path("."), facts);
    return parse_splats(read_file(path), path.string(), &facts);
} catch (const std::bad_alloc&) {
    throw Error(path.string(), "does not fit into the memory that is left",
                "Free memory, or prune the scene first.");
}

std::optional<SplatFormat> format_to_write(const fs::path& path) {
    const std::string name = lower(path.filename().string());
    if (name.ends_with(".compressed.ply")) return SplatFormat::compressed_ply;
    if (name.ends_with(".ply")) return SplatFormat::ply;
    if (name.ends_with(".splat")) return SplatFormat::dot_splat;
    if (name.ends_with(".spz")) return SplatFormat::spz;
    return std::nullopt;
}

std::vector<std::string> losses_of(SplatFormat format, const SplatModel& scene,
                                   const std::string& where) {
    std::vector<std::string> losses;
    if (format == SplatFormat::ply) {
        SplatModel finite;  // a copy of what is large only where it is needed
        if (!has_only_finite(scene)) finite = scene;
        if (const std::size_t count = drop_unwritable(format, finite); count > 0)
            losses.push_back(fmt::format("{} splats with NaN or infinity are left out", count));
        if (const glm::dvec3 to_0 = 0.0 - scene.origin; needs_double_positions(scene))
            losses.push_back(fmt::format(
                "positions are written as double, which few other programs read, as float32 does "
                "not resolve them: --translate {},{},{} brings the scene to 0",
                to_0.x, to_0.y, to_0.z));
        return losses;
    }
    SplatModel model = scene;
    if (const std::size_t count = drop_unwritable(format, model); count > 0)
        losses.push_back(
            fmt::format("{} splats with a rotation of length 0, NaN or infinity, which are not "
                        "drawn, are left out",
                        count));
    const std::string_view name = format_name(format);
    const bool has_comments = format == SplatFormat::compressed_ply;
    if (!has_comments && model.kernel != KERNEL_GAUSSIAN)
        losses.push_back(
            fmt::format("{} has no place for the kernel {} ({}): it will be drawn with "
                        "Gaussians",
                        name, kernel_name(model.kernel), footprint_name(model.footprint)));
    if (format == SplatFormat::dot_splat) {
        if (model.antialias)
            losses.push_back(".splat has no place for anti-aliasing (render mode mip)");
        if (model.sh_degree > 0)
            losses.push_back(fmt::format(".splat has no place for harmonics: degree {} becomes 0",
                                         model.sh_degree));
        if (const std::size_t count =
                count_outside(model.sh_dc, dc_of_colour(-1 / 510.0), dc_of_colour(1 + 1 / 510.0));
            count > 0)
            losses.push_back(fmt::format("{} colours outside 0 to 1 are cut to it", count));
    }
    const std::vector<std::string> cut = format == SplatFormat::spz ? spz_losses(model, where)
                                         : format == SplatFormat::compressed_ply
                                             ? compressed_ply_losses(model)
                                             : std::vector<std::string>{};
    losses.insert(losses.end(), cut.begin(), cut.end());
    if (format != SplatFormat::spz && model.origin != glm::dvec3(0.0))
        losses.push_back(
            fmt::format("{} has no place for double positions: they are rounded to float32", name));
    return losses;
}

std::size_t drop_unwritable(SplatFormat format, SplatModel& model) {
    if (format == SplatFormat::ply) return drop_non_finite(model);
    return drop_non_finite(model) +
           keep_splats([&](std::size_t i) { return has_rotation(model, i); }, model);
}

std::vector<std::byte> encode_splats(SplatFormat format, const SplatModel& model,
                                     const std::string& where) {
    if (format == SplatFormat::sog)
        throw Error(where, "SOG is several files, not one", "Use save_splats.");
    if (format == SplatFormat::ply && has_only_finite(model)) return encode_ply(model);
    SplatModel kept = model;
    drop_unwritable(format, kept);
    if (format == SplatFormat::ply) return encode_ply(kept);
    if (format == SplatFormat::compressed_ply) return encode_compressed_ply(kept);
    if (format == SplatFormat::dot_splat) return encode_dot_splat(kept);
    return encode_spz(kept, where);
}

void save_splats(const fs::path& path, SplatFormat format, const SplatModel& model) {
    write_file_atomic(path, encode_splats(format, model, path.string()));
}

}  // namespace darb
