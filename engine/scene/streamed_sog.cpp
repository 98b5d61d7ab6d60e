// SPDX-License-Identifier: MIT
// Streamed SOG version 1 (PlayCanvas): lod-meta.json and a folder with an unbundled SOG scene for
// each file of a level. A tree of boxes says which rows of which file are in a leaf, level by
// level. Source: developer.playcanvas.com, "The Streamed SOG Format".
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/gtc/quaternion.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/core/text.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/inflate.h"
#include "engine/scene/merge_splats.h"
#include "engine/scene/quantise.h"
#include "engine/scene/sog.h"
#include "engine/scene/splat_format.h"

namespace darb {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr int kMostLodDepth = 256;             // nesting of the JSON
constexpr std::size_t kLeafSplats = 16 << 10;  // most splats in a leaf of the finest level
constexpr std::size_t kLeastLevel = 500;       // splats
constexpr std::size_t kLeafNeighbours = 256;   // for chunk_order

/// A range of rows in a file.
struct LodRange {
    std::size_t file = 0, offset = 0, count = 0;
};

std::size_t lod_number(const json& object, const char* key) {
    const json& value = object.at(key);
    if (!value.is_number_unsigned())
        throw json::type_error::create(302, fmt::format("{} is no whole number", key), &object);
    return value.get<std::size_t>();
}

/// The ranges of the wanted level, over all leaves that have it, in the order of the tree; without
/// `wanted`, the finest level of each leaf.
std::vector<LodRange> ranges_of(const json& tree, std::optional<std::size_t> wanted) {
    std::vector<LodRange> ranges;
    std::vector<const json*> stack{&tree};
    while (!stack.empty()) {
        const json& node = *stack.back();
        stack.pop_back();
        if (node.contains("children"))
            for (const json& child : node.at("children")) stack.push_back(&child);
        if (!node.contains("lods")) continue;
        const json* found = nullptr;
        long level = 0;
        for (const auto& [key, lod] : node.at("lods").items()) {
            const long at = std::strtol(key.c_str(), nullptr, 10);
            if (wanted ? at != static_cast<long>(*wanted) : found && at >= level) continue;
            found = &lod;
            level = at;
        }
        if (found)
            ranges.push_back({lod_number(*found, "file"), lod_number(*found, "offset"),
                              lod_number(*found, "count")});
    }
    return ranges;
}

/// The folder of a listed file, which must be below that of lod-meta.json.
fs::path chunk_folder(const fs::path& folder, const std::string& name, const std::string& where) {
    const fs::path path = name;
    const bool outside = path.filename() != "meta.json" || path.is_absolute() ||
                         name.find_first_of(std::string_view(":\\\0", 3)) != std::string::npos ||
                         std::ranges::any_of(path, [](const fs::path& one) { return one == ".."; });
    if (outside)
        throw Error(where,
                    "names '" + printable(name) + "', which is no meta.json in a folder below",
                    "Keep the folders of the parts beside lod-meta.json.");
    return folder / path.parent_path();
}

void append_rows(const SplatModel& from, std::size_t offset, std::size_t count, SplatModel& to,
                 std::vector<double>& positions) {
    for (std::size_t i = offset; i < offset + count; ++i) {
        const glm::dvec3 p = position_of(from, i);
        positions.insert(positions.end(), {p.x, p.y, p.z});
    }
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::size_t width = from.floats(a), wide = to.floats(a);
        std::vector<float>& out = attribute_values(to, a);
        for (std::size_t i = offset; i < offset + count; ++i) {
            const auto row =
                attribute_values(from, a).begin() + static_cast<std::ptrdiff_t>(i * width);
            out.insert(out.end(), row, row + static_cast<std::ptrdiff_t>(width));
            out.resize(out.size() + wide - width);  // harmonics of a higher degree: 0
        }
    }
}

json parse_lod(const SplatSource& source) {
    const auto* begin = reinterpret_cast<const char*>(source.bytes.data());
    const json::parser_callback_t limit = [&](int depth, json::parse_event_t, json&) {
        if (depth > kMostLodDepth)
            throw Error(source.where,
                        fmt::format("its JSON is nested more than {} deep", kMostLodDepth),
                        kCopyAgain);
        return true;
    };
    return json::parse(begin, begin + source.bytes.size(), limit);
}

