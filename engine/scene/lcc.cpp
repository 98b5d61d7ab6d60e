// SPDX-License-Identifier: MIT
// LCC (XGRIDS): a description in JSON, index.bin with the nodes of each unit of the ground, and the
// splats of all nodes in data.bin, their harmonics in shcoef.bin, what is far away in
// environment.bin. A node is a unit at a level of detail; level 0 is the finest. Data Organization
// Format originated from XGRIDS; source: "LCC Data Organization Format White Paper"
// (github.com/xgrids/LCCWhitepaper).
//   a splat, 32 bytes: position 3 x float, r g b opacity 4 x uint8, scale 3 x uint16,
//   rotation uint32, normal 3 x uint16 (not used); its harmonics, 64 bytes: 15 x uint32, 4 unused
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/core/text.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/quantise.h"
#include "engine/scene/splat_format.h"
#include "shaders/shared/limits.h"

namespace darb {

namespace {

namespace fs = std::filesystem;
using LccJson = nlohmann::json;

constexpr std::size_t kLccSplat = 32, kLccHarmonics = 64;  // bytes
constexpr std::size_t kLccNode = 16, kLccUnit = 4;         // bytes, in index.bin
constexpr std::size_t kMostLccLevels = 64;
constexpr std::size_t kLccProbed = 64 << 10;  // bytes that the key is looked for in
constexpr std::size_t kLccAtATime = 1 << 20;  // bytes of data.bin read at a time
constexpr int kLccDegree = 3;

/// Least and largest value of an attribute.
struct LccRange {
    std::array<double, 3> least{}, most{};
    double at(std::size_t axis, double share) const {
        return least[axis] + share * (most[axis] - least[axis]);
    }
};

struct LccMeta {
    std::size_t levels = 0;
    std::vector<std::uint64_t> splats;  // [level]
    bool harmonics = false;
    LccRange scale, shcoef, far_scale, far_shcoef;
};

/// A run of splats in data.bin; bytes.
struct LccRun {
    std::uint64_t offset = 0, size = 0;
};

struct LccFolder {
    fs::path folder;
    std::string where;  // of the description

