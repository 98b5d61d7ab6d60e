// SPDX-License-Identifier: MIT
#include "engine/scene/sog.h"

#include <fmt/format.h>
#include <webp/decode.h>
#include <webp/encode.h>
#include <zip.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <future>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/core/quantile.h"
#include "engine/core/text.h"
#include "engine/scene/cluster_rows.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/inflate.h"
#include "engine/scene/quantise.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/splat_format.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// Gives the bytes of a part, by its name in meta.json. Throws Error where there is none.
using SogPart = std::function<std::vector<std::byte>(const std::string& name)>;

/// zip must outlive the result.
SogPart open_sog_zip(std::span<const std::byte> zip, const std::string& where);
/// Refuses names with folders.
SogPart open_sog_folder(const std::filesystem::path& folder);

/// Entries are stored, not compressed again; equal parts give equal bytes.
std::vector<std::byte> make_sog_zip(
    const std::vector<std::pair<std::string, std::vector<std::byte>>>& parts,
    const std::string& where);

struct SogImage {
    std::size_t width = 0, height = 0;  // px
    std::vector<std::uint8_t> rgba;     // [H][W][4]
};

/// Throws Error where the bytes are not WebP, or the picture has more than `most` pixels.
SogImage decode_webp(std::span<const std::byte> bytes, std::size_t most, const std::string& where);

namespace {

using nlohmann::json;

constexpr std::size_t kPaletteRow = 64;         // entries a row of shN_centroids
constexpr std::size_t kMostPalette = 65536;     // entries
constexpr std::size_t kSparePixels = 1u << 20;  // pictures may hold four times the splats and this
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

    /// Null values, and indices beyond the end, give NaN; splats that use them are dropped.
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

/// The step between two positions at the median of each axis: 1/65,535 of the range of sign(x) ln(1
/// + |x|).
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
        throw Error(where + ", meta.json", "does not describe a SOG scene: it has no means",
                    "Name the folder or the .sog file of a SOG scene.");
    const int version = meta.value("version", 1);
    if (version != 2)
        throw Error(where + ", meta.json", fmt::format("is SOG version {}; 2 is known", version),
                    "Convert it with PlayCanvas's splat-transform first.");
}

/// By the format's key, or by the tag that splat-transform writes.
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
    scene.model.metres_per_unit = positive_number(meta, "metresPerUnit");
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
                                    .keeps = kKeepsRenderMode | kKeepsHarmonics | kKeepsUnit};
    return row;
}

namespace {

constexpr time_t kZipTime = 315619200;  // 1980-01-02, so that bytes do not depend on the day

struct CloseArchive {
    void operator()(zip_t* archive) const { zip_discard(archive); }
};
struct CloseEntry {
    void operator()(zip_file_t* entry) const { zip_fclose(entry); }
};

std::shared_ptr<zip_t> open_archive(std::span<const std::byte> zip, const std::string& where) {
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t* source = zip_source_buffer_create(zip.data(), zip.size(), 0, &error);
    zip_t* archive = source ? zip_open_from_source(source, ZIP_RDONLY, &error) : nullptr;
    if (!archive) {
        const std::string reason = zip_error_strerror(&error);
        zip_source_free(source);
        zip_error_fini(&error);
        throw Error(where, "the zip cannot be opened: " + reason, kCopyAgain);
    }
    zip_error_fini(&error);
    return {archive, CloseArchive{}};
}

std::vector<std::byte> read_entry(zip_t* archive, const std::string& name, std::size_t zip_bytes,
                                  const std::string& where) {
    const std::string place = where + ", entry " + name;
    zip_stat_t stat;
    zip_stat_init(&stat);
    if (zip_stat(archive, name.c_str(), 0, &stat) != 0 || !(stat.valid & ZIP_STAT_SIZE))
        throw Error(place, "the zip has no such entry", kCopyAgain);
    check_expansion(zip_bytes, stat.size, place);
    const std::unique_ptr<zip_file_t, CloseEntry> entry(zip_fopen(archive, name.c_str(), 0));
    if (!entry)
        throw Error(place, std::string("cannot be read: ") + zip_strerror(archive), kCopyAgain);
    std::vector<std::byte> bytes(stat.size);
    std::size_t done = 0;
    while (done < bytes.size()) {
        const zip_int64_t got = zip_fread(entry.get(), bytes.data() + done, bytes.size() - done);
        if (got <= 0)
            throw Error(place, fmt::format("ends after {} of {} bytes", done, bytes.size()),
                        kCopyAgain);
        done += static_cast<std::size_t>(got);
    }
    // The checksum is verified when the end is reached.
    std::byte beyond{};
    if (const zip_int64_t more = zip_fread(entry.get(), &beyond, 1); more != 0)
        throw Error(place,
                    more < 0 ? fmt::format("is damaged: {}", zip_file_strerror(entry.get()))
                             : "is longer than the zip says",
                    kCopyAgain);
    return bytes;
}

/// The name of a scene in the archive, which has to be unpacked first; empty where there is none.
std::string packed_scene(zip_t* archive) {
    for (zip_int64_t i = 0; i < zip_get_num_entries(archive, 0); ++i)
        if (const char* name = zip_get_name(archive, static_cast<zip_uint64_t>(i), 0))
            if (format_to_write(name)) return name;
    return {};
}

/// meta.json may name files beside it, but none in other folders.
void check_part_name(const std::string& name, const std::string& meta) {
    if (name.empty() || std::filesystem::path(name).filename() != name || name == "..")
        throw Error(meta, "names '" + name + "', which is no file of its folder",
                    "Put all files of the scene into one folder.");
}

}  // namespace

