// SPDX-License-Identifier: MIT
#include "trainer/job/request.h"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/kernels/kernel_definition.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/learned_profile.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/plan/effect_plan.h"
#include "trainer/job/request_options.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::json;

constexpr const char* kReplacement = "\xef\xbf\xbd";  // U+FFFD, where a name is not UTF-8
constexpr const char* kRemedy = "Repeat the whole command with --resume.";
constexpr int kFormat = 1;

// The entries of the file, which are taken one by one: an entry that is missing, of another type,
// or that nothing asks for is an error that names it.
class Entries {
  public:
    Entries(Json json, fs::path file) : json_(std::move(json)), file_(std::move(file)) {
        if (!json_.is_object()) throw Error(file_.string(), "is no training request", kRemedy);
    }
    /// section: the object that holds it; "": outside of all.
    const Json& at(const std::string& section, const std::string& key) {
        const Json* object = &json_;
        if (!section.empty()) {
            known_[""].insert(section);
            object = &entry(json_, section);
            if (!object->is_object()) throw bad(section, "is no object");
        }
        known_[section].insert(key);
        const Json& value = entry(*object, key);
        if (value.is_string() && value.get<std::string>().find(kReplacement) != std::string::npos)
            throw bad(key, fmt::format("'{}' is not as it was typed: JSON holds UTF-8 alone",
                                       value.get<std::string>()));
        return value;
    }
    bool has(const std::string& key) const { return json_.contains(key); }
    void refuse_others() const {
        for (const auto& [section, keys] : known_)
            for (const auto& [key, value] : (section.empty() ? json_ : json_.at(section)).items())
                if (!keys.contains(key)) throw bad(key, "is not known to this version of darb");
    }
    Error bad(const std::string& key, const std::string& what) const {
        return Error(fmt::format("{}: \"{}\"", file_.string(), key), what, kRemedy);
    }

  private:
    const Json& entry(const Json& object, const std::string& key) const {
        if (!object.contains(key)) throw bad(key, "is missing");
        return object.at(key);
    }

    const Json json_;
    const fs::path file_;
    std::map<std::string, std::set<std::string>> known_;  // keys by section
};

// A kernel of one's own is registered again.
int read_kernel(Entries& entries, const fs::path& file) {
    const Json& name = entries.at("", "kernel");
    if (!name.is_string()) throw entries.bad("kernel", "is " + name.dump() + ", and no name");
    if (entries.has("kernel_definition")) {
        std::vector<std::string> notes;
        return register_kernel_of_file(
            definition_from_json(entries.at("", "kernel_definition"), file.string()), file.string(),
            notes);
    }
    const auto kernel = kernel_from_name(name.get<std::string>());
    if (!kernel)
        throw entries.bad("kernel", fmt::format("'{}' is no kernel", name.get<std::string>()));
    return *kernel;
}

// --depths FOLDER, which 3DGS looks for in the data set.
void complete_depths(TrainRequest& r) {
    if (r.depths.empty()) return;
    const fs::path asked = std::exchange(r.depths, {});
    const std::string option = "--depths " + asked.string();
    if (words_refuse_effect(r.effects, "depth"))
        throw Error(option, fmt::format("means nothing with --effects {}", r.effects),
                    "Leave one of the two out.");
    r.effects = effects_beside(r.effects, "+depth");
    if (r.resume) return;  // the folder was as seen from where the run began
    const fs::path set =
        fs::is_regular_file(r.dataset) ? fs::path(r.dataset).parent_path() : fs::path(r.dataset);
    fs::path read = set / "depths";  // the order in which they are looked for
    if (!fs::is_directory(read)) read = set / "depth";
    std::error_code none;
    if (!fs::equivalent(read, set / asked, none) && !fs::equivalent(read, asked, none))
        throw Error(option, "is no folder that measured depths are read from",
                    fmt::format("Put them into {}: 16-bit grey PNG in millimetres or .npy in "
                                "metres, named as the photos. Then {} or --effects +depth "
                                "trains with them.",
                                (set / "depths").string(), "--depths depths"));
}

// Where none was named: output/NAME, of the folder or the video, or of a .json file's folder.
fs::path usual_output(const std::string& dataset) {
    fs::path path = fs::absolute(dataset).lexically_normal();
    if (path.filename().empty() || path.extension() == ".json") path = path.parent_path();
    return fs::path("output") / path.stem();
}

