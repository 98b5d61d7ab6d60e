// SPDX-License-Identifier: MIT
#include "engine/plan/tuning_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "engine/core/error.h"
#include "shaders/shared/render_args.h"

namespace darb {

namespace {

constexpr std::uint32_t kTilePixels = TILE_SIZE * TILE_SIZE, kBlocks = 4;
constexpr std::uint32_t kListBytes =
    128 * 8;  // lib/hits.glsl: CHUNK intersections of two words a subgroup
constexpr std::uint32_t kRecordBytes = 3 * 16;  // lib/records.glsl: a splat of each lane
constexpr const char* kRecords = "records";

std::uint32_t clamped_subgroup(const DeviceInfo& info) {
    return std::clamp(info.subgroup_size, 4u, 64u);
}

std::string shape_name(std::uint32_t threads) {
    return fmt::format("{}x{}", threads, kTilePixels / threads);
}

template <std::size_t count, class Enum>
std::vector<std::string> usual_first(const char* const (&all)[count], Enum usual) {
    const std::string first = all[static_cast<std::size_t>(usual)];
    std::vector<std::string> names{first};
    for (const char* name : all)
        if (name != first) names.emplace_back(name);
    return names;
}

template <class Enum, std::size_t count>
Enum named(const char* const (&all)[count], const std::string& name) {
    return static_cast<Enum>(std::find(std::begin(all), std::end(all), name) - std::begin(all));
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
    if (kBlocks * (kListBytes + subgroup * kRecordBytes) <= info.shared_memory_bytes)
        shapes.emplace_back(kRecords);
    return shapes;
}

std::vector<std::string> backward_blends(const DeviceInfo& info) {
    std::vector<std::string> forms = usual_first(kBackwardBlends, usual_tuning(info).backward);
    if (lanes_by_pixels(info, clamped_subgroup(info)) == 0)
        std::erase_if(forms, [](const std::string& form) {
            return is_by_pixels(named<BackwardBlend>(kBackwardBlends, form));
        });
    return forms;
}

// The device's own first. A subgroup's list of a tile is in shared memory. One size is no choice.
std::vector<std::string> blend_lanes(const DeviceInfo& info) {
    const std::uint32_t own = clamped_subgroup(info);
    std::vector<std::string> lanes{std::to_string(own)};
    const std::uint32_t most = std::min(info.max_subgroup_size, 64u);
    for (std::uint32_t size = std::max(info.min_subgroup_size, 4u); size <= most; size *= 2)
        if (size != own && kTilePixels / size * kListBytes <= info.shared_memory_bytes)
            lanes.push_back(std::to_string(size));
    return lanes;
}

std::string known_names(const std::vector<TuningGroup>& groups) {
    std::string text;
    for (const TuningGroup& group : groups)
        text += fmt::format("{}{}={}", text.empty() ? "" : ", ", group.name,
                            fmt::join(group.choices, "|"));
    return text;
}

void check_names(const DeviceInfo& info, const TuningNames& names, const std::string& where) {
    const std::vector<TuningGroup> groups = tuning_groups(info);
    const std::string known = "Known here: " + known_names(groups) + ".";
    for (const auto& named : names) {
        const std::string &name = named.first, &choice = named.second;
        const auto group = std::find_if(groups.begin(), groups.end(),
                                        [&](const TuningGroup& g) { return g.name == name; });
        if (group == groups.end())
            throw Error(where, fmt::format("'{}' names no choice", name), known);
        if (std::find(group->choices.begin(), group->choices.end(), choice) == group->choices.end())
            throw Error(where,
                        fmt::format("'{}' is no choice of '{}' on {}", choice, name, info.name),
                        known);
    }
}

TuningNames split_names(const DeviceInfo& info, std::string_view text, const std::string& where) {
    TuningNames names;
    while (!text.empty()) {
        const std::string_view one = text.substr(0, text.find(','));
        text.remove_prefix(std::min(one.size() + 1, text.size()));
        const std::size_t equals = one.find('=');
        if (equals == std::string_view::npos)
            throw Error(where, fmt::format("'{}' is not of the form NAME=CHOICE", one),
                        "Known here: " + known_names(tuning_groups(info)) + ".");
        names[std::string(one.substr(0, equals))] = one.substr(equals + 1);
    }
    return names;
}

}  // namespace

bool is_known_device(const DeviceInfo& info) {
    return info.driver.starts_with("llvmpipe");
}

std::vector<TuningGroup> tuning_groups(const DeviceInfo& info) {
    using Names = std::vector<std::string>;
    const bool lavapipe = is_known_device(info);
    std::vector<TuningGroup> groups{
        {"scan",
         lavapipe ? Names{"thread", "subgroup"} : Names{"subgroup", "thread"},
         {"compact", "depth sort", "emit", "tile sort"}},
        {"scatter",
         usual_first(kSortScatters, usual_tuning(info).scatter),
         {"depth sort", "tile sort"}},
        {"blend", blend_shapes(info), {"blend"}},
        {"backward", backward_blends(info), {"blend", "blend backward"}, true},
        {"loss", usual_first(kLossWays, usual_tuning(info).loss), {"loss"}},
        {"exp", {"polynomial", "builtin"}, {"blend", "blend backward"}, true},
        {"photos", usual_first(kPhotoPlaces, usual_tuning(info).photos), {}}};
    if (const std::vector<std::string> lanes = blend_lanes(info); lanes.size() > 1)
        groups.push_back({"lanes", lanes, {"blend", "blend backward"}, true});
    return groups;
}

TuningNames parse_tuning(const DeviceInfo& info, std::string_view text, const std::string& where) {
    TuningNames names = split_names(info, text, where);
    check_names(info, names, where);
    return names;
}

TuningNames checkpoint_tuning(const DeviceInfo& info, std::string_view text,
                              const std::string& where) {
    TuningNames names = split_names(info, text, where);
    const std::vector<std::string> lanes = blend_lanes(info);
    if (const auto named = names.find("lanes");
        named != names.end() &&
        (lanes.size() == 1 || std::find(lanes.begin(), lanes.end(), named->second) == lanes.end()))
        names.erase(named);
    check_names(info, names, where);
    return names;
}

std::string names_text(const TuningNames& names) {
    std::string text;
    for (const char* name :
         {"scan", "scatter", "blend", "backward", "loss", "exp", "photos", "lanes"})
        if (const auto found = names.find(name); found != names.end())
            text += fmt::format("{}{}={}", text.empty() ? "" : ",", name, found->second);
    return text;
}

TuningNames tuning_names(const Tuning& tuning) {
    TuningNames names{
        {"scan", tuning.scan_by_thread ? "thread" : "subgroup"},
        {"scatter", kSortScatters[static_cast<std::size_t>(tuning.scatter)]},
        {"blend", tuning.blend_records ? std::string(kRecords) : shape_name(tuning.blend_threads)},
        {"backward", kBackwardBlends[static_cast<std::size_t>(tuning.backward)]},
        {"loss", kLossWays[static_cast<std::size_t>(tuning.loss)]},
        {"exp", tuning.exp_builtin ? "builtin" : "polynomial"},
        {"photos", kPhotoPlaces[static_cast<std::size_t>(tuning.photos)]}};
    if (tuning.blend_lanes != 0) names["lanes"] = std::to_string(tuning.blend_lanes);
    return names;
}

Tuning with_names(Tuning tuning, const TuningNames& names) {
    for (const auto& [name, choice] : names) {
        if (name == "scan") tuning.scan_by_thread = choice == "thread";
        if (name == "scatter") tuning.scatter = named<SortScatter>(kSortScatters, choice);
        if (name == "blend") tuning.blend_records = choice == kRecords;
        if (name == "blend" && choice != kRecords)
            std::from_chars(choice.data(), choice.data() + choice.size(), tuning.blend_threads);
        if (name == "lanes")
            std::from_chars(choice.data(), choice.data() + choice.size(), tuning.blend_lanes);
        if (name == "backward") tuning.backward = named<BackwardBlend>(kBackwardBlends, choice);
        if (name == "loss") tuning.loss = named<LossWay>(kLossWays, choice);
        if (name == "exp") tuning.exp_builtin = choice == "builtin";
        if (name == "photos") tuning.photos = named<PhotoPlace>(kPhotoPlaces, choice);
    }
    return tuning;
}

Tuning resumed_tuning(const DeviceInfo& info, Tuning tuning, std::string_view text,
                      const std::string& where) {
    tuning.blend_lanes = 0;
    tuning.blend_records = false;
    tuning.exp_builtin = false;
    return with_names(tuning, checkpoint_tuning(info, text, where));
}

std::string result_tuning(const Device& device) {
    TuningNames names = tuning_names(device.tuning());
    const bool records = device.tuning().blend_records;
    for (const TuningGroup& group : tuning_groups(device.info()))
        if (!group.changes_bits && !(records && group.name == "blend")) names.erase(group.name);
    if (!device.tuning().exp_builtin) names.erase("exp");
    return names_text(names);
}

}  // namespace darb