/// Each named file is read once, as a whole.
std::map<std::size_t, SplatModel> read_chunks_of(const json& meta, const SplatSource& source,
                                                 const std::vector<LodRange>& ranges,
                                                 SplatFile& file) {
    std::map<std::size_t, SplatModel> chunks;
    std::map<std::size_t, fs::path> folders;
    std::uint64_t stored = source.bytes.size(), splats = 0;
    for (const LodRange& range : ranges) {
        splats += range.count;
        if (folders.contains(range.file)) continue;
        const auto name = meta.at("filenames").at(range.file).get<std::string>();
        const fs::path folder = chunk_folder(source.folder, name, source.where);
        folders[range.file] = folder;
        std::error_code none;
        for (const auto& entry : fs::directory_iterator(folder, none))
            if (entry.is_regular_file(none)) stored += entry.file_size(none);
    }
    check_expansion(stored, 4 * splat_floats(kMaxShDegree) * splats, source.where);
    for (const auto& [index, folder] : folders) {
        SogFacts facts;
        chunks[index] = read_sog_folder(folder, &facts);
        if (facts.dropped > 0)
            throw Error(folder.string(), "holds splats with NaN, so its rows cannot be numbered",
                        kCopyAgain);
        file.notes.insert(file.notes.end(), facts.notes.begin(), facts.notes.end());
    }
    file.bytes = stored;
    return chunks;
}

SplatModel load_level(const SplatSource& source, SplatFile& file,
                      std::optional<std::size_t> wanted) try {
    const json meta = parse_lod(source);
    file.version = static_cast<int>(
        std::min<std::size_t>(meta.contains("version") ? lod_number(meta, "version") : 1, 1000));
    if (file.version != 1)
        throw Error(source.where,
                    fmt::format("is streamed SOG version {}; 1 is known", file.version),
                    "Name the folder of one of its parts, which has a meta.json.");
    if (source.folder.empty())
        throw Error(source.where, "describes a streamed SOG scene, whose files are not here",
                    "Name its lod-meta.json, or its folder.");
    const std::size_t levels = lod_number(meta, "lodLevels");
    if (!wanted && source.units.level) wanted = level_to_read(source, levels);
    const std::vector<LodRange> ranges = ranges_of(meta.at("tree"), wanted);
    const std::map<std::size_t, SplatModel> chunks = read_chunks_of(meta, source, ranges, file);
    SplatModel model;
    for (const auto& [index, chunk] : chunks) {
        model.sh_degree = std::max(model.sh_degree, chunk.sh_degree);
        model.antialias = chunk.antialias;
        model.metres_per_unit = chunk.metres_per_unit;
    }
    std::vector<double> positions;
    for (const LodRange& range : ranges) {
        const SplatModel& chunk = chunks.at(range.file);
        if (range.offset > chunk.size() || range.count > chunk.size() - range.offset)
            throw Error(source.where,
                        fmt::format("rows {} to {} of a file of {} splats", range.offset,
                                    range.offset + range.count, chunk.size()),
                        kCopyAgain);
        append_rows(chunk, range.offset, range.count, model, positions);
    }
    set_positions(positions, model);
    file.details = fmt::format("{} levels, {} files", levels, meta.at("filenames").size());
    if (wanted) file.details += fmt::format(", level {}", *wanted);
    if (levels > 1 && !wanted) file.notes.push_back(level_note(levels));
    return model;
} catch (const json::parse_error& error) {
    throw Error(
        source.where,
        json_fault({reinterpret_cast<const char*>(source.bytes.data()), source.bytes.size()},
                   error),
        kCopyAgain);
} catch (const json::exception& error) {
    throw Error(source.where, json_reason(error), kCopyAgain);
}

SplatModel load_streamed(const SplatSource& source, SplatFile& file) {
    return load_level(source, file, std::nullopt);
}

