// SPDX-License-Identifier: MIT
// darb clean SCENE -o OUT: leaves out isolated parts, haze, what floats in free space and what few
// photos show, and says what each of these costs.
#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/data/camera_list.h"
#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/plan/effect_plan.h"
#include "engine/publish/fit_pictures.h"
#include "engine/render/free_space.h"
#include "engine/render/light_share.h"
#include "engine/render/renderer.h"
#include "engine/scene/clutter.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/subject.h"
#include "tools/darb/command_list.h"
#include "tools/darb/flags.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/scene_evaluation.h"
#include "tools/darb/tune_flags.h"
#include "trainer/job/scene_file.h"

namespace darb {

namespace {

constexpr double kIsolatedShare = 0.01;  // of the heaviest part, where no rule is named
constexpr int kLightWidth = 480;         // px, of the pictures whose light is measured

struct CleanFlags {
    std::filesystem::path scene, photos, cameras, output, json, paper;
    std::optional<double> isolated;               // share of the heaviest part
    std::string haze;                             // OPACITY,SIZE; empty: off
    std::uint32_t free_space = 0, few_views = 0;  // views; 0: off
    std::string region, device;
    bool dry_run = false, force = false, quiet = false;
    DatasetOptions data;
    StoredUnits units;
    TuneFlags tune;
};

/// What one rule leaves out.
struct Rule {
    std::string name;
    SplatSet set;
    double light = 0;  // share of all pictures' light, 0 to 1
};

struct Cameras {
    std::vector<Camera> cameras;
    bool of_photos = false;  // they stand where photos were taken
};

/// Evenly chosen cameras: of the photos, else those named, else of the scene's run, else around it.
Cameras chosen_cameras(const CleanFlags& flags, const SplatModel& model,
                       const std::vector<View>& photos) {
    constexpr int kAround = 24, kWidth = 640, kHeight = 480;
    std::vector<View> views = photos;
    if (views.empty() && !flags.cameras.empty()) views = open_cameras(flags.cameras, flags.data);
    if (views.empty()) views = cameras_beside(flags.scene);
    if (views.empty()) return {orbit_cameras(model, kAround, kWidth, kHeight), false};
    return {evenly_chosen(cameras_of(views)), true};
}

Region region_from(const std::string& text, const SplatModel& model, const Cameras& cameras) {
    constexpr double kRoom = 1.25;  // around the subject
    const std::string::size_type colon = text.find(':');
    const std::string kind = text.substr(0, colon);
    const std::string rest = colon == std::string::npos ? "" : text.substr(colon + 1);
    Region region;
    if (kind == "subject") {
        const Subject subject =
            subject_of(model, cameras.of_photos ? std::span<const Camera>(cameras.cameras)
                                                : std::span<const Camera>());
        if (subject.around)
            throw Error("--region " + text, "the cameras look outwards, at no subject",
                        "Give a box or a sphere.");
        const double factor = rest.empty() ? kRoom : numbers_from("--region subject", rest, 1)[0];
        region = {Region::Shape::sphere, subject.centre, glm::dvec3(factor * subject.radius)};
    } else if (kind == "sphere") {
        const std::vector<double> n = numbers_from("--region sphere", rest, 4);
        region = {Region::Shape::sphere, {n[0], n[1], n[2]}, glm::dvec3(n[3])};
    } else if (kind == "box") {
        const std::vector<double> n = numbers_from("--region box", rest, 6);
        const glm::dvec3 low(n[0], n[1], n[2]), high(n[3], n[4], n[5]);
        region = {Region::Shape::box, (low + high) / 2.0, (high - low) / 2.0};
    } else {
        throw Error("--region " + text, "is no region",
                    "Give subject, subject:1.5 (times its radius), sphere:X,Y,Z,RADIUS or "
                    "box:MINX,MINY,MINZ,MAXX,MAXY,MAXZ.");
    }
    if (!glm::all(glm::greaterThan(region.half_size, glm::dvec3(0))))
        throw Error("--region " + text, "holds nothing",
                    "Sizes must be above 0, and each least number below its largest.");
    return region;
}

class Cleaning {
  public:
    Cleaning(const CleanFlags& flags, Device& device, const SplatModel& model,
             const Cameras& cameras)
        : flags_(flags), device_(device), model_(model), cameras_(cameras) {}

    std::vector<Rule> rules() {
        add_from_splats();
        add_from_views();
        for (Rule& rule : rules_) rule.light = light_of(rule.set);
        return std::move(rules_);
    }
    /// Mean over the cameras.
    double light_of(const SplatSet& set) const {
        if (count_of(set) == 0) return 0;
        const std::vector<double> shares = light_shares(device_, model_, set, small_pictures());
        return std::accumulate(shares.begin(), shares.end(), 0.0) / double(shares.size());
    }

