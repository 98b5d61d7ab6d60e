// SPDX-License-Identifier: MIT
#include "trainer/step/checkpoint.h"
#include "trainer/step/trainer_state.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/kernels/kernel_definition.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/raster/gpu_splats.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_model.h"
#include "trainer/options/option_table.h"
#include "trainer/options/schedule.h"
#include "trainer/options/strategy.h"
#include "trainer/step/exposure.h"

namespace darb {

namespace {

using Json = nlohmann::json;

constexpr char kMagic[8] = {'D', 'A', 'R', 'B', 'C', 'K', 'P', 'T'};
constexpr std::uint32_t kVersion = 3;
// Magic, version, CRC-32 of everything behind itself, bytes of the JSON header.
constexpr size_t kCrcAt = sizeof kMagic + 4, kSizeAt = kCrcAt + 4, kHeadBytes = kSizeAt + 8;
constexpr std::uint64_t kMaxSplats = 1u << 30;

// The arrays of a state in file order.
template <class State, class Visit>
void for_each_array(State& state, Visit visit) {
    for (int a = 0; a < kAttributeCount; ++a) visit(attribute_values(state.model, a));
    for (int a = 0; a < kAttributeCount; ++a) visit(state.moments[a]);
    visit(state.rest_sum);
    visit(state.gradient_sum);
    visit(state.smoothing);
    visit(state.exposure);
    visit(state.cameras);
    visit(state.profile);
    for (auto& values : state.mean) visit(values);
}

std::uint32_t checksum(std::span<const std::byte> bytes, std::uint32_t before = 0) {
    uLong crc = before;  // 0 for no bytes
    while (!bytes.empty()) {
        const size_t part = std::min<size_t>(bytes.size(), 1u << 30);
        crc = crc32(crc, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(part));
        bytes = bytes.subspan(part);
    }
    return static_cast<std::uint32_t>(crc);
}

Json gain_json(const GainState& gain) {
    Json looks = Json::array();
    for (const GainLook& look : gain.looks) looks.push_back({look.iteration, look.psnr_db});
    return {{"looks", looks}, {"end", gain.end}};
}

GainState gain_from_json(const Json& json) {
    GainState gain;
    gain.end = json.at("end").get<int>();
    for (const Json& look : json.at("looks"))
        gain.looks.push_back({look.at(0).get<int>(), look.at(1).get<double>()});
    return gain;
}

Json header_of(const Checkpoint& c) {
    const SplatModel& m = c.state.model;
    const TrainCounters& n = c.state.counters;
    Json header{{"iteration", c.state.iteration},
                {"next_probe", c.state.next_probe},
                {"smoothing", c.state.smoothing.size()},
                {"exposure", c.state.exposure.size()},
                {"cameras", c.state.cameras.size()},
                {"rest_sum", c.state.rest_sum.size()},
                {"averaged", c.state.averaged},
                {"splats", m.size()},
                {"sh_degree", m.sh_degree},
                {"kernel", kernel_name(m.kernel)},
                {"footprint", footprint_name(m.footprint)},
                {"antialias", m.antialias},
                {"origin", {m.origin.x, m.origin.y, m.origin.z}},
                {"seconds", c.seconds},
                {"settings", c.settings},
                {"dataset", c.dataset},
                {"tuning", c.tuning},
                {"counters", {n.redone_iterations, n.bad_gradients, n.cloned_or_split, n.pruned}},
                {"culled", n.culled},
                {"undrawn", n.undrawn},
                {"overflows", n.overflows},
                {"longest_list", n.longest_list},
                {"huge_splats", n.huge_splats},
                {"most_pairs", n.most_intersections}};
    if (const KernelDefinition* own = kernel_definition(m.kernel))
        header["kernel_definition"] = definition_json(*own);
    if (!c.state.profile.empty()) header["profile"] = c.state.profile.size();
    if (!c.gain.looks.empty()) header["gain"] = gain_json(c.gain);
    return header;
}

std::optional<int> kernel_of(const Json& h, const std::string& where) {
    if (!h.contains("kernel_definition"))
        return kernel_from_name(h.at("kernel").get<std::string>());
    // a kernel with another name; check_resumable compares it with the run's
    std::vector<std::string> notes;
    return register_kernel_of_file(definition_from_json(h["kernel_definition"], where), where,
                                   notes);
}

// The library converts 1e30 and "true" without a word.
template <class Whole>
Whole whole_of(const Json& h, const char* key, const std::string& where) {
    const Json& value = h.at(key);
    const bool fits =
        value.is_number_unsigned()
            ? std::in_range<Whole>(value.get<std::uint64_t>())
            : value.is_number_integer() && std::in_range<Whole>(value.get<std::int64_t>());
    if (!fits)
        throw Error(where, fmt::format("the header's '{}' is {}", key, value.dump()),
                    "Start from another checkpoint, or without --resume.");
    return value.get<Whole>();
}

void read_header(const Json& h, Checkpoint& c, const std::string& where) {
    SplatModel& m = c.state.model;
    c.state.iteration = whole_of<int>(h, "iteration", where);
    c.state.next_probe = whole_of<int>(h, "next_probe", where);
    m.sh_degree = whole_of<int>(h, "sh_degree", where);
    const auto kernel = kernel_of(h, where);
    const auto footprint = footprint_from_name(h.at("footprint").get<std::string>());
    const auto splats = whole_of<std::uint64_t>(h, "splats", where);
    if (!kernel || !footprint || m.sh_degree < 0 || m.sh_degree > 3 || splats > kMaxSplats ||
        c.state.iteration < 0 || (*footprint == Footprint::exact && !has_exact_footprint(*kernel)))
        throw Error(where, "the header's values make no sense",
                    "Start again from another checkpoint.");
    m.kernel = *kernel;
    m.footprint = *footprint;
    m.antialias = h.at("antialias").get<bool>();
    if (h.contains("averaged"))  // absent in earlier files
        c.state.averaged = whole_of<std::uint32_t>(h, "averaged", where);
    for (int a = 0; a < 3; ++a) m.origin[a] = h.at("origin").at(a).get<double>();
    c.seconds = h.at("seconds").get<double>();
    c.settings = h.at("settings").get<std::string>();
    c.dataset = h.at("dataset").get<std::string>();
    c.tuning = h.value("tuning", c.tuning);
    if (h.contains("gain")) c.gain = gain_from_json(h["gain"]);
    TrainCounters& n = c.state.counters;
    n.redone_iterations = h.at("counters").at(0).get<std::uint64_t>();
    n.bad_gradients = h.at("counters").at(1).get<std::uint64_t>();
    n.cloned_or_split = h.at("counters").at(2).get<std::uint64_t>();
    n.pruned = h.at("counters").at(3).get<std::uint64_t>();
    n.overflows = h.value("overflows", std::uint64_t{0});  // absent in earlier files
    n.undrawn = h.value("undrawn", 0u);
    n.longest_list = h.value("longest_list", 0u);
    n.huge_splats = h.value("huge_splats", 0u);
    n.most_intersections = h.value("most_pairs", 0u);
    n.culled = h.at("culled").get<decltype(n.culled)>();
}

std::uint64_t floats_per_splat(const TrainerState& s) {
    std::uint64_t parameters = 0;
    for (int a = 0; a < kAttributeCount; ++a)
        if (kernel_takes(s.model.kernel, a)) parameters += attribute_floats(a, s.model.sh_degree);
    return parameters * (s.averaged > 0 ? 4 : 3) + 2;
}

void size_arrays(Checkpoint& c, std::uint64_t splats) {
    c.state.model.resize(splats);
    set_kernel(c.state.model, c.state.model.kernel);
    c.state.moments.resize(kAttributeCount);
    for (int a = 0; a < kAttributeCount; ++a)
        c.state.moments[a].resize(attribute_values(c.state.model, a).size() * 2);
    c.state.gradient_sum.resize(splats * 2);
    if (c.state.averaged == 0) return;
    for (int a = 0; a < kAttributeCount; ++a)
        c.state.mean.emplace_back(attribute_values(c.state.model, a).size());
}

// A checkpoint's file as its head and the arrays of the state, which stay where they are: beside a
// large state there is no room for another one.
struct FileOf {
    explicit FileOf(const Checkpoint& checkpoint) {
        const std::string header =
            header_of(checkpoint).dump(-1, ' ', false, Json::error_handler_t::replace);
        const std::uint64_t header_bytes = header.size();
        head.resize(kHeadBytes + header.size());
        std::memcpy(head.data(), kMagic, sizeof kMagic);
        std::memcpy(head.data() + 8, &kVersion, 4);
        std::memcpy(head.data() + kSizeAt, &header_bytes, 8);
        std::memcpy(head.data() + kHeadBytes, header.data(), header.size());
        parts.emplace_back(head);
        std::uint32_t crc = checksum(std::span(head).subspan(kSizeAt));
        for_each_array(checkpoint.state, [&](const std::vector<float>& values) {
            parts.push_back(std::as_bytes(std::span(values)));
            crc = checksum(parts.back(), crc);
        });
        std::memcpy(head.data() + kCrcAt, &crc, 4);
    }
    FileOf(const FileOf&) = delete;
    FileOf& operator=(const FileOf&) = delete;

