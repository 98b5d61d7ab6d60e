#include "engine/primitives/tuning.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>

#include "engine/core/check.h"
#include "engine/core/error.h"
#include "shaders/shared/render_args.h"

namespace darb {

namespace {

constexpr std::uint32_t kTilePixels = TILE_SIZE * TILE_SIZE, kBlocks = 4;
constexpr std::uint32_t kListBytes = 128 * 8;  // lib/hits.glsl: CHUNK pairs of two words a subgroup

std::uint32_t clamped_subgroup(const DeviceInfo& info) {
    return std::clamp(info.subgroup_size, 4u, 64u);
}

std::string shape_name(std::uint32_t threads) {
    return fmt::format("{}x{}", threads, kTilePixels / threads);
}

// Threads x pixels of a thread. A subgroup a block first, which is the best on lavapipe. Of more
// pixels a thread than 8 none but that one: loops over them are unrolled, and compile for minutes.
std::vector<std::string> blend_shapes(const DeviceInfo& info) {
    const std::uint32_t subgroup = clamped_subgroup(info);
    std::vector<std::string> shapes{shape_name(kBlocks * subgroup)};
    for (std::uint32_t threads = kTilePixels; threads >= std::max(subgroup, kTilePixels / 8);
         threads /= 2) {
        const bool fits = threads <= info.max_workgroup_threads &&
                          threads / subgroup * kListBytes <= info.shared_memory_bytes;
        if (fits && threads != kBlocks * subgroup) shapes.push_back(shape_name(threads));
    }
    return shapes;
}

std::string known_names(const std::vector<TuningGroup>& groups) {
    std::string text;
    for (const TuningGroup& group : groups)
        text += fmt::format("{}{}={}", text.empty() ? "" : ", ", group.name,
                            fmt::join(group.ways, "|"));
    return text;
}

Variants checked(const DeviceInfo& info, const Variants& variants, const std::string& where) {
    const std::vector<TuningGroup> groups = tuning_groups(info);
    for (const auto& variant : variants) {
        const std::string &name = variant.first, &way = variant.second;
        const auto group = std::find_if(groups.begin(), groups.end(),
                                        [&](const TuningGroup& g) { return g.name == name; });
        const std::string known = "Known here: " + known_names(groups) + ".";
        if (group == groups.end())
            throw Error(where, fmt::format("'{}' names no choice", name), known);
        if (std::find(group->ways.begin(), group->ways.end(), way) == group->ways.end())
            throw Error(where, fmt::format("'{}' is no way of '{}' on {}", way, name, info.name),
                        known);
    }
    return variants;
}

}  // namespace

bool is_known_device(const DeviceInfo& info) {
    return info.driver.starts_with("llvmpipe");
}

std::vector<TuningGroup> tuning_groups(const DeviceInfo& info) {
    using Names = std::vector<std::string>;
    const bool lavapipe = is_known_device(info);
    return {{"scan",
             lavapipe ? Names{"thread", "subgroup"} : Names{"subgroup", "thread"},
             {"compact", "depth sort", "emit", "tile sort"}},
            {"scatter",
             lavapipe ? Names{"columns", "ballot"} : Names{"ballot", "columns"},
             {"depth sort", "tile sort"}},
            {"blend", blend_shapes(info), {"blend"}},
            {"backward", {"subgroup", "buckets"}, {"blend", "blend backward"}, true}};
}

Variants default_variants(const DeviceInfo& info) {
    Variants variants;
    for (const TuningGroup& group : tuning_groups(info)) variants[group.name] = group.ways.front();
    return variants;
}

Variants parse_variants(const DeviceInfo& info, std::string_view text, const std::string& where) {
    Variants variants;
    while (!text.empty()) {
        const std::string_view one = text.substr(0, text.find(','));
        text.remove_prefix(std::min(one.size() + 1, text.size()));
        const std::size_t equals = one.find('=');
        if (equals == std::string_view::npos)
            throw Error(where, fmt::format("'{}' is not of the form NAME=WAY", one),
                        "Known here: " + known_names(tuning_groups(info)) + ".");
        variants[std::string(one.substr(0, equals))] = one.substr(equals + 1);
    }
    return checked(info, variants, where);
}

std::string variants_text(const Variants& variants) {
    std::string text;
    for (const char* name : {"scan", "scatter", "blend", "backward"})
        if (const auto found = variants.find(name); found != variants.end())
            text += fmt::format("{}{}={}", text.empty() ? "" : ",", name, found->second);
    return text;
}

Variants all_variants(const Device& device) {
    const DeviceInfo& info = device.info();
    Variants variants = checked(info, device.variants(), info.name);
    if (const char* text = std::getenv("DARB_TUNE"); text != nullptr)
        variants.merge(parse_variants(info, text, "DARB_TUNE"));
    variants.merge(default_variants(info));
    return variants;
}

Tuning tuning_of(const Device& device) {
    const Variants variants = all_variants(device);
    Tuning tuning;
    tuning.scan_by_thread = variants.at("scan") == "thread";
    tuning.scatter = variants.at("scatter") == "columns" ? RadixSort::Strategy::columns
                                                         : RadixSort::Strategy::ballot;
    const std::string& shape = variants.at("blend");
    std::from_chars(shape.data(), shape.data() + shape.size(), tuning.blend_threads);
    tuning.backward =
        variants.at("backward") == "buckets" ? BackwardBlend::buckets : BackwardBlend::subgroup;
    return tuning;
}

std::string result_variants(const Device& device) {
    Variants variants = all_variants(device);
    for (const TuningGroup& group : tuning_groups(device.info()))
        if (!group.changes_bits) variants.erase(group.name);
    return variants_text(variants);
}

}  // namespace darb