// Options that only some strategies know, beside one of the others.
void check_strategy(const TrainRequest& r) {
    const std::string_view own = strategy_name(r.train.strategy);
    for (const std::string& name : r.given) {
        const std::string_view known = request_option(name).row.strategies;
        if (!known.empty() && known.find(own) == std::string_view::npos)
            throw Error(name, fmt::format("means nothing with --strategy {}", own),
                        fmt::format("Leave it out; it goes with --strategy {}.", known));
    }
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
    if (const std::string fault = LearnedProfile::fault_of_start(t.kernel);
        t.learn_kernel > 0 && !fault.empty())
        throw Error(fmt::format("--learn-kernel {}", t.learn_kernel),
                    fmt::format("cannot start from --kernel {}: {}", kernel_name(t.kernel), fault),
                    "Start from another kernel, such as gaussian, or leave --learn-kernel out.");
    if (request.refine_cameras != "auto" && request.refine_cameras != "on" &&
        request.refine_cameras != "off")
        throw Error("--refine-cameras " + request.refine_cameras, "is none of auto, on and off",
                    "Use one of these.");
    if (request.schedule == "3dgs" && !strategy_row(t.strategy).follows_3dgs)
        throw Error("--schedule 3dgs",
                    fmt::format("means nothing with --strategy {}", strategy_name(t.strategy)),
                    "Leave one of the two out.");
    if (request.page && kernel_has_shape(t.kernel))
        throw Error("--html", "web pages cannot draw shapes of splats yet",
                    "Leave it out; darb convert --kernel gaussian OUT page.html writes a page of "
                    "nearest Gaussians.");
    check_strategy(request);
}

std::vector<std::string> unused_options(const TrainRequest& r) {
    std::vector<std::string> notes;
    const int kernel = r.train.kernel;
    if (was_given(r, "--evaluation") && r.train.accuracy.of(kEvaluation).name == "builtin" &&
        !has_builtin_evaluation(kernel))
        notes.push_back(fmt::format("--evaluation builtin is not used: {} has polynomials only",
                                    kernel_name(kernel)));
    if (r.train.accuracy.of(kArithmetic).name == "fast16" &&
        (!has_half_blend(kernel) || r.train.learn_kernel > 0))
        notes.push_back(fmt::format(
            "--arithmetic fast16 is not used{}: {} has no form in half precision, only gaussian "
            "and ges_published have",
            r.train.learn_kernel > 0 ? " once the kernel is learned" : "",
            r.train.learn_kernel > 0 ? "a learned kernel" : kernel_name(kernel)));
    if (was_given(r, "--evaluation") && r.train.accuracy.of(kEvaluation).name == "builtin" &&
        has_builtin_evaluation(kernel) && r.train.learn_kernel > 0)
        notes.push_back("--evaluation builtin is not used: a learned kernel has polynomials only");
    if (was_given(r, "--kernel-lr") && r.train.learn_kernel == 0)
        notes.push_back("--kernel-lr is not used: it is for --learn-kernel");
    if (r.train.shape_lr && !kernel_has_shape(kernel))
        notes.push_back("--shape-lr is not used: splats have shapes of their own with --kernel " +
                        shaped_kernel_names());
    if (r.drop_outside && r.region.empty())
        notes.emplace_back("--drop-outside is not used: no --roi says what lies outside");
    // Scripts give those of long runs to short ones, too.
    const std::pair<const char*, const std::vector<int>&> lists[] = {
        {"--test-iterations", r.test_iterations},
        {"--save-iterations", r.save_iterations},
        {"--checkpoint-iterations", r.checkpoint_iterations}};
    for (const auto& [name, list] : lists)
        for (const int iteration : list)
            if (iteration > r.train.iterations)
                notes.push_back(fmt::format("{} {} is beyond the end at {}: it never comes", name,
                                            iteration, r.train.iterations));
    return notes;
}

void complete_request(TrainRequest& request) {
    complete_depths(request);
    choose_effects(request.effects, EffectUse::training, request.data);
    check_request(request);
    if (request.output.empty() && !request.resume && !request.dataset.empty())
        request.output = usual_output(request.dataset);
}

void require_places(const TrainRequest& request) {
    if (request.output.empty() && (request.resume || !request.dataset.empty()))
        throw Error("darb train", "no output folder", "Name one with -o OUT.");
    if (request.dataset.empty())
        throw Error("darb train", "no data set", "Name a folder: darb train DATASET -o OUT.");
}

std::string request_text(const TrainRequest& r) {
    Json json = {{"format", kFormat}};
    for (const RequestOption& option : request_options()) {
        if (option.key.empty()) continue;
        Json& section = *option.section == '\0' ? json : json[option.section];
        section[option.key] = saved_value(option, r);
    }
    if (const KernelDefinition* own = kernel_definition(r.train.kernel))
        json["kernel_definition"] = definition_json(*own);
    return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

TrainRequest read_request(const fs::path& output) {
    const fs::path file = output / kRequestFile;
    std::error_code none;
    if (!fs::exists(file, none) && fs::exists(output / "command.json", none))
        throw Error(output.string(), "is of a version of darb that kept no request", kRemedy);
    Entries entries(Json::parse(read_text_file(file), nullptr, false), file);
    if (entries.at("", "format") != kFormat)
        throw entries.bad("format",
                          fmt::format("is not {}: another version of darb wrote it", kFormat));
    TrainRequest r;
    r.output = output;
    r.resume = true;
    r.train.kernel = read_kernel(entries, file);
    for (const RequestOption& option : request_options()) {
        if (option.key.empty() || option.key == "kernel") continue;
        const Json& value = entries.at(option.section, option.key);
        try {
            restore_value(option, value, r);
        } catch (const Error& e) {
            throw entries.bad(option.key, e.where.empty() ? e.reason : e.where + ": " + e.reason);
        }
    }
    entries.refuse_others();
    check_request(r);
    return r;
}

}  // namespace darb