    std::vector<std::byte> head;
    std::vector<std::span<const std::byte>> parts;
};

}  // namespace

std::vector<std::byte> checkpoint_bytes(const Checkpoint& checkpoint) {
    const FileOf file(checkpoint);
    std::size_t size = 0;
    for (const auto& part : file.parts) size += part.size();
    std::vector<std::byte> bytes;
    bytes.reserve(size);
    for (const auto& part : file.parts) bytes.insert(bytes.end(), part.begin(), part.end());
    return bytes;
}

void write_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint) {
    while_doing(path.string(), [&] {
        const FileOf file(checkpoint);
        write_file_atomic(path, FileParts(file.parts));
    });
}

Checkpoint parse_checkpoint(std::span<const std::byte> file, const std::string& where) {
    const auto fail = [&](const std::string& what) {
        return Error(where, what, "Start from another checkpoint, or without --resume.");
    };
    std::uint32_t version = 0, crc = 0;
    std::uint64_t header_bytes = 0;
    if (file.size() < kHeadBytes || std::memcmp(file.data(), kMagic, sizeof kMagic) != 0)
        throw fail("this is no darb checkpoint");
    std::memcpy(&version, file.data() + 8, 4);
    std::memcpy(&crc, file.data() + kCrcAt, 4);
    std::memcpy(&header_bytes, file.data() + kSizeAt, 8);
    if (version != kVersion)
        throw fail(fmt::format("version {}, this program reads {}", version, kVersion));
    if (header_bytes > file.size() - kHeadBytes) throw fail("truncated in the header");
    const auto* text = reinterpret_cast<const char*>(file.data() + kHeadBytes);
    Checkpoint c;
    std::uint64_t splats = 0, smoothing = 0, exposure = 0, cameras = 0, profile = 0, rest = 0;
    try {
        const Json header = Json::parse(text, text + header_bytes);
        read_header(header, c, where);
        splats = whole_of<std::uint64_t>(header, "splats", where);
        smoothing = whole_of<std::uint64_t>(header, "smoothing", where);
        exposure = whole_of<std::uint64_t>(header, "exposure", where);
        if (header.value("error_shares", std::uint64_t{0}) != 0)
            throw fail("it is of the strategy budget of an earlier version, by the photos' error");
        cameras = header.value("cameras", std::uint64_t{0});
        profile = header.value("profile", std::uint64_t{0});
        rest = header.value("rest_sum", std::uint64_t{0});
        const auto rest_floats = static_cast<std::uint64_t>(c.state.model.rest_count());
        if ((smoothing != 0 && smoothing != splats) || exposure > kMaxSplats ||
            cameras > kMaxSplats || profile > kMaxSplats ||
            (rest != 0 && rest != rest_floats * splats))
            throw fail("the header's sizes make no sense");
    } catch (const Json::exception& e) {
        throw fail("its header " + json_reason(e));
    }
    const std::span<const std::byte> payload = file.subspan(kHeadBytes + header_bytes);
    const std::uint64_t floats =
        splats * floats_per_splat(c.state) + smoothing + exposure + cameras + profile + rest;
    const std::uint64_t expected = floats * sizeof(float);
    if (payload.size() != expected)
        throw fail(fmt::format("{} bytes of data for {} splats, {} expected: truncated",
                               payload.size(), splats, expected));
    if (checksum(file.subspan(kSizeAt)) != crc)
        throw fail("damaged: the checksum does not match the content");
    size_arrays(c, splats);
    c.state.smoothing.resize(smoothing);
    c.state.exposure.resize(exposure);
    c.state.cameras.resize(cameras);
    c.state.profile.resize(profile);
    c.state.rest_sum.resize(rest);
    size_t at = 0;
    for_each_array(c.state, [&](std::vector<float>& values) {
        if (!values.empty())
            std::memcpy(values.data(), payload.data() + at, values.size() * sizeof(float));
        at += values.size() * sizeof(float);
    });
    return c;
}