    /// The file of this name in whatever case; empty where there is none.
    fs::path find(const std::string& name) const {
        std::error_code none;
        for (const auto& entry : fs::directory_iterator(folder, none))
            if (entry.is_regular_file(none) && lower(entry.path().filename().string()) == name)
                return entry.path();
        return {};
    }
    fs::path required(const std::string& name) const {
        fs::path path = find(name);
        if (path.empty())
            throw Error(where, fmt::format("needs {} beside it, which is not there", name),
                        "Copy the whole folder of the scene.");
        return path;
    }
};

std::size_t lcc_number(const LccJson& object, const char* key) {
    const LccJson& value = object.at(key);
    if (!value.is_number_unsigned())
        throw LccJson::type_error::create(302, fmt::format("{} is no whole number", key), &object);
    return value.get<std::size_t>();
}

/// The range of the other name, else of this one; throws where neither is there.
LccRange lcc_range(const LccJson& attributes, const char* name, const char* other) {
    const LccJson* found = nullptr;
    for (const char* wanted : {name, other})
        for (const LccJson& one : attributes)
            if (one.at("name").get<std::string>() == wanted) found = &one;
    if (!found)
        throw LccJson::type_error::create(302, fmt::format("attributes has no {}", name),
                                          &attributes);
    LccRange range;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        range.least[axis] = found->at("min").at(axis).get<double>();
        range.most[axis] = found->at("max").at(axis).get<double>();
        if (!(range.least[axis] <= range.most[axis]))
            throw LccJson::type_error::create(
                302, fmt::format("the least {} is above the largest", name), found);
    }
    return range;
}

LccMeta lcc_meta(const LccJson& meta_json, const LccFolder& folder) {
    LccMeta meta;
    meta.levels = lcc_number(meta_json, "totalLevel");
    if (meta.levels == 0 || meta.levels > kMostLccLevels)
        throw Error(folder.where, fmt::format("declares {} levels of detail", meta.levels),
                    kCopyAgain);
    for (std::size_t level = 0; level < meta.levels; ++level)
        meta.splats.push_back(meta_json.at("splats").at(level).get<std::uint64_t>());
    if (const std::string encoding = meta_json.value("encoding", "COMPRESS");
        encoding != "COMPRESS")
        throw Error(folder.where, fmt::format("has the encoding {}", printable(encoding)),
                    "Export it with the encoding COMPRESS, the one that is known.");
    const std::string type = meta_json.value("fileType", "");
    if (type != "Portable" && type != "Quality" && !type.empty())
        throw Error(folder.where, fmt::format("has the fileType {}", printable(type)),
                    "Export it as Portable or Quality, which are known.");
    meta.harmonics = type == "Quality" || (type.empty() && !folder.find("shcoef.bin").empty());
    const LccJson& attributes = meta_json.at("attributes");
    meta.scale = lcc_range(attributes, "scale", "scale");
    meta.far_scale = lcc_range(attributes, "scale", "envscale");
    if (meta.harmonics) {
        meta.shcoef = lcc_range(attributes, "shcoef", "shcoef");
        meta.far_shcoef = lcc_range(attributes, "shcoef", "envshcoef");
    }
    return meta;
}

/// The level's nodes, checked against the sizes of the files that hold them.
std::vector<LccRun> lcc_runs(const LccMeta& meta, const LccFolder& folder, std::size_t level) {
    const fs::path index_path = folder.required("index.bin");
    const std::vector<std::byte> index = read_file(index_path);
    const std::size_t unit = kLccUnit + kLccNode * meta.levels;
    if (index.size() % unit != 0)
        throw Error(index_path.string(),
                    fmt::format("holds {} bytes, which are no units of {}", index.size(), unit),
                    kCopyAgain);
    const fs::path data = folder.required("data.bin");
    const std::uint64_t room = fs::file_size(data);
    std::uint64_t all = 0;
    std::vector<LccRun> runs;
    for (std::size_t at = 0; at < index.size(); at += unit) {
        const std::size_t node = at + kLccUnit + kLccNode * level;
        const std::uint64_t splats = load_le<std::uint32_t>(index, node);
        const LccRun run{load_le<std::uint64_t>(index, node + 4),
                         load_le<std::uint32_t>(index, node + 12)};
        const std::string place = fmt::format("{}, unit {}", index_path.string(), at / unit);
        if (run.size != kLccSplat * splats)
            throw Error(
                place,
                fmt::format("declares {} bytes for {} splats of level {}", run.size, splats, level),
                kCopyAgain);
        if (run.offset > room || run.size > room - run.offset)
            throw Error(place,
                        fmt::format("names bytes {} to {} of {}, which holds {}", run.offset,
                                    run.offset + run.size, data.string(), room),
                        kCopyAgain);
        all += splats;
        if (splats > 0) runs.push_back(run);
    }
    if (all != meta.splats[level] || kLccSplat * all > room)
        throw Error(index_path.string(),
                    fmt::format("has {} splats of level {}; {} says {}", all, level, folder.where,
                                meta.splats[level]),
                    kCopyAgain);
    return runs;
}

/// Uint32 with 11, 10 and 11 bits.
std::array<double, 3> packed_11(std::uint32_t bits) {
    return {(bits & 2047) / 2047.0, (bits >> 11 & 1023) / 1023.0, (bits >> 21 & 2047) / 2047.0};
}

/// Uint32 with three components of 10 bits and the place of the largest; x y z w.
std::array<double, 4> lcc_quaternion(std::uint32_t bits) {
    SmallestThree three{bits >> 30, {}};
    for (unsigned k = 0; k < 3; ++k)
        three.others[k] = ((bits >> (10 * k) & 1023) / 1023.0 * 2 - 1) * std::sqrt(0.5);
    return whole_quaternion(three);
}

struct LccValues {
    const LccRange &scale, &shcoef;
};

void store_lcc_splat(std::span<const std::byte> record, const LccValues& values, std::size_t at,
                     SplatModel& model) {
    for (std::size_t k = 0; k < 3; ++k) {
        model.position[3 * at + k] = load_le<float>(record, 4 * k);
        model.sh_dc[3 * at + k] =
            static_cast<float>(dc_of_colour(static_cast<double>(record[12 + k]) / 255));
        const double scale =
            values.scale.at(k, load_le<std::uint16_t>(record, 16 + 2 * k) / 65535.0);
        model.log_scale[3 * at + k] =
            scale > 0 ? static_cast<float>(std::log(scale)) : -static_cast<float>(LOG_SCALE_LIMIT);
    }
    model.opacity_logit[at] = logit_of_byte(static_cast<std::uint8_t>(record[15]));
    const std::array<double, 4> q = lcc_quaternion(load_le<std::uint32_t>(record, 22));
    for (std::size_t k = 0; k < 4; ++k)
        model.rotation[4 * at + k] = static_cast<float>(q[(k + 3) % 4]);
}

void store_lcc_harmonics(std::span<const std::byte> record, const LccValues& values, std::size_t at,
                         SplatModel& model) {
    const auto rest = static_cast<std::size_t>(model.rest_count());
    for (std::size_t c = 0; c < rest / 3; ++c) {
        const std::array<double, 3> shares = packed_11(load_le<std::uint32_t>(record, 4 * c));
        for (std::size_t k = 0; k < 3; ++k)
            model.sh_rest[at * rest + 3 * c + k] =
                static_cast<float>(values.shcoef.at(k, shares[k]));
    }
}

/// The bytes of a part of a file, whose length was checked.
class LccFile {
  public:
    explicit LccFile(const fs::path& path) : path_(path), stream_(path, std::ios::binary) {}

