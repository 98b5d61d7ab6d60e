// SPDX-License-Identifier: MIT
#include "engine/scene/splat_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <new>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/text.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_format.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

#define DARB_SPLAT_FORMAT(name) SplatFormat::name,
constexpr std::array kSplatFormats{DARB_SPLAT_FORMATS(DARB_SPLAT_FORMAT)};
#undef DARB_SPLAT_FORMAT

const SplatFormatRow& row_of(SplatFormat format) {
    switch (format) {
#define DARB_SPLAT_FORMAT(name) \
    case SplatFormat::name:     \
        return name##_format();
        DARB_SPLAT_FORMATS(DARB_SPLAT_FORMAT)
#undef DARB_SPLAT_FORMAT
    }
    return ply_format();
}

/// "a, b or c".
std::string listed(const std::vector<std::string>& words) {
    std::string text;
    for (std::size_t i = 0; i < words.size(); ++i)
        text += (i == 0 ? "" : i + 1 < words.size() ? ", " : " or ") + words[i];
    return text;
}

bool ends_so(const std::string& name, const std::string& ending) {
    return ending.starts_with('.') ? name.ends_with(ending) : name == ending;
}

/// The scene without what cannot be written; where that is nothing, the scene itself, not a copy.
const SplatModel& writable(SplatFormat format, const SplatModel& scene, SplatModel& copy,
                           std::size_t& dropped) {
    dropped = 0;
    if ((row_of(format).keeps & kKeepsUnturned) && has_only_finite(scene)) return scene;
    copy = scene;
    dropped = drop_unwritable(format, copy);
    return copy;
}

void check_shape_has_a_place(const SplatFormatRow& row, const SplatModel& model,
                             const std::string& where) {
    if ((row.keeps & kKeepsShape) || !kernel_has_shape(model.kernel)) return;
    throw Error(where,
                fmt::format("{} cannot store the shape that each splat of the kernel {} has",
                            row.name, kernel_name(model.kernel)),
                "Write .ply, or the nearest Gaussians: darb convert --kernel gaussian.");
}

/// Applies what the user says about the values, and notes what they look like.
void settle_units(const StoredUnits& units, const std::string& where, SplatFile& facts,
                  SplatModel& model) {
    const bool by_channel =
        facts.format == SplatFormat::ply || facts.format == SplatFormat::compressed_ply;
    apply_stored_units(units, by_channel, where, model);
    for (std::string& doubt : unit_doubts(model, by_channel))
        facts.notes.push_back(std::move(doubt));
    if (std::string doubt = position_doubt(model, facts.position_step); !doubt.empty())
        facts.notes.push_back(std::move(doubt));
}

std::vector<std::string> missing_places(const SplatFormatRow& row, const SplatModel& model) {
    std::vector<std::string> losses;
    if (!(row.keeps & kKeepsKernel) && model.kernel != KERNEL_GAUSSIAN)
        losses.push_back(
            fmt::format("{} has no place for the kernel {} ({}): it will be drawn with Gaussians",
                        row.name, kernel_name(model.kernel), footprint_name(model.footprint)));
    if (!(row.keeps & kKeepsRenderMode) && model.antialias)
        losses.push_back(
            fmt::format("{} has no place for anti-aliasing (render mode mip)", row.name));
    if (!(row.keeps & kKeepsHarmonics) && model.sh_degree > 0)
        losses.push_back(fmt::format("{} has no place for harmonics: degree {} becomes 0", row.name,
                                     model.sh_degree));
    if (!(row.keeps & kKeepsUnit) && model.metres_per_unit > 0)
        losses.push_back(fmt::format("{} has no place for the scale (a unit is {:.4g} m)", row.name,
                                     model.metres_per_unit));
    if (!(row.keeps & kKeepsPlace) && model.place.known())
        losses.push_back(
            fmt::format("{} has no place for where the scene lies on earth", row.name));
    return losses;
}

}  // namespace

bool starts_with(std::span<const std::byte> bytes, std::string_view text) {
    return bytes.size() >= text.size() &&
           std::equal(text.begin(), text.end(), bytes.begin(),
                      [](char c, std::byte b) { return std::byte(c) == b; });
}