Checkpoint read_checkpoint(const std::filesystem::path& path) {
    return while_doing(path.string(),
                       [&] { return parse_checkpoint(read_file(path), path.string()); });
}

std::string settings_text(const Schedule& schedule) {
    return settings_json(schedule).dump();
}

std::string dataset_fingerprint(const Dataset& dataset, const std::vector<ImageU8>& photos) {
    std::uint64_t hash = 1469598103934665603ull;  // FNV-1a
    const auto add = [&](const void* data, size_t size) {
        const auto* bytes = static_cast<const unsigned char*>(data);
        for (size_t i = 0; i < size; ++i) hash = (hash ^ bytes[i]) * 1099511628211ull;
    };
    for (const View& v : dataset.views) {
        add(v.name.data(), v.name.size());
        const Camera& c = v.camera;
        const double numbers[] = {double(c.width),
                                  double(c.height),
                                  c.fx,
                                  c.fy,
                                  c.cx,
                                  c.cy,
                                  c.translation.x,
                                  c.translation.y,
                                  c.translation.z,
                                  v.is_test ? 1.0 : 0.0};
        add(numbers, sizeof numbers);
        add(&c.rotation[0][0], 9 * sizeof(double));
    }
    add(dataset.points.position.data(), dataset.points.position.size() * sizeof(double));
    for (const ImageU8& photo : photos) {
        const std::uint32_t pixels = checksum(std::as_bytes(std::span(photo.data)));
        add(&pixels, sizeof pixels);
    }
    return fmt::format("{:016x}", hash);
}