SogPart open_sog_zip(std::span<const std::byte> zip, const std::string& where) {
    const std::shared_ptr<zip_t> archive = open_archive(zip, where);
    if (zip_name_locate(archive.get(), "meta.json", 0) < 0) {
        const std::string scene = packed_scene(archive.get());
        throw Error(where,
                    "is a zip, but not a SOG scene: it has no meta.json" +
                        (scene.empty() ? "" : ", and holds " + scene),
                    scene.empty() ? "Name a splat file." : "Unpack it and name that file.");
    }
    return [archive, size = zip.size(), where](const std::string& name) {
        check_part_name(name, where + ", meta.json");
        return read_entry(archive.get(), name, size, where);
    };
}

SogPart open_sog_folder(const std::filesystem::path& folder) {
    return [folder](const std::string& name) {
        check_part_name(name, (folder / "meta.json").string());
        return read_file(folder / name);
    };
}

std::vector<std::byte> make_sog_zip(
    const std::vector<std::pair<std::string, std::vector<std::byte>>>& parts,
    const std::string& where) {
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t* const source = zip_source_buffer_create(nullptr, 0, 0, &error);
    zip_t* const archive = source ? zip_open_from_source(source, ZIP_TRUNCATE, &error) : nullptr;
    const auto failed = [&](const char* reason) {
        return Error(where, std::string("the zip cannot be made: ") + reason, "Free memory.");
    };
    if (!archive) {
        zip_source_free(source);
        throw failed("out of memory");
    }
    zip_source_keep(source);
    for (const auto& [name, bytes] : parts) {
        zip_source_t* const part = zip_source_buffer(archive, bytes.data(), bytes.size(), 0);
        const zip_int64_t index = part ? zip_file_add(archive, name.c_str(), part, 0) : -1;
        if (index < 0 ||
            zip_set_file_compression(archive, static_cast<zip_uint64_t>(index), ZIP_CM_STORE, 0) !=
                0 ||
            zip_file_set_mtime(archive, static_cast<zip_uint64_t>(index), kZipTime, 0) != 0) {
            zip_discard(archive);
            zip_source_free(source);
            throw failed("a part cannot be added");
        }
    }
    std::vector<std::byte> file;
    zip_stat_t stat;
    zip_stat_init(&stat);
    if (zip_close(archive) == 0 && zip_source_stat(source, &stat) == 0 &&
        zip_source_open(source) == 0) {
        file.resize(stat.size);
        if (zip_source_read(source, file.data(), file.size()) !=
            static_cast<zip_int64_t>(file.size()))
            file.clear();
        zip_source_close(source);
    }
    zip_source_free(source);
    if (file.empty()) throw failed("its parts do not fit");
    return file;
}

SogImage decode_webp(std::span<const std::byte> bytes, std::size_t most, const std::string& where) {
    const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
    int width = 0, height = 0;
    if (!WebPGetInfo(data, bytes.size(), &width, &height))
        throw Error(where, "is no WebP picture", kCopyAgain);
    SogImage image{static_cast<std::size_t>(width), static_cast<std::size_t>(height), {}};
    if (image.width * image.height > most)
        throw Error(
            where, fmt::format("is {} x {} px; the splats need {} px at most", width, height, most),
            kCopyAgain);
    image.rgba.resize(4 * image.width * image.height);
    if (!WebPDecodeRGBAInto(data, bytes.size(), image.rgba.data(), image.rgba.size(), 4 * width))
        throw Error(where, "the WebP picture is damaged", kCopyAgain);
    return image;
}

