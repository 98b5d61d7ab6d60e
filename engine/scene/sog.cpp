#include "engine/scene/sog.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "engine/core/error.h"
#include "engine/core/json_text.h"
#include "engine/core/quantile.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/inflate.h"
#include "engine/scene/quantise.h"
#include "engine/scene/sog_archive.h"
#include "engine/scene/splat_format.h"

namespace darb {

namespace {

using nlohmann::json;

constexpr std::size_t kPaletteRow = 64;         // entries a row of shN_centroids
constexpr std::size_t kMostPalette = 65536;     // entries
constexpr std::size_t kSparePixels = 1u << 20;  // of the pictures, beyond four times the splats
constexpr std::uint64_t kSplatBytes = 4 * splat_floats(kMaxShDegree);

using Codebook = std::array<float, 256>;

struct Scene {
    const json& meta;
    const SogPart& part;
    std::string where;
    std::size_t count = 0;
    SplatModel model;
    std::vector<std::string> notes;
    double position_step = 0;

    std::string file_name(const char* group, std::size_t i) const {
        return meta.at(group).at("files").at(i).get<std::string>();
    }

    /// A picture with a pixel for each splat.
    SogImage picture(const char* group, std::size_t i = 0) const {
        const std::string name = file_name(group, i), place = where + ", " + name;
        SogImage image = decode_webp(part(name), 4 * count + kSparePixels, place);
        if (image.width * image.height < count)
            throw Error(place,
                        fmt::format("is {} x {} px, too small for {} splats", image.width,
                                    image.height, count),
                        kCopyAgain);
        return image;
    }

    /// Indices beyond its end, and values that are null, give NaN; splats that use them are
    /// dropped.
    Codebook codebook(const char* group) const {
        Codebook book;
        book.fill(std::numeric_limits<float>::quiet_NaN());
        const json& values = meta.at(group).at("codebook");
        if (!values.is_array() || values.empty() || values.size() > book.size())
            throw Error(where + ", meta.json",
                        fmt::format("{}.codebook has {} values; 1 to 256 are allowed", group,
                                    values.size()),
                        kCopyAgain);
        for (std::size_t i = 0; i < values.size(); ++i)
            if (!values[i].is_null()) book[i] = values[i].get<float>();  // JSON has no NaN
        return book;
    }
};

/// Between two positions, at the median of each axis: 1/65,535 of the range of sign(x) ln(1 + |x|).
double step_of(const json& meta, const std::vector<double>& positions) {
    double step = 0;
    std::vector<double> places(positions.size() / 3);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t i = 0; i < places.size(); ++i)
            places[i] = std::abs(positions[3 * i + axis]);
        const double range = meta.at("means").at("maxs").at(axis).get<double>() -
                             meta.at("means").at("mins").at(axis).get<double>();
        step = std::max(step, (1 + nearest_rank(places, 0.5)) * std::abs(range) / 65535);
    }
    return step;
}

void read_means(Scene& scene) {
    const SogImage low = scene.picture("means", 0), high = scene.picture("means", 1);
    std::vector<double> positions(3 * scene.count);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double least = scene.meta.at("means").at("mins").at(axis).get<double>();
        const double most = scene.meta.at("means").at("maxs").at(axis).get<double>();
        for (std::size_t i = 0; i < scene.count; ++i) {
            const int step = low.rgba[4 * i + axis] + 256 * high.rgba[4 * i + axis];
            const double folded = least + (most - least) * step / 65535;
            positions[3 * i + axis] = std::copysign(std::expm1(std::abs(folded)), folded);
            if (!std::isfinite(static_cast<float>(positions[3 * i + axis])))
                throw Error(
                    scene.where + ", meta.json",
                    fmt::format("means: the range {:g} to {:g} leads beyond float32", least, most),
                    kCopyAgain);
        }
    }
    scene.position_step = step_of(scene.meta, positions);
    set_positions(positions, scene.model);
}