namespace {

constexpr const char* kOtherCheckpoint = "Start from another checkpoint, or without --resume.";

// Contradictions in the looks at held-out photos, and in the end that follows from the last one.
std::string gain_contradiction(const GainState& gain, int iteration, Schedule schedule) {
    if (gain.looks.empty() && gain.end == 0) return "";
    if (schedule.options.end_without_gain == 0 || gain.looks.empty())
        return "holds the end of a run that does not look for a gain";
    const int looked = gain.looks.back().iteration;
    if (gain.end != 0) schedule.end_early(looked);
    if (looked > iteration || iteration > schedule.last ||
        (gain.end != 0 && gain.end != schedule.last))
        return fmt::format("is of iteration {}, looked for a gain at {} and ends the run at {}",
                           iteration, looked, gain.end);
    return "";
}

// What the settings say and the state does not follow, which no run writes.
std::string contradiction(const Checkpoint& checkpoint, const Schedule& schedule,
                          std::uint32_t exposures) {
    const TrainOptions& o = schedule.options;
    const TrainerState& s = checkpoint.state;
    const SplatModel& m = s.model;
    const bool learns = o.learn_kernel > 0;  // and so goes away from its kernel
    if ((m.kernel != o.kernel && !learns) || m.footprint != o.footprint)
        return fmt::format(
            "holds splats of the kernel {} with the footprint {}, the run trains {} "
            "with {}",
            kernel_name(m.kernel), footprint_name(m.footprint), kernel_name(o.kernel),
            footprint_name(o.footprint));
    if (s.iteration > o.iterations)
        return fmt::format("is of iteration {}, beyond the end of the run at {}", s.iteration,
                           o.iterations);
    if (m.sh_degree > o.sh_degree)
        return fmt::format("holds colours of degree {}, the run goes up to {}", m.sh_degree,
                           o.sh_degree);
    if (m.antialias != o.antialias || (!s.smoothing.empty() && !o.antialias) ||
        (!s.exposure.empty() &&
         (!o.exposure || s.exposure.size() != exposure_maps(o, exposures).state_size())) ||
        (!s.cameras.empty() && !o.refine_cameras) ||
        s.profile.size() != (learns ? kProfileFloats : 0) ||
        (!s.rest_sum.empty() && schedule.rest_every <= 1))
        return "holds what the run's effects and strategy have no use for";
    if (const std::string what = gain_contradiction(checkpoint.gain, s.iteration, schedule);
        !what.empty())
        return what;
    if (std::int64_t{s.averaged} > s.iteration)
        return fmt::format("holds a mean of {} iterations after {}", s.averaged, s.iteration);
    size_t finite = 0;
    for (size_t i = 0; i < m.size(); ++i) finite += is_finite(m, i) ? 1 : 0;
    if (m.size() > 0 && finite == 0)
        return fmt::format("holds {} splats, none of them with finite numbers", m.size());
    return "";
}

Json settings_of(const Checkpoint& checkpoint, const std::string& where) {
    Json settings = Json::parse(checkpoint.settings, nullptr, false);
    if (!settings.is_object())
        throw Error(where, "its settings are no JSON object", kOtherCheckpoint);
    if (const auto at = settings.find("strategy"); at != settings.end() && !at->is_string())
        throw Error(where, "its settings: 'strategy' is no text: " + at->dump(), kOtherCheckpoint);
    return settings;
}

}  // namespace