std::size_t level_to_read(const SplatSource& source, std::size_t levels) {
    const std::size_t level = source.units.level.value_or(0);
    if (level >= levels)
        throw Error(
            source.where,
            fmt::format("has {} of detail, no level {}",
                        levels == 1 ? "one level" : fmt::format("{} levels", levels), level),
            fmt::format("Use --lod 0, the finest{}, or leave it out.",
                        levels > 1 ? fmt::format(", to {}", levels - 1) : ""));
    return level;
}

std::string level_note(std::size_t levels) {
    return fmt::format("the finest level is read; --lod 1 to {} reads a coarser one", levels - 1);
}

std::string_view format_name(SplatFormat format) {
    return row_of(format).name;
}

std::optional<fs::path> scene_file_in(const fs::path& folder) {
    std::error_code none;
    for (const SplatFormat format : kSplatFormats)
        if (const char* const name = row_of(format).folder_file)
            if (fs::is_regular_file(folder / name, none)) return folder / name;
    return std::nullopt;
}

bool names_scene_folder(const fs::path& path) {
    return std::ranges::any_of(kSplatFormats, [&](SplatFormat format) {
        const char* const name = row_of(format).folder_file;
        return name && path.filename() == name;
    });
}

SplatModel parse_splats(std::span<const std::byte> bytes, const std::string& where, SplatFile* file,
                        const ReadProgress& progress, const fs::path& folder,
                        const ReadPoints& read_points, const StoredUnits& units) {
    SplatFile unused;
    SplatFile& facts = file ? *file : unused;
    facts.bytes = bytes.size();
    bool are_points = false;
    ReadPoints reader;
    if (read_points)
        reader = [&](const PlyHeader& header) {
            are_points = true;
            return read_points(header);
        };
    const SplatSource source{bytes, where, folder, progress, reader, units};
    for (const SplatFormat format : kSplatFormats) {
        const SplatFormatRow& row = row_of(format);
        if (!row.recognise || !row.recognise(source)) continue;
        facts.format = format;
        if (units.level && !row.has_levels)
            throw Error(where,
                        fmt::format("is {}, which has no levels of detail, and --lod {} asks "
                                    "for one",
                                    row.name, *units.level),
                        "Leave --lod out.");
        SplatModel model = row.parse(source, facts);
        if (!are_points) settle_units(units, where, facts, model);
        return model;
    }
    std::vector<std::string> names;
    for (const SplatFormat format : kSplatFormats) names.push_back(row_of(format).name);
    throw Error(where, bytes.empty() ? "is empty" : "is no splat file: no " + listed(names),
                "Check the path, or export the scene in one of these formats.");
}

SplatModel load_splats(const fs::path& path, SplatFile* file, const StoredUnits& units) try {
    SplatFile unused;
    SplatFile& facts = file ? *file : unused;
    facts = {};
    const std::optional<fs::path> inside = scene_file_in(path);
    const fs::path& scene = inside ? *inside : path;
    const fs::path folder = scene.has_parent_path() ? scene.parent_path() : fs::path(".");
    return parse_splats(read_file(scene), scene.string(), &facts, {}, folder, {}, units);
} catch (const std::bad_alloc&) {
    throw NoRoom(path.string(), "does not fit into the memory that is left",
                 "Free memory, or prune the scene first.");
}

const std::vector<std::string>& endings_of(SplatFormat format) {
    return row_of(format).endings;
}

namespace {

struct Asked {
    std::optional<SplatFormat> format;
    std::size_t ending = 0;  // its length
};

Asked asked_for(const fs::path& path) {
    const std::string name = lower(path.filename().string());
    Asked best;
    for (const SplatFormat format : kSplatFormats)
        for (const std::string& ending : row_of(format).endings)
            if (row_of(format).encode && ending.size() > best.ending && ends_so(name, ending))
                best = {format, ending.size()};
    return best;
}

}  // namespace

std::optional<SplatFormat> format_to_write(const fs::path& path) {
    return asked_for(path).format;
}

std::string stem_to_write(const fs::path& path) {
    const std::string name = path.filename().string();
    return name.substr(0, name.size() - asked_for(path).ending);
}

fs::path run_of_scene(const fs::path& file) {
    std::error_code none;
    const fs::path whole = fs::absolute(file, none).lexically_normal();
    const fs::path iteration = whole.parent_path(), clouds = iteration.parent_path();
    const bool is_run = whole.filename() == "point_cloud.ply" &&
                        iteration.filename().string().starts_with("iteration_") &&
                        clouds.filename() == "point_cloud";
    return is_run ? clouds.parent_path() : fs::path();
}