void read_quats(Scene& scene) {
    const SogImage image = scene.picture("quats");
    std::size_t invalid = 0;
    for (std::size_t i = 0; i < scene.count; ++i) {
        const std::uint8_t* pixel = &image.rgba[4 * i];
        SmallestThree three{};
        if (pixel[3] >= 252) {
            three.largest = pixel[3] - 252u;
            for (std::size_t k = 0; k < 3; ++k)
                three.others[k] = (pixel[k] / 255.0 * 2 - 1) / std::numbers::sqrt2;
        } else {
            ++invalid;
        }
        const std::array<double, 4> q = whole_quaternion(three);  // w x y z
        for (std::size_t k = 0; k < 4; ++k)
            scene.model.rotation[4 * i + k] = static_cast<float>(q[k]);
    }
    if (invalid > 0)
        scene.notes.push_back(
            fmt::format("{} splats have no valid rotation and are not turned", invalid));
}

void read_scales_and_colours(Scene& scene) {
    const SogImage scales = scene.picture("scales"), colours = scene.picture("sh0");
    const Codebook scale = scene.codebook("scales"), dc = scene.codebook("sh0");
    for (std::size_t i = 0; i < scene.count; ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
            scene.model.log_scale[3 * i + k] = scale[scales.rgba[4 * i + k]];
            scene.model.sh_dc[3 * i + k] = dc[colours.rgba[4 * i + k]];
        }
        scene.model.opacity_logit[i] = logit_of_byte(colours.rgba[4 * i + 3]);
    }
}

void read_harmonics(Scene& scene) {
    const auto entries = scene.meta.at("shN").value("count", kMostPalette);
    const std::string name = scene.file_name("shN", 0), place = scene.where + ", " + name;
    const SogImage palette = decode_webp(scene.part(name), 16 * kMostPalette, place);
    const std::size_t pixels = palette.width / kPaletteRow;
    const int degree = pixels == 3 ? 1 : pixels == 8 ? 2 : 3;
    if ((pixels != 3 && pixels != 8 && pixels != 15) || palette.width % kPaletteRow != 0 ||
        scene.meta.at("shN").value("bands", degree) != degree)
        throw Error(
            place, fmt::format("is {} px wide; SH degree 1, 2, 3 has 192, 512, 960", palette.width),
            kCopyAgain);
    const SogImage labels = scene.picture("shN", 1);
    const Codebook book = scene.codebook("shN");
    scene.model.sh_degree = degree;
    scene.model.resize(scene.count);
    std::size_t invalid = 0;
    for (std::size_t i = 0; i < scene.count; ++i) {
        const std::size_t label = labels.rgba[4 * i] + 256u * labels.rgba[4 * i + 1];
        const std::size_t row = label / kPaletteRow;
        if (label >= entries || row >= palette.height) {
            ++invalid;  // stays 0
            continue;
        }
        const std::size_t at = row * palette.width + label % kPaletteRow * pixels;
        for (std::size_t c = 0; c < pixels; ++c)
            for (std::size_t k = 0; k < 3; ++k)
                scene.model.sh_rest[(i * pixels + c) * 3 + k] =
                    book[palette.rgba[4 * (at + c) + k]];
    }
    if (invalid > 0)
        scene.notes.push_back(
            fmt::format("{} splats name harmonics beyond the palette and have none", invalid));
}

void check_version(const json& meta, const std::string& where) {
    if (!meta.is_object() || !meta.contains("means"))
        throw Error(where + ", meta.json", "describes no SOG scene: it has no means",
                    "Name the folder or the .sog file of a SOG scene.");
    const int version = meta.value("version", 1);
    if (version != 2)
        throw Error(where + ", meta.json", fmt::format("is SOG version {}; 2 is known", version),
                    "Convert it with PlayCanvas's splat-transform first.");
}

/// By the format, or as splat-transform tags it.
bool is_antialiased(const json& meta) {
    return meta.value("antialias", json()) == true || meta.value("model", json()) == "antialiased";
}