  private:
    bool nothing_named() const {
        return !flags_.isolated && flags_.haze.empty() && flags_.free_space == 0 &&
               flags_.few_views == 0 && flags_.region.empty();
    }

    std::vector<Camera> small_pictures() const {
        std::vector<Camera> small;
        for (const Camera& camera : cameras_.cameras)
            small.push_back(pinhole_at_most(camera, kLightWidth));
        return small;
    }

    void add_from_splats() {
        const double isolated = flags_.isolated.value_or(nothing_named() ? kIsolatedShare : 0.0);
        if (!flags_.region.empty()) {
            const Region region = region_from(flags_.region, model_, cameras_);
            SplatSet outside(model_.size());
            for (std::size_t i = 0; i < outside.size(); ++i)
                outside[i] = region.contains(position_of(model_, i)) ? 0 : 1;
            rules_.push_back({"outside the region", std::move(outside)});
        }
        if (isolated > 0) rules_.push_back({"isolated parts", isolated_splats(model_, isolated)});
        if (!flags_.haze.empty()) {
            const std::vector<double> haze = numbers_from("--haze", flags_.haze, 2);
            if (!(haze[0] >= 0 && haze[0] <= 1 && haze[1] > 0))
                throw Error("--haze " + flags_.haze, "is not an opacity and a size",
                            "Give an opacity of 0 to 1 and how many times the median size, as "
                            "--haze 0.1,5.");
            rules_.push_back({"haze", hazy_splats(model_, haze[0], haze[1])});
        }
    }

    void add_from_views() {
        if (flags_.free_space > 0) {
            EffectPlan plan;
            SplatModel model = model_;
            Renderer renderer = plain_renderer(model, plan);
            FreeSpaceOptions options;
            options.least_views = flags_.free_space;
            FreeSpace space(model_, options);
            SlowProgress progress("free space");
            for (std::size_t v = 0; v < cameras_.cameras.size(); ++v) {
                progress.at(double(v) / double(cameras_.cameras.size()));
                space.ask(renderer, cameras_.cameras[v]);
            }
            rules_.push_back({"in free space", space.splats()});
        }
        if (flags_.few_views > 0) {
            const std::vector<std::uint32_t> views =
                views_that_see(device_, model_, small_pictures());
            SplatSet few(model_.size());
            for (std::size_t i = 0; i < few.size(); ++i)
                few[i] = views[i] > 0 && views[i] < flags_.few_views ? 1 : 0;
            rules_.push_back({"seen by few", std::move(few)});
        }
    }

    Renderer plain_renderer(SplatModel& model, EffectPlan& plan) const {
        std::vector<View> views;
        for (const Camera& camera : cameras_.cameras) {
            views.emplace_back().camera = camera;
            views.back().camera.lens = {};
        }
        DatasetOptions none;
        plan = plan_rendering(model, views, {}, choose_effects("auto", EffectUse::pictures, none));
        apply_plan(plan, model);
        return {device_, model, Accuracy{}, plan.projection(), plan.huge_splat_path()};
    }