std::string scene_name(const fs::path& path, bool with_ending) {
    std::error_code none;
    fs::path whole = fs::absolute(path, none).lexically_normal();
    if (!whole.has_filename()) whole = whole.parent_path();  // the path ends in a slash
    if (names_scene_folder(whole)) whole = whole.parent_path();
    const fs::path run = run_of_scene(whole);
    if (!run.empty()) whole = run;
    std::string name = whole.filename().string();
    if (!with_ending && run.empty() && !fs::is_directory(whole, none)) {
        name = stem_to_write(whole);
        if (name == whole.filename().string()) name = whole.stem().string();
    }
    return name.empty() || name == "/" ? "Scene" : name;
}

bool names_scene(const fs::path& path) {
    const std::string name = lower(path.filename().string());
    return std::ranges::any_of(kSplatFormats, [&](SplatFormat format) {
        return std::ranges::any_of(row_of(format).endings, [&](const std::string& ending) {
            return ends_so(name, ending);
        });
    });
}

std::string endings_to_write() {
    std::vector<std::string> all;
    for (const SplatFormat format : kSplatFormats)
        if (const SplatFormatRow& row = row_of(format); row.encode)
            all.insert(all.end(), row.endings.begin(), row.endings.end());
    return listed(all);
}

std::vector<std::string> losses_of(SplatFormat format, const SplatModel& scene,
                                   const std::string& where) {
    const SplatFormatRow& row = row_of(format);
    check_shape_has_a_place(row, scene, where);
    SplatModel copy;
    std::size_t dropped = 0;
    const SplatModel& model = writable(format, scene, copy, dropped);
    std::vector<std::string> losses;
    if (dropped > 0)
        losses.push_back(
            row.keeps & kKeepsUnturned
                ? fmt::format("{} splats with NaN or infinity are left out", dropped)
                : fmt::format("{} splats with a rotation of length 0, NaN or infinity, which are "
                              "not drawn, are left out",
                              dropped));
    for (const auto& found : {missing_places(row, model),
                              row.cuts ? row.cuts(model, where) : std::vector<std::string>{}})
        losses.insert(losses.end(), found.begin(), found.end());
    if (!(row.keeps & kKeepsDoublePositions) && model.origin != glm::dvec3(0.0))
        losses.push_back(fmt::format(
            "{} has no place for double positions: they are rounded to float32", row.name));
    return losses;
}

std::size_t drop_unwritable(SplatFormat format, SplatModel& model) {
    const std::size_t dropped = drop_non_finite(model);
    if (row_of(format).keeps & kKeepsUnturned) return dropped;
    return dropped + keep_splats([&](std::size_t i) { return has_rotation(model, i); }, model);
}

int precisions_of(SplatFormat format, const SplatModel& model) {
    const SplatFormatRow& row = row_of(format);
    return row.precisions ? row.precisions(model) : 1;
}

std::size_t EncodedSplats::bytes() const {
    std::size_t sum = file.size();
    for (const auto& one : beside) sum += one.second.size();
    return sum;
}

EncodedSplats encode_scene(SplatFormat format, const SplatModel& scene, const std::string& where,
                           const EncodeOptions& options) {
    const SplatFormatRow& row = row_of(format);
    if (!row.encode)
        throw Error(where, fmt::format("{} can be read, but not written", row.name),
                    "Write one that ends in " + endings_to_write() + ".");
    check_shape_has_a_place(row, scene, where);
    SplatModel copy;
    std::size_t dropped = 0;
    return row.encode(writable(format, scene, copy, dropped), where, options);
}

std::vector<std::byte> encode_splats(SplatFormat format, const SplatModel& model,
                                     const std::string& where) {
    EncodedSplats encoded = encode_scene(format, model, where);
    if (!encoded.beside.empty())
        throw Error(where, "takes several files, not one", "Use save_splats.");
    return std::move(encoded.file);
}

void write_encoded(const fs::path& path, const EncodedSplats& encoded) {
    for (const auto& [name, bytes] : encoded.beside)
        write_file_atomic(path.parent_path() / name, bytes);
    write_file_atomic(path, encoded.file);
}

void save_splats(const fs::path& path, SplatFormat format, const SplatModel& model) {
    write_encoded(path, encode_scene(format, model, path.string()));
}

}  // namespace darb
