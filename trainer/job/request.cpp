#include "trainer/job/request.h"

#include <fmt/format.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <set>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/kernels/kernel_file.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/plan/effect_plan.h"
#include "trainer/options/option_table.h"
#include "trainer/run/run_folder.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::json;

constexpr const char* kReplacement = "\xef\xbf\xbd";  // U+FFFD, where a name is not UTF-8
constexpr const char* kRemedy = "Repeat the whole command with --resume.";
constexpr const char* kStarts[] = {"auto", "points", "dense", "random"};  // by StartPoints
constexpr int kFormat = 1;

std::string lens_of(const DatasetOptions& data) {
    return data.original_lens ? "original" : data.original_where_wide ? "auto" : "undistort";
}

// The name of a row in the file: its flag, its place in the settings, or its own.
std::string key_of(const OptionRow& row) {
    if (*row.flags != '\0') return option_name(row).substr(2);
    return *row.setting != '\0' ? row.setting : row.name;
}

Json train_json(const TrainOptions& train) {
    Json json = Json::object();
    for (const OptionRow& row : option_rows())
        if (!std::holds_alternative<std::monostate>(row.member))
            json[key_of(row)] = member_json(row, train);
    return json;
}

Json accuracy_json(const Accuracy& accuracy) {
    Json json = Json::object();
    for (int s = 0; s < kAccuracyCount; ++s)
        json[std::string(accuracy_settings()[static_cast<std::size_t>(s)].name)] =
            accuracy.of(s).name;
    return json;
}

// One object of the file, whose entries are taken one by one: an entry that is missing, of another
// type, or that nothing asks for is an error that names it.
class Entries {
  public:
    Entries(const Json& json, fs::path file) : json_(json), file_(std::move(file)) {
        if (!json.is_object()) throw Error(file_.string(), "is no training request", kRemedy);
    }
    template <class T>
    T get(const std::string& key) {
        const Json& value = at(key);
        try {
            return value.get<T>();
        } catch (const Json::exception&) {
            throw bad(key, "is " + value.dump() + ", which is of another type");
        }
    }
    std::string text(const std::string& key) {
        const auto value = get<std::string>(key);
        if (value.find(kReplacement) != std::string::npos)
            throw bad(key,
                      fmt::format("'{}' is not as it was typed: JSON holds UTF-8 alone", value));
        return value;
    }
    const Json& at(const std::string& key) {
        if (!json_.contains(key)) throw bad(key, "is missing");
        known_.insert(key);
        return json_.at(key);
    }
    bool has(const std::string& key) const { return json_.contains(key); }
    void refuse_others() const {
        for (const auto& [key, value] : json_.items())
            if (!known_.contains(key)) throw bad(key, "is not known to this version of darb");
    }
    Error bad(const std::string& key, const std::string& what) const {
        return Error(fmt::format("{}: \"{}\"", file_.string(), key), what, kRemedy);
    }

  private:
    const Json& json_;
    fs::path file_;
    std::set<std::string> known_;
};

void read_train(Entries entries, TrainOptions& train) {
    for (const OptionRow& row : option_rows()) {
        if (std::holds_alternative<std::monostate>(row.member)) continue;
        const std::string key = key_of(row);
        const Json& value = entries.at(key);
        try {
            set_member(row, value, train);
        } catch (const std::exception& e) {
            throw entries.bad(key, e.what());
        }
    }
    entries.refuse_others();
}

int read_kernel(Entries& entries, const fs::path& file) {
    const std::string name = entries.text("kernel");
    if (entries.has("kernel_definition")) {
        std::vector<std::string> notes;
        return register_kernel_of_file(
            definition_from_json(entries.at("kernel_definition"), file.string()), file.string(),
            notes);
    }
    const auto kernel = kernel_from_name(name);
    if (!kernel) throw entries.bad("kernel", fmt::format("'{}' is no kernel", name));
    return *kernel;
}

Accuracy read_accuracy(Entries entries) {
    Accuracy accuracy;
    for (int s = 0; s < kAccuracyCount; ++s) {
        const std::string name(accuracy_settings()[static_cast<std::size_t>(s)].name);
        accuracy.choice[static_cast<std::size_t>(s)] = find_choice(s, entries.text(name), true);
    }
    entries.refuse_others();
    return accuracy;
}