namespace {

using nlohmann::json;

constexpr std::size_t kChunkNeighbours = 256;  // splats in a chunk for chunk_order
constexpr std::size_t kRowEntries = 64;        // palette entries in a row of pixels
constexpr std::size_t kPaletteStep = 1024, kMostSteps = 64;
constexpr int kWebpEffort = 4;            // on libwebp's scale to 9
constexpr std::size_t kMostSide = 16383;  // WebP's limit, px

/// A picture whose pixels are set one by one; the others are 0 0 0 255.
struct Plane {
    std::string name;
    SogImage image;
    std::uint8_t* pixel(std::size_t i) { return &image.rgba[4 * i]; }
};

Plane plane_of(std::string name, std::size_t width, std::size_t height) {
    Plane plane{std::move(name), {width, height, {}}};
    plane.image.rgba.assign(4 * width * height, 0);
    for (std::size_t i = 3; i < plane.image.rgba.size(); i += 4) plane.image.rgba[i] = 255;
    return plane;
}

/// One pixel per splat; sides are multiples of 4.
Plane plane_for(std::string name, std::size_t splats) {
    const auto side = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(splats))));
    const std::size_t width = (side + 3) / 4 * 4;
    return plane_of(std::move(name), width, ((splats + width - 1) / width + 3) / 4 * 4);
}

std::vector<std::byte> encode_webp(const SogImage& image, const std::string& where) {
    WebPConfig config;
    WebPPicture picture;
    WebPMemoryWriter writer;
    WebPMemoryWriterInit(&writer);
    if (!WebPConfigInit(&config) || !WebPPictureInit(&picture) ||
        !WebPConfigLosslessPreset(&config, kWebpEffort))
        throw Error(where, "the WebP library is of another version than its headers",
                    "Install libwebp again, and build darb anew.");
    config.exact = 1;  // keep colours where alpha is 0
    picture.use_argb = 1;
    picture.width = static_cast<int>(image.width);
    picture.height = static_cast<int>(image.height);
    picture.writer = WebPMemoryWrite;
    picture.custom_ptr = &writer;
    const bool done =
        WebPPictureImportRGBA(&picture, image.rgba.data(), static_cast<int>(4 * image.width)) &&
        WebPEncode(&config, &picture);
    WebPPictureFree(&picture);
    std::vector<std::byte> bytes(done ? writer.size : 0);
    if (done) std::memcpy(bytes.data(), writer.mem, writer.size);
    WebPMemoryWriterClear(&writer);
    if (!done)
        throw Error(
            where,
            fmt::format("no WebP picture of {} x {} px can be made", image.width, image.height),
            "Free memory, or write fewer splats.");
    return bytes;
}

json numbers(std::span<const float> values) {
    json list = json::array();
    for (const float value : values) list.push_back(value);
    return list;
}

double folded(double x) {
    return std::copysign(std::log1p(std::abs(x)), x);
}

void write_means(const SplatModel& model, json& meta, std::vector<Plane>& planes) {
    Plane low = plane_for("means_l.webp", model.size()),
          high = plane_for("means_u.webp", model.size());
    json mins = json::array(), maxs = json::array();
    for (int axis = 0; axis < 3; ++axis) {
        double least = 1e300, most = -1e300;
        for (std::size_t i = 0; i < model.size(); ++i) {
            const double value = folded(position_of(model, i)[axis]);
            least = std::min(least, value);
            most = std::max(most, value);
        }
        mins.push_back(least);
        maxs.push_back(most);
        for (std::size_t i = 0; i < model.size(); ++i) {
            const double unit =
                most > least ? (folded(position_of(model, i)[axis]) - least) / (most - least) : 0;
            const auto step = static_cast<std::uint32_t>(std::lround(unit * 65535));
            low.pixel(i)[axis] = static_cast<std::uint8_t>(step & 255);
            high.pixel(i)[axis] = static_cast<std::uint8_t>(step >> 8);
        }
    }
    meta["means"] = {{"mins", mins}, {"maxs", maxs}, {"files", {low.name, high.name}}};
    planes.push_back(std::move(low));
    planes.push_back(std::move(high));
}

void write_quats(const SplatModel& model, json& meta, std::vector<Plane>& planes) {
    Plane plane = plane_for("quats.webp", model.size());
    for (std::size_t i = 0; i < model.size(); ++i) {
        const float* q = &model.rotation[4 * i];
        const SmallestThree three = smallest_three({q[0], q[1], q[2], q[3]});
        for (std::size_t k = 0; k < 3; ++k)
            plane.pixel(i)[k] =
                nearest_byte(255 * (three.others[k] * std::numbers::sqrt2 / 2 + 0.5));
        plane.pixel(i)[3] = static_cast<std::uint8_t>(252 + three.largest);
    }
    meta["quats"] = {{"files", {plane.name}}};
    planes.push_back(std::move(plane));
}

/// Writes three indices per splat into a codebook made for them.
Plane write_indexed(const char* group, const std::vector<float>& values, json& meta) {
    Plane plane = plane_for(fmt::format("{}.webp", group), values.size() / 3);
    const Codebook256 book = codebook_of(values);
    for (std::size_t i = 0; i < values.size(); ++i)
        plane.pixel(i / 3)[i % 3] = nearest_entry(book, values[i]);
    meta[group] = {{"codebook", numbers(book)}, {"files", {plane.name}}};
    return plane;
}