/// The state of writing: the levels, and which splats of each level are in a leaf.
struct LodWriter {
    std::vector<const SplatModel*> levels;
    EncodeOptions options;
    std::string where;
    std::vector<std::vector<std::uint32_t>> filling;  // [level] splats of the file that is being
                                                      // filled, in order
    std::vector<std::size_t> files;                   // number of files, by level
    std::vector<std::size_t> counts;
    std::size_t written = 0, all = 0;  // splats over all levels
    json filenames = json::array();
    EncodedSplats encoded;
};

using LodSplats = std::vector<std::vector<std::uint32_t>>;  // [level] indices of splats

json bound_of(const LodWriter& writer, const LodSplats& splats) {
    glm::dvec3 low(1e300), high(-1e300);
    for (std::size_t level = 0; level < splats.size(); ++level)
        for (const std::uint32_t i : splats[level]) {
            const SplatModel& model = *writer.levels[level];
            const float *q = &model.rotation[4 * std::size_t{i}],
                        *s = &model.log_scale[3 * std::size_t{i}];
            const glm::dmat3 axes =
                glm::mat3_cast(glm::normalize(glm::dquat(q[0], q[1], q[2], q[3])));
            glm::dvec3 half(0.0);
            for (int k = 0; k < 3; ++k)
                half += glm::abs(axes[k]) * std::exp(double{drawn_log_scale(s[k])});
            low = glm::min(low, position_of(model, i) - half);
            high = glm::max(high, position_of(model, i) + half);
        }
    return {{"min", {low.x, low.y, low.z}}, {"max", {high.x, high.y, high.z}}};
}

std::string chunk_name(std::size_t level, std::size_t file) {
    return fmt::format("{}_{}/meta.json", level, file);
}

/// Writes the level's current file, and begins another.
void end_file(LodWriter& writer, std::size_t level) {
    if (writer.filling[level].empty()) return;
    const std::string name = chunk_name(level, writer.files[level]++);
    EncodeOptions options = writer.options;
    const auto before = static_cast<double>(writer.written), all = static_cast<double>(writer.all),
               size = static_cast<double>(writer.filling[level].size());
    if (options.progress)
        options.progress = [&](double share) {
            writer.options.progress((before + share * size) / all);
        };
    writer.written += writer.filling[level].size();
    EncodedSplats parts =
        encode_sog_parts(pick_splats(*writer.levels[level], writer.filling[level]),
                         writer.where + ", " + name, options);
    const std::string folder = name.substr(0, name.find('/') + 1);
    writer.encoded.beside.emplace_back(name, std::move(parts.file));
    for (auto& [part, bytes] : parts.beside)
        writer.encoded.beside.emplace_back(folder + part, std::move(bytes));
    writer.filling[level].clear();
}

json leaf_of(LodWriter& writer, const LodSplats& splats) {
    json lods = json::object();
    for (std::size_t level = 0; level < splats.size(); ++level) {
        if (splats[level].empty()) continue;
        std::vector<std::uint32_t>& filling = writer.filling[level];
        // A leaf is never split.
        if (filling.size() + splats[level].size() > writer.options.file_splats)
            end_file(writer, level);
        const std::string name = chunk_name(level, writer.files[level]);
        auto at = std::ranges::find(writer.filenames, json(name));
        if (at == writer.filenames.end()) {
            writer.filenames.push_back(name);
            at = writer.filenames.end() - 1;
        }
        lods[std::to_string(level)] = {{"file", at - writer.filenames.begin()},
                                       {"offset", filling.size()},
                                       {"count", splats[level].size()}};
        const SplatModel leaf = pick_splats(*writer.levels[level], splats[level]);
        for (const std::uint32_t i : chunk_order(leaf, kLeafNeighbours))
            filling.push_back(splats[level][i]);
        writer.counts[level] += splats[level].size();
    }
    return {{"bound", bound_of(writer, splats)}, {"lods", lods}};
}