StartPoints read_start(Entries& entries) {
    const std::string name = entries.text("start");
    for (int i = 0; i < int(std::size(kStarts)); ++i)
        if (name == kStarts[i]) return static_cast<StartPoints>(i);
    throw entries.bad("start", fmt::format("'{}' is none of auto, points, dense, random", name));
}

// What the photos' folder is called beside a data set that moves with the run.
std::string shared_images(const TrainRequest& r) {
    const fs::path images = r.data.images_folder;
    return images.is_absolute() ? seen_from(r.dataset, images).string() : images.string();
}

Json data_json(const TrainRequest& r) {
    Json json = {{"dataset", seen_from(r.output, r.dataset).string()},
                 {"images", shared_images(r)},
                 {"resolution", r.data.resolution},
                 {"eval", r.data.hold_out},
                 {"hold_out", hold_out_text(r.data.held_out)},
                 {"lens", lens_of(r.data)},
                 {"depth_scale", nullptr},
                 {"sequential", r.sequential},
                 {"frames", r.frames}};
    if (r.data.depth_scale) json["depth_scale"] = *r.data.depth_scale;
    return json;
}

void read_data(Entries entries, const fs::path& output, TrainRequest& r) {
    r.dataset = fs::weakly_canonical(output / entries.text("dataset")).string();
    if (entries.text("dataset").empty()) throw entries.bad("dataset", "names no data set");
    r.data.images_folder = entries.text("images");
    r.data.resolution = entries.get<int>("resolution");
    r.data.hold_out = entries.get<bool>("eval");
    r.data.held_out = parse_hold_out(entries.text("hold_out"));
    const std::string lens = entries.text("lens");
    r.data.original_lens = lens == "original";
    r.data.original_where_wide = lens == "auto";
    if (!entries.at("depth_scale").is_null())
        r.data.depth_scale = entries.get<double>("depth_scale");
    r.sequential = entries.get<bool>("sequential");
    r.frames = entries.get<int>("frames");
    entries.refuse_others();
}

}  // namespace

void use_schedule(TrainRequest& request, std::string_view schedule) {
    if (schedule != "darb" && schedule != "3dgs")
        throw Error(fmt::format("--schedule {}", schedule), "no such schedule",
                    "Use darb or 3dgs.");
    request.schedule = schedule;
    if (schedule != "3dgs") return;
    use_3dgs_schedule(request.train);
    request.effects = effects_beside("+sh,-exposure,-antialias", request.effects);
}

std::string effects_beside(const std::string& first, std::string given) {
    if (given.starts_with("all") || given.starts_with("none")) return given;
    if (given.starts_with("auto")) given.erase(0, std::string_view("auto,").size());
    if (first == "auto") return given.empty() ? first : given;
    return given.empty() ? first : first + "," + given;
}

fs::path checkpoint_to_resume(const TrainRequest& request) {
    // The run's own checkpoint, once there is one, is further than the one that it began with.
    const fs::path own = request.output / "checkpoint.darb";
    if (request.resume && (request.start_checkpoint.empty() || fs::exists(own))) return own;
    return request.start_checkpoint;
}

void check_request(const TrainRequest& request) {
    const TrainOptions& t = request.train;
    parse_effects(request.effects);
    if (t.exposure_grid && words_refuse_effect(request.effects, "exposure"))
        throw Error("--exposure-grid",
                    fmt::format("means nothing with --effects {}", request.effects),
                    "Leave one of the two out.");
    if (t.footprint == Footprint::exact && !has_exact_footprint(t.kernel))
        throw Error(fmt::format("--kernel {}", kernel_name(t.kernel)),
                    "goes with the footprint psi only",
                    "Leave --footprint out, or use another kernel, or --pulses 1.");
    if (request.refine_cameras != "auto" && request.refine_cameras != "on" &&
        request.refine_cameras != "off")
        throw Error("--refine-cameras " + request.refine_cameras, "is none of auto, on and off",
                    "Use one of these.");
    if (request.schedule == "3dgs" && !strategy_row(t.strategy).follows_3dgs)
        throw Error("--schedule 3dgs",
                    fmt::format("means nothing with --strategy {}", strategy_name(t.strategy)),
                    "Leave one of the two out.");
}

