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
             usual_first(kSortScatters, usual_tuning(info).scatter),
             {"depth sort", "tile sort"}},
            {"blend", blend_shapes(info), {"blend"}},
            {"backward",
             usual_first(kBackwardBlends, usual_tuning(info).backward),
             {"blend", "blend backward"},
             true},
            {"loss", usual_first(kLossWays, usual_tuning(info).loss), {"loss"}}};
}

TuningNames parse_tuning(const DeviceInfo& info, std::string_view text, const std::string& where) {
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
    check_names(info, names, where);
    return names;
}

std::string names_text(const TuningNames& names) {
    std::string text;
    for (const char* name : {"scan", "scatter", "blend", "backward", "loss"})
        if (const auto found = names.find(name); found != names.end())
            text += fmt::format("{}{}={}", text.empty() ? "" : ",", name, found->second);
    return text;
}

TuningNames tuning_names(const Tuning& tuning) {
    return {{"scan", tuning.scan_by_thread ? "thread" : "subgroup"},
            {"scatter", kSortScatters[static_cast<std::size_t>(tuning.scatter)]},
            {"blend", shape_name(tuning.blend_threads)},
            {"backward", kBackwardBlends[static_cast<std::size_t>(tuning.backward)]},
            {"loss", kLossWays[static_cast<std::size_t>(tuning.loss)]}};
}

Tuning with_names(Tuning tuning, const TuningNames& names) {
    for (const auto& [name, choice] : names) {
        if (name == "scan") tuning.scan_by_thread = choice == "thread";
        if (name == "scatter") tuning.scatter = named<SortScatter>(kSortScatters, choice);
        if (name == "blend")
            std::from_chars(choice.data(), choice.data() + choice.size(), tuning.blend_threads);
        if (name == "backward") tuning.backward = named<BackwardBlend>(kBackwardBlends, choice);
        if (name == "loss") tuning.loss = named<LossWay>(kLossWays, choice);
    }
    return tuning;
}

std::string result_tuning(const Device& device) {
    TuningNames names = tuning_names(device.tuning());
    for (const TuningGroup& group : tuning_groups(device.info()))
        if (!group.changes_bits) names.erase(group.name);
    return names_text(names);
}

}  // namespace darb