/// Halves at the median of the finest level on its widest axis, until leaves are small.
json node_of(LodWriter& writer, LodSplats splats) {
    std::vector<std::uint32_t>& finest = splats[0];
    if (finest.size() <= kLeafSplats) return leaf_of(writer, splats);
    glm::dvec3 low(1e300), high(-1e300);
    for (const std::uint32_t i : finest) {
        low = glm::min(low, position_of(*writer.levels[0], i));
        high = glm::max(high, position_of(*writer.levels[0], i));
    }
    const glm::dvec3 width = high - low;
    const int axis = width.x >= width.y && width.x >= width.z ? 0 : width.y >= width.z ? 1 : 2;
    const auto place = [&](std::size_t level, std::uint32_t i) {
        return position_of(*writer.levels[level], i)[axis];
    };
    const auto middle = finest.begin() + static_cast<std::ptrdiff_t>(finest.size() / 2);
    std::nth_element(finest.begin(), middle, finest.end(), [&](std::uint32_t a, std::uint32_t b) {
        return place(0, a) != place(0, b) ? place(0, a) < place(0, b) : a < b;
    });
    const double border = place(0, *middle);
    LodSplats below(splats.size()), above(splats.size());
    below[0].assign(finest.begin(), middle);
    above[0].assign(middle, finest.end());
    for (std::size_t level = 1; level < splats.size(); ++level)
        for (const std::uint32_t i : splats[level])
            (place(level, i) < border ? below : above)[level].push_back(i);
    json bound = bound_of(writer, splats), first = node_of(writer, std::move(below)),
         second = node_of(writer, std::move(above));
    return {{"bound", std::move(bound)}, {"children", {std::move(first), std::move(second)}}};
}

/// Levels with a quarter and a sixteenth of the splats.
std::vector<std::size_t> usual_levels(std::size_t splats) {
    std::vector<std::size_t> counts;
    for (const std::size_t part : {4, 16})
        if (splats / part >= kLeastLevel) counts.push_back(splats / part);
    return counts;
}

EncodedSplats encode_streamed(const SplatModel& model, const std::string& where,
                              const EncodeOptions& options) {
    if (model.size() == 0)
        throw Error(where, "streamed SOG cannot store a scene without splats", "Write a PLY.");
    LodWriter writer;
    writer.options = options;
    writer.where = where;
    writer.levels = {&model};
    const std::vector<SplatModel> merged = options.coarser.empty()
                                               ? merge_levels(model, usual_levels(model.size()))
                                               : std::vector<SplatModel>{};
    for (const SplatModel& coarser : options.coarser.empty() ? merged : options.coarser)
        writer.levels.push_back(&coarser);
    const std::size_t levels = writer.levels.size();
    writer.filling.resize(levels);
    writer.files.resize(levels);
    writer.counts.resize(levels);
    LodSplats all(levels);
    for (std::size_t level = 0; level < levels; ++level) {
        all[level].resize(writer.levels[level]->size());
        std::iota(all[level].begin(), all[level].end(), 0u);
        writer.all += all[level].size();
    }
    json tree = node_of(writer, std::move(all));
    for (std::size_t level = 0; level < levels; ++level) end_file(writer, level);
    const std::size_t count =
        std::accumulate(writer.counts.begin(), writer.counts.end(), std::size_t{0});
    const json meta = {{"version", 1},           {"asset", {{"generator", "darb " DARB_VERSION}}},
                       {"count", count},         {"counts", writer.counts},
                       {"lodLevels", levels},    {"filenames", writer.filenames},
                       {"tree", std::move(tree)}};
    const std::string text = meta.dump();
    const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
    writer.encoded.file.assign(bytes.begin(), bytes.end());
    return std::move(writer.encoded);
}

}  // namespace

std::size_t level_of_part(const std::string& name) {
    return std::stoul(name);
}

SplatModel load_streamed_level(const fs::path& path, std::size_t level) {
    const std::vector<std::byte> bytes = read_file(path);
    SplatFile file;
    return load_level({bytes, path.string(), path.parent_path(), {}}, file, level);
}

const SplatFormatRow& streamed_sog_format() {
    static const SplatFormatRow row{.name = "streamed SOG",
                                    .endings = {"lod-meta.json"},
                                    .folder_file = "lod-meta.json",
                                    .recognise =
                                        [](const SplatSource& source) {
                                            return fs::path(source.where).filename() ==
                                                   "lod-meta.json";
                                        },
                                    .parse = load_streamed,
                                    .encode = encode_streamed,
                                    .keeps = kKeepsRenderMode | kKeepsHarmonics | kKeepsUnit,
                                    .has_levels = true};
    return row;
}

}  // namespace darb