    std::span<const std::byte> read(std::uint64_t offset, std::size_t size) {
        bytes_.resize(size);
        stream_.clear();
        stream_.seekg(static_cast<std::streamoff>(offset));
        stream_.read(reinterpret_cast<char*>(bytes_.data()), static_cast<std::streamsize>(size));
        if (!stream_ || stream_.gcount() != static_cast<std::streamsize>(size))
            throw Error(path_.string(), fmt::format("has no bytes {} to {}", offset, offset + size),
                        kCopyAgain);
        return bytes_;
    }

  private:
    fs::path path_;
    std::ifstream stream_;
    std::vector<std::byte> bytes_;
};

void read_lcc_run(const LccRun& run, const LccValues& values, LccFile& data, LccFile* shcoef,
                  SplatModel& model, std::size_t& at) {
    for (std::uint64_t done = 0; done < run.size; done += kLccAtATime) {
        const auto size =
            static_cast<std::size_t>(std::min<std::uint64_t>(kLccAtATime, run.size - done));
        const std::span<const std::byte> splats = data.read(run.offset + done, size);
        for (std::size_t i = 0; i < size / kLccSplat; ++i)
            store_lcc_splat(splats.subspan(i * kLccSplat, kLccSplat), values, at + i, model);
        if (shcoef) {
            const std::span<const std::byte> rest = shcoef->read(2 * (run.offset + done), 2 * size);
            for (std::size_t i = 0; i < size / kLccSplat; ++i)
                store_lcc_harmonics(rest.subspan(i * kLccHarmonics, kLccHarmonics), values, at + i,
                                    model);
        }
        at += size / kLccSplat;
    }
}

/// What is far away: splats with their harmonics behind each.
std::vector<std::byte> lcc_environment(const LccMeta& meta, const LccFolder& folder) {
    const fs::path path = folder.find("environment.bin");
    if (path.empty()) return {};
    std::vector<std::byte> bytes = read_file(path);
    const std::size_t record = kLccSplat + (meta.harmonics ? kLccHarmonics : 0);
    if (bytes.size() % record != 0)
        throw Error(path.string(),
                    fmt::format("holds {} bytes, which are no splats of {}", bytes.size(), record),
                    kCopyAgain);
    return bytes;
}

SplatModel read_lcc(const LccMeta& meta, const LccFolder& folder, std::size_t level,
                    SplatFile& file) {
    const std::vector<LccRun> runs = lcc_runs(meta, folder, level);
    const std::vector<std::byte> environment = lcc_environment(meta, folder);
    const std::size_t record = kLccSplat + (meta.harmonics ? kLccHarmonics : 0);
    const std::size_t far = environment.size() / record;
    LccFile data(folder.required("data.bin"));
    std::optional<LccFile> shcoef;
    if (meta.harmonics) shcoef.emplace(folder.required("shcoef.bin"));
    SplatModel model;
    model.sh_degree = meta.harmonics ? kLccDegree : 0;
    model.resize(static_cast<std::size_t>(meta.splats[level]) + far);
    std::size_t at = 0;
    for (const LccRun& run : runs)
        read_lcc_run(run, {meta.scale, meta.shcoef}, data, shcoef ? &*shcoef : nullptr, model, at);
    const LccValues values{meta.far_scale, meta.far_shcoef};
    for (std::size_t i = 0; i < far; ++i, ++at) {
        const auto splat = std::span<const std::byte>(environment).subspan(i * record, record);
        store_lcc_splat(splat, values, at, model);
        if (meta.harmonics) store_lcc_harmonics(splat.subspan(kLccSplat), values, at, model);
    }
    file.bytes += environment.size();
    for (const char* name : {"index.bin", "data.bin", "shcoef.bin"})
        if (const fs::path path = folder.find(name); !path.empty())
            file.bytes += fs::file_size(path);
    if (far > 0)
        file.notes.push_back(
            fmt::format("{} splats of its environment are among those of every level", far));
    return model;
}

void note_lcc_frame(const LccJson& meta_json, SplatFile& file) {
    const auto is = [&](const char* key, double usual) {
        const LccJson list = meta_json.value(key, LccJson::array());
        return std::ranges::all_of(list, [&](const LccJson& one) {
            return one.is_number() && one.get<double>() == usual;
        });
    };
    if (!is("scale", 1) || !is("offset", 0) || !is("shift", 0))
        file.notes.emplace_back(
            "its offset, shift and scale, which place it on earth, are not applied");
}

SplatModel load_lcc(const SplatSource& source, SplatFile& file) try {
    if (source.folder.empty())
        throw Error(source.where, "describes an LCC scene, whose files are not here",
                    "Name its .lcc file in its folder.");
    const auto* begin = reinterpret_cast<const char*>(source.bytes.data());
    const LccJson meta_json =
        parse_json_text({begin, source.bytes.size()}, source.where, kCopyAgain);
    const LccFolder folder{source.folder, source.where};
    const LccMeta meta = lcc_meta(meta_json, folder);
    const std::size_t level = level_to_read(source, meta.levels);
    file.details = fmt::format(
        "Data Organization Format originated from XGRIDS; level {} of 0 "
        "(finest) to {}",
        level, meta.levels - 1);
    file.up = "z";
    SplatModel model = read_lcc(meta, folder, level, file);
    model.metres_per_unit = 1;
    note_lcc_frame(meta_json, file);
    if (meta.levels > 1 && !source.units.level) file.notes.push_back(level_note(meta.levels));
    file.dropped = drop_non_finite(model);
    return model;
} catch (const LccJson::exception& error) {
    throw Error(source.where, json_reason(error), kCopyAgain);
}

bool is_lcc(const SplatSource& source) {
    const std::size_t probed = std::min(source.bytes.size(), kLccProbed);
    const std::string_view head(reinterpret_cast<const char*>(source.bytes.data()), probed);
    const std::size_t first = head.find_first_not_of(" \t\r\n");
    return first != std::string_view::npos && head[first] == '{' &&
           head.find("\"totalLevel\"") != std::string_view::npos;
}

}  // namespace

const SplatFormatRow& lcc_format() {
    static const SplatFormatRow row{.name = "LCC",
                                    .endings = {".lcc"},
                                    .recognise = is_lcc,
                                    .parse = load_lcc,
                                    .has_levels = true};
    return row;
}

}  // namespace darb