std::string request_text(const TrainRequest& r) {
    const auto seen = [&](const fs::path& path) {
        return path.empty() ? std::string() : seen_from(r.output, path).string();
    };
    Json json = {{"format", kFormat},
                 {"data", data_json(r)},
                 {"train", train_json(r.train)},
                 {"kernel", kernel_name(r.train.kernel)},
                 {"footprint", footprint_name(r.train.footprint)},
                 {"accuracy", accuracy_json(r.train.accuracy)},
                 {"strategy", strategy_name(r.train.strategy)},
                 {"start", kStarts[static_cast<int>(r.train.start)]},
                 {"preset", r.preset},
                 {"schedule", r.schedule},
                 {"effects", r.effects},
                 {"refine_cameras", r.refine_cameras},
                 {"antialiasing", r.antialiasing},
                 {"blocks", r.blocks},
                 {"device", r.device},
                 {"tune", r.tune},
                 {"allow_mixed", r.allow_mixed},
                 {"test_iterations", r.test_iterations},
                 {"save_iterations", r.save_iterations},
                 {"checkpoint_iterations", r.checkpoint_iterations},
                 {"checkpoint_interval", r.checkpoint_interval},
                 {"report", r.report},
                 {"page", r.page},
                 {"start_checkpoint", seen(r.start_checkpoint)}};
    if (const KernelDefinition* own = kernel_definition(r.train.kernel))
        json["kernel_definition"] = definition_json(*own);
    return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

TrainRequest read_request(const fs::path& output) {
    const fs::path file = output / kRequestFile;
    std::error_code none;
    if (!fs::exists(file, none) && fs::exists(output / "command.json", none))
        throw Error(output.string(), "is of a version of darb that kept no request", kRemedy);
    const Json json = Json::parse(read_text_file(file), nullptr, false);
    Entries entries(json, file);
    if (entries.get<int>("format") != kFormat)
        throw entries.bad("format",
                          fmt::format("is not {}: another version of darb wrote it", kFormat));
    TrainRequest r;
    r.output = output;
    r.resume = true;
    read_data(Entries(entries.at("data"), file), output, r);
    read_train(Entries(entries.at("train"), file), r.train);
    r.train.kernel = read_kernel(entries, file);
    const auto footprint = footprint_from_name(entries.text("footprint"));
    if (!footprint) throw entries.bad("footprint", "is neither psi nor exact");
    r.train.footprint = *footprint;
    r.train.accuracy = read_accuracy(Entries(entries.at("accuracy"), file));
    const auto strategy = strategy_from_name(entries.text("strategy"));
    if (!strategy) throw entries.bad("strategy", "is no strategy");
    r.train.strategy = *strategy;
    r.train.start = read_start(entries);
    r.preset = entries.text("preset");
    r.schedule = entries.text("schedule");
    r.effects = entries.text("effects");
    r.refine_cameras = entries.text("refine_cameras");
    r.antialiasing = entries.get<bool>("antialiasing");
    r.blocks = entries.text("blocks");
    r.device = entries.text("device");
    r.tune = entries.text("tune");
    r.allow_mixed = entries.get<bool>("allow_mixed");
    for (const auto& [name, list] : {std::pair{"test_iterations", &r.test_iterations},
                                     {"save_iterations", &r.save_iterations},
                                     {"checkpoint_iterations", &r.checkpoint_iterations}})
        *list = entries.get<std::vector<int>>(name);
    r.checkpoint_interval = entries.get<int>("checkpoint_interval");
    r.report = entries.get<bool>("report");
    r.page = entries.get<bool>("page");
    if (const std::string begin = entries.text("start_checkpoint"); !begin.empty())
        r.start_checkpoint = fs::weakly_canonical(output / begin);
    entries.refuse_others();
    check_request(r);
    return r;
}

}  // namespace darb
