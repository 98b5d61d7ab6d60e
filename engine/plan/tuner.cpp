// SPDX-License-Identifier: MIT
#include "engine/plan/tuner.h"
#include "engine/gpu/shader_table.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <span>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/rng.h"
#include "engine/core/say.h"
#include "engine/core/scope_guard.h"
#include "engine/gpu/pipeline.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/raster/kernel_constants.h"
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
        {"lists", {"digits", "counts"}, {"tile sort", "tile ranges"}},
        {"depths", {"four", "three"}, {"compact", "depth sort"}},
        {"emit", {"splats", "slots"}, {"emit"}},
        {"tiles", {"rows", "longest"}, {"tile ranges", "blend", "blend backward"}},
        {"blend", blend_shapes(info), {"blend"}},
        {"backward", backward_blends(info), {"blend", "blend backward"}, true},
        {"sums", {"splats", "chunks"}, {"project backward"}, true},
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
    for (const char* name : {"scan", "scatter", "lists", "depths", "emit", "tiles", "blend",
                             "backward", "sums", "loss", "exp", "photos", "lanes"})
        if (const auto found = names.find(name); found != names.end())
            text += fmt::format("{}{}={}", text.empty() ? "" : ",", name, found->second);
    return text;
}

TuningNames tuning_names(const Tuning& tuning) {
    TuningNames names{
        {"scan", tuning.scan_by_thread ? "thread" : "subgroup"},
        {"scatter", kSortScatters[static_cast<std::size_t>(tuning.scatter)]},
        {"lists", tuning.count_lists ? "counts" : "digits"},
        {"depths", tuning.short_depths ? "three" : "four"},
        {"emit", tuning.emit_by_slots ? "slots" : "splats"},
        {"tiles", tuning.longest_first ? "longest" : "rows"},
        {"sums", tuning.sums_by_chunks ? "chunks" : "splats"},
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
        if (name == "lists") tuning.count_lists = choice == "counts";
        if (name == "depths") tuning.short_depths = choice == "three";
        if (name == "emit") tuning.emit_by_slots = choice == "slots";
        if (name == "tiles") tuning.longest_first = choice == "longest";
        if (name == "sums") tuning.sums_by_chunks = choice == "chunks";
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
    tuning.sums_by_chunks = false;
    return with_names(tuning, checkpoint_tuning(info, text, where));
}

std::string result_tuning(const Device& device) {
    TuningNames names = tuning_names(device.tuning());
    const bool records = device.tuning().blend_records;
    for (const TuningGroup& group : tuning_groups(device.info()))
        if (!group.changes_bits && !(records && group.name == "blend")) names.erase(group.name);
    if (!device.tuning().exp_builtin) names.erase("exp");
    if (!device.tuning().sums_by_chunks) names.erase("sums");
    return names_text(names);
}

namespace {

constexpr int kFormat =
    6;  // before 6 the first form of a group was timed while the GPU still idled

// A frame of a CPU must not take long, one of a GPU must not be too short to tell ways apart.
struct Size {
    std::uint32_t splats;
    int width, height;
    double scale;  // standard deviation of a splat, of a sphere of radius 1 that fills the picture
    // One splat in so many is large, as trained scenes have some: 8 times the scale, and one in 16
    // of them 40 times. 0: none.
    std::uint32_t large_every;
};

Size size_for(const DeviceInfo& info) {
    if (info.type == "cpu") return {1'500, 160, 112, 0.04, 0};
    return {200'000, 1280, 720, 0.01, 256};
}

// A CPU is not slow when it idles, and its frames take long.
TimingEffort effort_for(const DeviceInfo& info) {
    if (info.type == "cpu") return {0, 0, 2, 3, 2};
    return {0.6, 4, 9, 25, 1};
}

SplatModel tuning_scene(const Size& size) {
    SplatModel model;
    model.resize(size.splats);
    Pcg32 random(7, 7);
    for (std::size_t i = 0; i < size.splats; ++i) {
        glm::dvec3 p;
        do
            for (int a = 0; a < 3; ++a) p[a] = random.uniform(-1, 1);
        while (glm::dot(p, p) > 1);
        for (std::size_t a = 0; a < 3; ++a) {
            model.position[3 * i + a] = static_cast<float>(p[static_cast<int>(a)]);
            model.log_scale[3 * i + a] =
                static_cast<float>(std::log(size.scale) + 0.4 * random.normal());
            model.sh_dc[3 * i + a] = static_cast<float>(random.uniform(-1, 1));
        }
        if (size.large_every > 0 && i % size.large_every == 0)
            for (std::size_t a = 0; a < 3; ++a)
                model.log_scale[3 * i + a] +=
                    std::log(i % (16 * size.large_every) == 0 ? 40.0f : 8.0f);
        for (std::size_t a = 0; a < 4; ++a)
            model.rotation[4 * i + a] = static_cast<float>(random.normal());
        model.opacity_logit[i] = static_cast<float>(1.5 * random.normal());
    }
    return model;
}

Camera tuning_camera(const Size& size) {
    Camera camera;
    camera.width = size.width;
    camera.height = size.height;
    camera.fx = camera.fy = 2.0 * size.height;
    camera.cx = 0.5 * size.width;
    camera.cy = 0.5 * size.height;
    camera.translation = {0, 0, 4};
    return camera;
}

ForwardOptions tuning_options() {
    ForwardOptions options;
    options.store_for_backward = true;
    options.evaluation = kEvaluationOfDevice;
    return options;
}

template <class Word>
std::uint64_t fnv1a(std::uint64_t hash, std::span<const Word> words) {
    for (const Word word : words) hash = (hash ^ static_cast<std::uint64_t>(word)) * 0x100000001b3;
    return hash;
}

constexpr std::uint64_t kHashStart = 0xcbf29ce484222325;

std::string shader_hash() {
    std::uint64_t hash = kHashStart;
    for (const ShaderBinary& shader : shader_table()) hash = fnv1a(hash, shader.words);
    return fmt::format("{:016x}", hash);
}

// What a record must agree with, but for the shaders.
nlohmann::json key_of(const DeviceInfo& info) {
    return {
        {"format", kFormat},
        {"device", info.name},
        {"driver", info.driver},
        {"driver_version", info.driver_version},
        {"pipeline_cache", info.cache_uuid},
        {"subgroup_sizes", {info.subgroup_size, info.min_subgroup_size, info.max_subgroup_size}}};
}

std::string dumped(const nlohmann::json& json, int indent = -1) {
    return json.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::filesystem::path file_of(const DeviceInfo& info, const std::filesystem::path& folder) {
    const std::string key = dumped(key_of(info));
    return folder /
           fmt::format("tuning-{:016x}.json", fnv1a(kHashStart, std::span<const char>(key)));
}

std::vector<TuningGroup> measured_groups(const DeviceInfo& info) {
    std::vector<TuningGroup> groups = tuning_groups(info);
    std::erase_if(groups, [](const TuningGroup& group) { return group.passes.empty(); });
    return groups;
}

// A frame by these choices, which has run once and so has compiled; null where the driver refuses
// them.
std::unique_ptr<TuningFrame> frame_by(Device& device, const TuningNames& choices,
                                      const TimedFrame* of_run = nullptr) try {
    device.set_tuning(with_names(usual_tuning(device.info()), choices));
    auto frame = of_run ? std::make_unique<TuningFrame>(device, *of_run)
                        : std::make_unique<TuningFrame>(device);
    frame->run({});
    return frame;
} catch (const DeviceLost&) {  // every other error is a form that this device lacks
    throw;
} catch (const Error&) {
    return nullptr;
}

// The best of these frames for a group, the first of which is the usual one.
FormChoice compare(const Device& device, const TuningGroup& group,
                   const std::vector<TuningFrame*>& frames, const std::vector<bool>& may_win = {}) {
    const auto start = std::chrono::steady_clock::now();
    const TimedForms forms{
        [&](std::size_t form) { return frames[form]->run({group})[0]; },
        [&] {
            return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        }};
    return choose_form(forms, frames.size(), effort_for(device.info()), may_win);
}

// Measures one group: the time that each of its choices takes, and the best of them.
void measure_group(Device& device, TuningFrame& usual, const TuningGroup& group,
                   double exp_tolerance, TuningRecord& record) {
    std::vector<std::string> names{group.choices.front()};
    std::vector<std::unique_ptr<TuningFrame>> others;
    std::vector<TuningFrame*> frames{&usual};
    std::vector<bool> may_win{true};
    for (std::size_t w = 1; w < group.choices.size(); ++w) {
        if (group.name == "exp" && !(exp_error(device) <= exp_tolerance)) continue;
        std::unique_ptr<TuningFrame> frame = frame_by(device, {{group.name, group.choices[w]}});
        if (!frame) continue;
        names.push_back(group.choices[w]);
        frames.push_back(others.emplace_back(std::move(frame)).get());
        may_win.push_back(may_be_chosen(group.choices[w]));
    }
    const FormChoice chosen = compare(device, group, frames, may_win);
    for (std::size_t i = 0; i < names.size(); ++i)
        record.times.push_back({group.name, names[i], chosen.ms[i]});
    record.choice[group.name] = names[chosen.form];
}

// The fastest choice of a group that a record has beside the one that it chose; "": there is none.
std::string second_choice(const TuningRecord& record, const std::string& group) {
    const TuningTime* best = nullptr;
    for (const TuningTime& time : record.times)
        if (time.group == group && time.choice != record.choice.at(group) &&
            may_be_chosen(time.choice) && (!best || time.ms < best->ms))
            best = &time;
    return best ? best->choice : "";
}

}  // namespace

bool may_be_chosen(std::string_view choice) {
    return choice != "buckets";
}

double exp_error(Device& device) {
    std::vector<KernelProbe> probes;  // beyond q = 24 w is below 1e-5
    for (int i = 0; i < 4096; ++i) probes.push_back({24.0f * static_cast<float>(i) / 4096, 1});
    double largest = 0;
    const auto add = [&](int kernel, double exponent, const std::function<double(double)>& truth) {
        const auto answers =
            probe_kernel(device, kernel_constants(kernel, Footprint::psi, EVALUATION_BUILTIN),
                         probes, static_cast<float>(exponent));
        for (std::size_t i = 0; i < probes.size(); ++i) {
            const double off = std::abs(answers[i].value - truth(probes[i].q));
            largest = std::max(largest, std::isfinite(off) ? off : 1.0);
        }
    };
    add(KERNEL_GAUSSIAN, 0, [](double q) { return std::exp(-q / 2); });
    const ShapedKernel& shaped = shaped_kernel(KERNEL_GENERALIZED_EXPONENTIAL);
    for (const double exponent : shaped.exponents_to_check())
        add(KERNEL_GENERALIZED_EXPONENTIAL, exponent,
            [&](double q) { return shaped.value(Footprint::psi, exponent, q).w; });
    return largest;
}

TuningFrame::TuningFrame(Device& device)
    : TuningFrame(device, std::make_unique<GpuSplats>(device, tuning_scene(size_for(device.info())),
                                                      false)) {}

TuningFrame::TuningFrame(Device& device, std::unique_ptr<GpuSplats> made)
    : TuningFrame(
          device,
          TimedFrame{*made, camera_data(tuning_camera(size_for(device.info())), made->origin()), 0,
                     tuning_options()}) {
    made_ = std::move(made);
}

TuningFrame::TuningFrame(Device& device, const TimedFrame& frame)
    : splats_(frame.splats),
      buffers_(device, frame.options),
      forward_(device, frame.options),
      backward_(device, frame.options),
      gradients_(device, frame.splats),
      view_{.camera = frame.camera, .sh_degree = frame.sh_degree},
      loss_(device, static_cast<int>(frame.camera.width), static_cast<int>(frame.camera.height),
            {.use_alpha = false}),
      cameras_(upload_cameras(device, {view_.camera})),
      photo_(device, "photo", std::uint64_t{view_.camera.width} * view_.camera.height * 4),
      d_image_(device, "d_image", std::uint64_t{view_.camera.width} * view_.camera.height * 12),
      loss_result_(device, "loss result", sizeof(gpu::LossResult)),
      commands_(device),
      has_timestamps_(device.info().timestamp_period_ns > 0) {
    const std::uint32_t width = view_.camera.width, height = view_.camera.height;
    view_.cameras = &cameras_;
    photo_.upload(std::vector<std::uint32_t>(std::size_t{width} * height, 0x80808080u));
    buffers_.reserve(splats_.count(), splats_.count() * 8, static_cast<int>(width),
                     static_cast<int>(height));
}

std::vector<double> TuningFrame::run(const std::vector<TuningGroup>& groups) {
    using Clock = std::chrono::steady_clock;
    Clock::time_point start;
    do {
        backward_.reserve(splats_.count(), buffers_.size().intersections,
                          buffers_.frame().checkpoint_records());
        commands_.begin();
        forward_.record(commands_, splats_, view_, buffers_.frame());
        loss_.record(commands_, {buffers_.frame().images.image, photo_, d_image_, loss_result_},
                     static_cast<int>(view_.camera.width), static_cast<int>(view_.camera.height),
                     glm::vec3(0));
        backward_.record_gradients(commands_, view_, buffers_.frame(), splats_, d_image_,
                                   {gradients_});
        start = Clock::now();
        commands_.submit_and_wait();
    } while (buffers_.make_room(buffers_.frame().read_status()));
    const std::chrono::duration<double, std::milli> whole = Clock::now() - start;
    std::vector<double> ms(groups.size(), has_timestamps_ ? 0 : whole.count());
    for (const PassTime& pass : commands_.pass_times())
        for (std::size_t g = 0; g < groups.size(); ++g)
            if (const auto& passes = groups[g].passes;
                std::find(passes.begin(), passes.end(), pass.name) != passes.end())
                ms[g] += pass.ms;
    return ms;
}

TuningRecord measure_tuning(Device& device, std::string_view group, double exp_tolerance) {
    const ScopeGuard put_back([&, before = device.tuning()] {
        device.set_tuning(before);
        device.forget_peak();
    });
    std::vector<TuningGroup> groups = measured_groups(device.info());
    std::erase_if(groups, [&](const TuningGroup& g) { return !group.empty() && g.name != group; });
    device.set_tuning(usual_tuning(device.info()));
    TuningFrame usual(device);  // while it lives the others share its pipelines
    usual.run({});
    TuningRecord record;
    for (const TuningGroup& g : groups) measure_group(device, usual, g, exp_tolerance, record);
    return record;
}

TuningRecord look_again(Device& device, TuningRecord record, TimedFrame frame) {
    const ScopeGuard put_back([&, before = device.tuning()] {
        device.set_tuning(before);
        device.forget_peak();
    });
    frame.options.camera_gradient = frame.options.alpha_gradient = frame.options.depth_sum =
        frame.options.depth_spread = false;
    record.seen_in_a_run = true;
    const std::unique_ptr<TuningFrame> chosen = frame_by(device, record.choice, &frame);
    if (!chosen) return record;
    TuningNames choice = record.choice;
    for (const TuningGroup& group : measured_groups(device.info())) {
        const std::string other =
            record.choice.contains(group.name) ? second_choice(record, group.name) : std::string();
        if (other.empty()) continue;
        TuningNames changed = record.choice;
        changed[group.name] = other;
        const std::unique_ptr<TuningFrame> second = frame_by(device, changed, &frame);
        if (second && compare(device, group, {chosen.get(), second.get()}).form == 1)
            choice[group.name] = other;
    }
    record.choice = std::move(choice);
    return record;
}

std::optional<TuningRecord> read_tuning(const DeviceInfo& info,
                                        const std::filesystem::path& folder) try {
    std::error_code error;
    if (folder.empty() || !std::filesystem::is_regular_file(file_of(info, folder), error))
        return std::nullopt;
    const nlohmann::json json =
        nlohmann::json::parse(read_text_file(file_of(info, folder)), nullptr, false);
    if (!json.is_object() || json.value("shaders", "") != shader_hash()) return std::nullopt;
    const nlohmann::json key = key_of(info);
    for (const auto& [name, value] : key.items())
        if (!json.contains(name) || dumped(json[name]) != dumped(value)) return std::nullopt;
    TuningRecord record;
    record.choice = parse_tuning(info, json.at("choice").get<std::string>(), "tuning");
    record.seen_in_a_run = json.value("seen_in_a_run", false);
    for (const nlohmann::json& time : json.at("times"))
        record.times.push_back({time.at("group").get<std::string>(),
                                time.at("way").get<std::string>(), time.at("ms").get<double>()});
    return record;
} catch (const std::exception&) {  // another hand has changed the file
    return std::nullopt;
}

void write_tuning(const DeviceInfo& info, const std::filesystem::path& folder,
                  const TuningRecord& record) try {
    if (folder.empty()) return;
    nlohmann::json json = key_of(info);
    json["shaders"] = shader_hash();
    json["choice"] = names_text(record.choice);
    json["seen_in_a_run"] = record.seen_in_a_run;
    json["times"] = nlohmann::json::array();
    for (const TuningTime& time : record.times)
        json["times"].push_back({{"group", time.group}, {"way", time.choice}, {"ms", time.ms}});
    write_file_atomic(file_of(info, folder), dumped(json, 2) + "\n");
} catch (const Error&) {
}

std::string tuning_text(const TuningRecord& record) {
    std::string text = names_text(record.choice), group;
    for (const TuningTime& time : record.times) {
        text += fmt::format("{}{} {:.3f}", time.group == group ? ", " : "; " + time.group + ": ",
                            time.choice, time.ms);
        group = time.group;
    }
    return record.times.empty() ? text : text + " ms";
}

void tune(Device& device, const TuneRequest& request) {
    const DeviceInfo& info = device.info();
    const auto note = [&](const std::string& line) {
        if (request.note) request.note(line);
    };
    TuningNames names = parse_tuning(info, request.forced, "--tune " + request.forced);
    names.merge(parse_tuning(info, request.environment, "DARB_TUNE"));
    const std::vector<TuningGroup> measured = measured_groups(info);
    const bool open = !std::all_of(measured.begin(), measured.end(), [&](const TuningGroup& group) {
        return names.contains(group.name);
    });
    std::optional<TuningRecord> record;
    if (!request.retune) record = read_tuning(info, device.cache_folder());
    if (request.retune || (open && !record && !is_known_device(info))) {
        note(fmt::format("{}: measuring which passes are the fastest, kept for later runs",
                         info.name));
        record = measure_tuning(device);
        write_tuning(info, device.cache_folder(), *record);
        note("tuned: " + tuning_text(*record));
    }
    if (record) names.merge(TuningNames(record->choice));
    device.set_tuning(with_names(usual_tuning(info), names));
}

namespace {

constexpr double kGain = 0.97;             // less is not worth another form
constexpr double kErrors = 2;              // standard errors that a gain must exceed
constexpr double kWindow_s = 0.2;          // least length of a window of the warm-up
constexpr int kWindowFrames = 3;           // frames in a window, at least
constexpr double kStable = 0.02;           // relative difference up to which two windows are equal
constexpr double kErrorOfMedian = 1.2533;  // standard error over that of the mean, normal values
constexpr double kSigmaOfMad = 1.4826;     // standard deviation over the MAD, normal values

double median_of(std::vector<double> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    if (values.size() % 2 == 1) return *middle;
    return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

struct Ratio {
    double median = 1, error = 0;
};

// Within a round the clock is nearly the same, over all rounds it need not be.
Ratio ratio_of(const std::vector<double>& ms, const std::vector<double>& usual_ms) {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < std::min(ms.size(), usual_ms.size()); ++i)
        if (usual_ms[i] > 0) ratios.push_back(ms[i] / usual_ms[i]);
    if (ratios.empty()) return {};
    Ratio result{median_of(ratios), 0};
    for (double& ratio : ratios) ratio = std::abs(ratio - result.median);
    result.error = kErrorOfMedian * kSigmaOfMad * median_of(ratios) /
                   std::sqrt(static_cast<double>(ratios.size()));
    return result;
}

}  // namespace

double FormTimes::median_ms(std::size_t form) const {
    return median_of(rounds_ms.at(form));
}

std::size_t best_form(const FormTimes& times, const std::vector<bool>& may_win) {
    std::size_t best = 0;
    double least = kGain;
    for (std::size_t form = 1; form < times.rounds_ms.size(); ++form) {
        if (form < may_win.size() && !may_win[form]) continue;
        const Ratio ratio = ratio_of(times.rounds_ms[form], times.rounds_ms[0]);
        if (ratio.median > least || ratio.median + kErrors * ratio.error >= 1) continue;
        least = ratio.median;
        best = form;
    }
    return best;
}

bool warm_up(const TimedForms& forms, const TimingEffort& effort) {
    const double start = forms.now_s();
    double before = 0;
    while (forms.now_s() - start < effort.warm_most_s) {
        std::vector<double> window;
        const double begun = forms.now_s();
        while (window.size() < kWindowFrames || forms.now_s() - begun < kWindow_s)
            window.push_back(forms.sample_ms(0));
        const double now = median_of(window);
        const bool same = std::abs(now - before) <= kStable * now;
        if (same && forms.now_s() - start >= effort.warm_least_s) return true;
        before = now;
    }
    return effort.warm_most_s == 0;
}

FormTimes time_rounds(const TimedForms& forms, std::span<const std::size_t> which,
                      const TimingEffort& effort) {
    FormTimes times;
    times.rounds_ms.resize(which.size());
    std::vector<std::size_t> order(which.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const double start = forms.now_s();
    for (int round = 0; round < effort.rounds_most; ++round) {
        if (round >= effort.rounds_least && forms.now_s() - start > effort.rounds_s) break;
        for (const std::size_t i : order) times.rounds_ms[i].push_back(forms.sample_ms(which[i]));
        std::reverse(order.begin(), order.end());
    }
    return times;
}

FormChoice choose_form(const TimedForms& forms, std::size_t count, const TimingEffort& effort,
                       const std::vector<bool>& may_win) {
    std::vector<std::size_t> all(count);
    std::iota(all.begin(), all.end(), std::size_t{0});
    warm_up(forms, effort);
    const FormTimes times = time_rounds(forms, all, effort);
    FormChoice choice{best_form(times, may_win), {}};
    for (std::size_t form = 0; form < count; ++form) choice.ms.push_back(times.median_ms(form));
    if (choice.form != 0) {
        const std::array<std::size_t, 2> both{0, choice.form};
        if (best_form(time_rounds(forms, both, effort)) == 0) choice.form = 0;
    }
    return choice;
}

void settle_tuning(Device& device, const std::string& forced, bool retune) {
    const char* environment = std::getenv("DARB_TUNE");
    tune(device, {forced, environment != nullptr ? environment : "", retune, say_note});
}

}  // namespace darb