std::string settings_differences(const Json& before, const Json& now) {
    Json both = before;
    both.update(now);
    std::string differences;
    for (const auto& setting : both.items()) {
        const std::string& name = setting.key();
        const auto in = [&name](const Json& settings) {
            return settings.contains(name) ? settings[name].dump() : "not given";
        };
        if (in(before) != in(now))
            differences += fmt::format(" {}: {} then, {} now;", name, in(before), in(now));
    }
    return differences;
}

void check_resumable(const Checkpoint& checkpoint, const std::filesystem::path& path,
                     const Schedule& schedule, const Dataset& dataset,
                     const std::string& fingerprint) {
    const Json before = settings_of(checkpoint, path.string());
    const Json now = Json::parse(settings_text(schedule));
    const std::string strategy = before.value("strategy", std::string(strategy_name(Strategy{})));
    if (strategy != strategy_name(schedule.options.strategy))
        throw Error(path.string(),
                    fmt::format("was written with --strategy {}, this is --strategy {}", strategy,
                                strategy_name(schedule.options.strategy)),
                    "Repeat the strategy of that run, or start without --resume.");
    if (const std::string differences = settings_differences(before, now); !differences.empty())
        throw Error(path.string(), "was written with other settings:" + differences,
                    "Repeat the options of that run, or start without --resume.");
    if (checkpoint.dataset != fingerprint)
        throw Error(
            path.string(),
            "the data set " + dataset.root.string() + " is not the one it was trained on",
            "Restore the photos, cameras and held-out views (--eval, --hold-out) of that run, "
            "or start without --resume.");
    const std::uint32_t exposures = exposure_count(dataset.views);
    if (const std::string what = contradiction(checkpoint, schedule, exposures); !what.empty())
        throw Error(path.string(), what, kOtherCheckpoint);
}

}  // namespace darb
