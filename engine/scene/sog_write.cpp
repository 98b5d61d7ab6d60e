#include <fmt/format.h>
#include <webp/encode.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <future>
#include <nlohmann/json.hpp>
#include <numbers>

#include "engine/core/error.h"
#include "engine/core/text.h"
#include "engine/scene/chunk_order.h"
#include "engine/scene/cluster_rows.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/quantise.h"
#include "engine/scene/sog.h"
#include "engine/scene/sog_archive.h"
#include "engine/scene/splat_shapes.h"

namespace darb {

namespace {

using nlohmann::json;

constexpr std::size_t kChunkNeighbours = 256;  // splats that lie close together, for chunk_order
constexpr std::size_t kRowEntries = 64;        // palette entries a row of pixels
constexpr std::size_t kPaletteStep = 1024, kMostSteps = 64;
constexpr int kWebpEffort = 4;            // of 9
constexpr std::size_t kMostSide = 16383;  // px, of WebP

/// Its pixels are set one by one; those that are not are 0 0 0 255.
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

/// A pixel a splat; sides are multiples of 4.
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
    config.exact = 1;  // the colours under an alpha of 0 count
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

/// Three indices a splat into a codebook of their own.
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

/// As many as PlayCanvas's writers make of so many splats.
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

EncodedSplats encode_sog_parts(const SplatModel& scene, const std::string& where,
                               const EncodeOptions& options) {
    check_splat_shapes(scene);
    if (scene.size() == 0)
        throw Error(where, "SOG has no place for a scene without splats", "Write a PLY.");
    if (scene.size() > kMostSide * kMostSide / 2)
        throw Error(
            where,
            fmt::format("{} splats are more than a WebP picture has pixels for", scene.size()),
            "Write fewer splats, or a PLY.");
    const SplatModel model = pick_splats(scene, chunk_order(scene, kChunkNeighbours));
    json meta = {{"version", 2},
                 {"asset", {{"generator", "darb " DARB_VERSION}}},
                 {"count", model.size()},
                 {"antialias", model.antialias}};
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
    EncodedSplats parts = encode_sog_parts(model, where, options);
    if (lower(where).ends_with("meta.json")) return parts;
    parts.beside.emplace(parts.beside.begin(), "meta.json", std::move(parts.file));
    return {make_sog_zip(parts.beside, where)};
}

}  // namespace darb