SplatModel decode(const json& meta, const SogPart& part, const std::string& where,
                  std::size_t stored, SogFacts* facts) {
    check_version(meta, where);
    const json& count = meta.at("count");
    if (!count.is_number_unsigned())
        throw Error(where + ", meta.json", "count is no whole number", kCopyAgain);
    Scene scene{meta, part, where, count.get<std::size_t>(), {}, {}};
    if (count.get<std::uint64_t>() > std::numeric_limits<std::uint32_t>::max())
        throw Error(where + ", meta.json", fmt::format("declares {} splats", scene.count),
                    kCopyAgain);
    check_expansion(stored, scene.count * kSplatBytes, where);
    scene.model.antialias = is_antialiased(meta);
    scene.model.resize(scene.count);
    if (scene.count > 0) {
        read_means(scene);
        read_quats(scene);
        read_scales_and_colours(scene);
        if (meta.contains("shN") && meta["shN"].is_object()) read_harmonics(scene);
    }
    const std::size_t dropped = drop_non_finite(scene.model);
    if (facts) {
        const json asset = meta.value("asset", json::object());
        *facts = {2, asset.is_object() ? asset.value("generator", "") : "", dropped,
                  std::move(scene.notes), scene.position_step};
    }
    return std::move(scene.model);
}

SplatModel parse_parts(const SogPart& part, const std::string& where, std::size_t stored,
                       SogFacts* facts) {
    const std::vector<std::byte> text = part("meta.json");
    try {
        const auto* begin = reinterpret_cast<const char*>(text.data());
        return decode(parse_json_text({begin, text.size()}, where + ", meta.json", kCopyAgain),
                      part, where, stored, facts);
    } catch (const json::exception& error) {
        throw Error(where + ", meta.json", json_reason(error), kCopyAgain);
    }
}

namespace fs = std::filesystem;

bool is_sog(const SplatSource& source) {
    const fs::path name = fs::path(source.where).filename();
    return looks_like_zip(source.bytes) || (name == "meta.json" && !source.folder.empty());
}

SplatModel load_sog(const SplatSource& source, SplatFile& file) {
    const bool zip = looks_like_zip(source.bytes);
    SogFacts facts;
    SplatModel model = zip ? parse_sog(source.bytes, source.where, &facts)
                           : read_sog_folder(source.folder, &facts);
    file.details = zip ? "zip" : "folder";
    file.version = facts.version;
    file.dropped = facts.dropped;
    file.notes = facts.notes;
    file.position_step = facts.position_step;
    file.details += facts.generator.empty() ? "" : ", by " + facts.generator;
    if (zip) return model;
    file.bytes = 0;
    for (const fs::directory_entry& entry : fs::directory_iterator(source.folder))
        if (entry.is_regular_file()) file.bytes += entry.file_size();
    return model;
}

}  // namespace

bool looks_like_zip(std::span<const std::byte> file) {
    return file.size() >= 4 && file[0] == std::byte{'P'} && file[1] == std::byte{'K'} &&
           (file[2] == std::byte{3} || file[2] == std::byte{5});
}

SplatModel parse_sog(std::span<const std::byte> zip, const std::string& where, SogFacts* facts) {
    return parse_parts(open_sog_zip(zip, where), where, zip.size(), facts);
}

SplatModel read_sog_folder(const std::filesystem::path& folder, SogFacts* facts) {
    std::size_t stored = 0;
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator(folder, ignored))
        if (entry.is_regular_file(ignored)) stored += entry.file_size(ignored);
    return parse_parts(open_sog_folder(folder), folder.string(), stored, facts);
}

const SplatFormatRow& sog_format() {
    static const SplatFormatRow row{.name = "SOG",
                                    .endings = {".sog", "meta.json"},
                                    .folder_file = "meta.json",
                                    .recognise = is_sog,
                                    .parse = load_sog,
                                    .encode = encode_sog,
                                    .keeps = kKeepsRenderMode | kKeepsHarmonics};
    return row;
}

}  // namespace darb