    const CleanFlags& flags_;
    Device& device_;
    const SplatModel& model_;
    const Cameras& cameras_;
    std::vector<Rule> rules_;
};

/// PSNR of the held-out photos before and after.
struct Judgement {
    std::size_t views = 0;
    double before = 0, after = 0;  // dB
};

std::optional<Judgement> judge(Device& device, const Dataset& photos, const EffectChoice& effects,
                               const SplatModel& before, const SplatModel& after) {
    const std::vector<View> views = held_out_views(photos.views);
    if (views.empty()) return {};
    SceneEvaluation options;
    options.effects = effects;
    options.alpha_is_mask = photos.alpha_is_mask;
    options.depth_scale = photos.depth_scale;
    SlowProgress progress("measuring held-out photos");
    progress.at(0.0);
    Judgement judged{views.size()};
    judged.before = evaluate_scene(device, before, views, options).psnr_db;
    judged.after = evaluate_scene(device, after, views, options).psnr_db;
    return judged;
}

nlohmann::json report_json(const CleanFlags& flags, const std::vector<Rule>& rules,
                           const Rule& together, const std::optional<Judgement>& judged) {
    nlohmann::json json{{"output", flags.dry_run ? "" : name_in_json(flags.json, flags.output)},
                        {"splats", together.set.size()}};
    const auto row = [](const Rule& rule) {
        return nlohmann::json{
            {"rule", rule.name}, {"splats", count_of(rule.set)}, {"light_share", rule.light}};
    };
    for (const Rule& rule : rules) json["rules"].push_back(row(rule));
    json["together"] = row(together);
    if (judged)
        json["held_out"] = {{"views", judged->views},
                            {"psnr_before", judged->before},
                            {"psnr_after", judged->after}};
    return json;
}

void tell_report(std::FILE* out, const std::vector<Rule>& rules, const Rule& together,
                 const std::optional<Judgement>& judged) {
    const auto row = [&](const Rule& rule) {
        const std::size_t count = count_of(rule.set);
        tell(out, "{:<19}{:>9} splats ({:.1f} %), {:.2f} % of the light\n", rule.name, count,
             100 * double(count) / double(rule.set.size()), 100 * rule.light);
    };
    for (const Rule& rule : rules) row(rule);
    if (rules.size() > 1) row(together);
    if (judged)
        tell(out, "{} held-out photos: {:.2f} dB before, {:.2f} dB after\n", judged->views,
             judged->before, judged->after);
}

Report paper_report(const CleanFlags& flags, const std::vector<Rule>& rules, const Rule& together,
                    const std::optional<Judgement>& judged) {
    Report report("Cleaning", name_in_json(flags.paper, flags.scene));
    Table table{"rules", "What each rule leaves out", "", {}, {}};
    table.columns = {{"rule", "", Better::neither, 0, TableColumn::Kind::name},
                     {"splats", "", Better::neither, 0},
                     {"of the splats", "%", Better::neither, 1},
                     {"of the light", "%"}};
    const auto add = [&](const Rule& rule, bool ranked) {
        const double count = double(count_of(rule.set));
        table.rows.push_back(
            {{rule.name, count, 100 * count / double(rule.set.size()), 100 * rule.light}, ranked});
    };
    for (const Rule& rule : rules) add(rule, true);
    if (rules.size() > 1) add(together, false);
    report.table(std::move(table));
    if (!judged) return report;
    Table photos{"held out",
                 "Held-out photos",
                 fmt::format("Means over {} photos.", judged->views),
                 {{"", "", Better::neither, 0, TableColumn::Kind::name}, {"PSNR", "dB"}},
                 {{{"before", judged->before}}, {{"after", judged->after}}}};
    report.table(std::move(photos));
    return report;
}

SplatFormat checked_format(const CleanFlags& flags) {
    const std::optional<SplatFormat> format = format_to_write(flags.output);
    if (!format)
        throw Error(flags.output.string(), "names no format that can be written",
                    "Let it end in " + endings_to_write() + ".");
    return *format;
}

void check_named(const CleanFlags& flags) {
    if (flags.output.empty() && !flags.dry_run)
        throw Error("clean", "names no output",
                    "Add -o OUT.ply, or --dry-run to see what would go.");
    if (!flags.output.empty() && flags.dry_run)
        throw Error("--dry-run", "writes no scene, and -o names one", "Leave out one of them.");
}

void write_cleaned(const CleanFlags& flags, SplatFormat format, const Paths& inputs,
                   const WrittenFiles& written, SplatModel& model) {
    for (const std::string& loss : losses_of(format, model, flags.output.string()))
        say("warning: {}: {}\n", flags.output.string(), loss);
    drop_unwritable(format, model);
    const EncodedSplats encoded = encode_scene(format, model, flags.output.string());
    const Paths outputs = outputs_of(flags.output, encoded);
    refuse_to_overwrite_inputs(outputs, inputs, Replaces::all);
    written.check(outputs);
    write_encoded(flags.output, encoded);
    written.wrote(outputs);
}

int clean(CleanFlags flags) {
    check_named(flags);
    check_paper_folder(flags.paper);
    const Paths inputs =
        together({files_of(flags.scene), files_of(flags.cameras), files_of(flags.photos)});
    refuse_to_overwrite_inputs({flags.output, flags.json}, inputs, Replaces::all);
    const WrittenFiles written(files_of(flags.scene), flags.force);
    const SplatFormat format = flags.dry_run ? SplatFormat::ply : checked_format(flags);
    if (!flags.dry_run) written.check({flags.output});
    hold_out_as_trained(flags.scene, flags.data);
    const EffectChoice effects = choose_effects("auto", EffectUse::measuring, flags.data);
    SplatModel model = load_scene(flags.scene, nullptr, flags.units);
    if (model.size() == 0)
        throw Error(flags.scene.string(), "the scene has no splats", "Clean one that has some.");
    Dataset photos;
    if (!flags.photos.empty()) {
        photos = load_dataset(flags.photos, flags.data);
        take_trained_cameras(flags.scene, photos.views);
    }
    say_notes(photos.notes);
    const Cameras cameras = chosen_cameras(flags, model, photos.views);
    if (!cameras.of_photos && (flags.free_space > 0 || flags.few_views > 0))
        throw Error(flags.free_space > 0 ? "--free-space" : "--few-views",
                    "needs the cameras of the photos, and the scene has none",
                    "Name them with --cameras, or the photos themselves with --photos.");
    Device device(command_device(flags.device));
    settle_tuning(device, flags.tune);
    Cleaning cleaning(flags, device, model, cameras);
    const std::vector<Rule> rules = cleaning.rules();
    Rule all{"together", SplatSet(model.size(), 0)};
    for (const Rule& rule : rules)
        for (std::size_t i = 0; i < all.set.size(); ++i) all.set[i] |= rule.set[i];
    all.light = rules.size() == 1 ? rules[0].light : cleaning.light_of(all.set);
    if (count_of(all.set) == model.size())
        throw Error(flags.scene.string(), "nothing would be left",
                    "Use lower limits; --dry-run shows what each rule takes.");
    SplatModel kept = model;
    keep_splats([&](std::size_t i) { return all.set[i] == 0; }, kept);
    const std::optional<Judgement> judged = judge(device, photos, effects, model, kept);
    if (!flags.dry_run) write_cleaned(flags, format, inputs, written, kept);
    write_json(flags.json, report_json(flags, rules, all, judged));
    write_paper(flags.paper, paper_report(flags, rules, all, judged),
                together({inputs, files_of(photos.views), {flags.output}}));
    std::FILE* const out = stream_beside_json(flags.json, flags.quiet);
    tell_report(out, rules, all, judged);
    if (!flags.dry_run)
        tell(out, "{}: {} of {} splats\n", flags.output.string(), kept.size(), model.size());
    tell_paths(flags.quiet, {flags.output, flags.json, flags.paper});
    return 0;
}

}  // namespace

void add_clean(CLI::App& app, Action& action) {
    auto flags = std::make_shared<CleanFlags>();
    CLI::App* command =
        app.add_subcommand("clean", "Remove isolated parts, haze and what floats in free space");
    command->add_option("scene", flags->scene, "splat file, or the output folder of darb train")
        ->required();
    command->add_option("-o,--output", flags->output, "the cleaned scene: " + endings_to_write());
    command->add_flag("--dry-run", flags->dry_run,
                      "print what would be removed, and write nothing");
    command->add_flag("--force", flags->force, "replace a file that darb did not write");
    command
        ->add_option("--isolated", flags->isolated,
                     "remove parts that touch nothing else and whose opacity times area is less "
                     "than this share of the heaviest part's")
        ->default_str("0.01 if no rule is named, else off")
        ->check(CLI::Range(0.0, 1.0));
    command
        ->add_option("--haze", flags->haze,
                     "OPACITY,SIZE, such as 0.1,5: remove splats whose opacity is at most OPACITY "
                     "and whose largest standard deviation is at least SIZE times the median")
        ->default_str("off");
    command
        ->add_option("--free-space", flags->free_space,
                     "remove splats that float before a surface in at least this many views, such "
                     "as 3, and lie at a surface in at most a quarter as many")
        ->default_str("off")
        ->check(CLI::Range(1, 1000));
    command
        ->add_option("--few-views", flags->few_views,
                     "remove splats that are seen, but in fewer views than this")
        ->default_str("off")
        ->check(CLI::Range(1, 1000));
    command
        ->add_option("--region", flags->region,
                     "remove everything outside this region: subject, which is what the cameras "
                     "look at, with 1.25 times its radius; subject:F, with F times its radius; "
                     "sphere:X,Y,Z,RADIUS; or box:MINX,MINY,MINZ,MAXX,MAXY,MAXZ")
        ->default_str("off");
    command->add_option("--photos", flags->photos,
                        "the scene's photos, given as to darb train; measures the PSNR of the "
                        "held-out ones before and after");
    command->add_option("--cameras", flags->cameras,
                        "a cameras.json, a transforms.json or a data set; --photos brings its own "
                        "(default: those of the scene's run, else 24 around the scene, which "
                        "--free-space and --few-views do not take)");
    command->add_option("-r,--resolution", flags->data.resolution,
                        "of the photos: 1, 2, 4 or 8 to divide their size, or a width in px");
    add_json_option(*command, flags->json);
    add_paper_option(*command, flags->paper);
    command->add_option("--device", flags->device, "number or part of a name, see `darb devices`");
    add_tune_flags(*command, flags->tune);
    add_quiet_flag(*command, flags->quiet);
    add_unit_options(*command, flags->units);
    command->callback([flags, &action] { action = [flags] { return clean(*flags); }; });
}

}  // namespace darb