void write_scales_and_colours(const SplatModel& model, json& meta, std::vector<Plane>& planes) {
    std::vector<float> scales = model.log_scale;
    for (float& value : scales) value = drawn_log_scale(value);
    planes.push_back(write_indexed("scales", scales, meta));
    planes.push_back(write_indexed("sh0", model.sh_dc, meta));
    for (std::size_t i = 0; i < model.size(); ++i)
        planes.back().pixel(i)[3] = byte_of_logit(model.opacity_logit[i]);
}

/// The size that PlayCanvas's writers choose for this number of splats.
std::size_t palette_size(std::size_t splats) {
    std::size_t steps = 1;
    while (2 * steps * kPaletteStep <= splats && steps < kMostSteps) steps *= 2;
    return std::min(steps * kPaletteStep, splats);
}

void write_harmonics(const SplatModel& model, const EncodeOptions& options, json& meta,
                     std::vector<Plane>& planes) {
    const auto dims = static_cast<std::size_t>(model.rest_count());
    const AssignRows assign = options.assign_rows ? options.assign_rows : assign_rows;
    const Clusters clusters =
        cluster_rows(model.sh_rest, dims, palette_size(model.size()), assign, options.progress);
    const std::size_t entries = clusters.centres.size() / dims, pixels = dims / 3;
    const Codebook256 book = codebook_of(clusters.centres);
    Plane palette = plane_of("shN_centroids.webp", kRowEntries * pixels,
                             (entries + kRowEntries - 1) / kRowEntries);
    for (std::size_t i = 0; i < clusters.centres.size(); ++i) {
        const std::size_t entry = i / dims, c = i % dims;
        const std::size_t at =
            entry / kRowEntries * palette.image.width + entry % kRowEntries * pixels + c / 3;
        palette.pixel(at)[c % 3] = nearest_entry(book, clusters.centres[i]);
    }
    Plane labels = plane_for("shN_labels.webp", model.size());
    for (std::size_t i = 0; i < model.size(); ++i) {
        labels.pixel(i)[0] = static_cast<std::uint8_t>(clusters.label[i] & 255);
        labels.pixel(i)[1] = static_cast<std::uint8_t>(clusters.label[i] >> 8);
    }
    meta["shN"] = {{"count", entries},
                   {"bands", model.sh_degree},
                   {"codebook", numbers(book)},
                   {"files", {palette.name, labels.name}}};
    planes.push_back(std::move(palette));
    planes.push_back(std::move(labels));
}

}  // namespace

EncodedSplats encode_sog_parts(const SplatModel& model, const std::string& where,
                               const EncodeOptions& options) {
    check_splat_shapes(model);
    if (model.size() == 0)
        throw Error(where, "SOG cannot store a scene without splats", "Write a PLY.");
    if (model.size() > kMostSide * kMostSide / 2)
        throw Error(
            where,
            fmt::format("{} splats are more than a WebP picture has pixels for", model.size()),
            "Write fewer splats, or a PLY.");
    json meta = {{"version", 2},
                 {"asset", {{"generator", "darb " DARB_VERSION}}},
                 {"count", model.size()},
                 {"antialias", model.antialias}};
    if (model.metres_per_unit > 0) meta["metresPerUnit"] = model.metres_per_unit;
    std::vector<Plane> planes;
    write_means(model, meta, planes);
    write_quats(model, meta, planes);
    write_scales_and_colours(model, meta, planes);
    if (model.sh_degree > 0) write_harmonics(model, options, meta, planes);
    std::vector<std::future<std::vector<std::byte>>> pictures;
    for (const Plane& plane : planes)
        pictures.push_back(std::async(std::launch::async, [&plane, &where] {
            return encode_webp(plane.image, where + ", " + plane.name);
        }));
    EncodedSplats encoded;
    const std::string text = meta.dump();
    const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
    encoded.file.assign(bytes.begin(), bytes.end());
    for (std::size_t i = 0; i < planes.size(); ++i)
        encoded.beside.emplace_back(planes[i].name, pictures[i].get());
    return encoded;
}

EncodedSplats encode_sog(const SplatModel& model, const std::string& where,
                         const EncodeOptions& options) {
    EncodedSplats parts =
        encode_sog_parts(pick_splats(model, chunk_order(model, kChunkNeighbours)), where, options);
    if (lower(where).ends_with("meta.json")) return parts;
    parts.beside.emplace(parts.beside.begin(), "meta.json", std::move(parts.file));
    return {make_sog_zip(parts.beside, where)};
}

}  // namespace darb
