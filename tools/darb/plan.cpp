// darb plan X: which effects a data set or a scene calls for, why, and what each costs here.

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "engine/core/files.h"
#include "engine/data/camera_list.h"
#include "tools/darb/commands.h"
#include "tools/darb/effect_flags.h"
#include "tools/darb/plan_price.h"
#include "tools/darb/scene_file.h"

namespace darb {

namespace {

using nlohmann::json;

struct PlanFlags {
    std::filesystem::path what, cameras;
    std::string device, effects = "auto";
    bool as_json = false, no_price = false, compare = false, depth = false;
    int sh_degree = 3;
    DatasetOptions data;
};

bool is_scene(const std::filesystem::path& path) {
    if (std::filesystem::is_regular_file(path)) return path.extension() != ".json";
    return std::filesystem::exists(path / "point_cloud") ||  // of darb train
           std::filesystem::exists(path / "meta.json");      // a SOG scene
}

struct Subject {
    bool training = false;
    SplatModel model;
    std::vector<View> views;
    Dataset dataset;
    std::vector<ImageU8> photos;
};

Subject open(const PlanFlags& flags) {
    Subject s;
    s.training = !is_scene(flags.what);
    if (s.training) {
        s.dataset = load_dataset(flags.what, flags.data);
        if (!s.dataset.points.seen_begin.empty() || s.dataset.has_alpha)
            s.photos = load_photos(s.dataset.views);
        return s;
    }
    s.model = load_scene(flags.what);
    if (!flags.cameras.empty()) s.views = load_cameras(flags.cameras, flags.data);
    return s;
}

EffectPlan plan_of(const Subject& s, const PlanFlags& flags, const EffectChoice& choice) {
    return s.training ? plan_training(s.dataset, s.photos, flags.sh_degree, choice)
                      : plan_rendering(s.model, s.views, {.depth = flags.depth}, choice);
}

Measured measure(const Subject& s, const PlanFlags& flags, const EffectPlan& plan) {
    DeviceOptions device;
    device.select = flags.device;
    if (s.training) return measure_training(device, s.dataset, TrainOptions{}, plan);
    const std::vector<View> views = s.views.empty() ? framing_views(s.model) : s.views;
    return measure_rendering(device, s.model, views, plan);
}

json rows_json(const EffectPlan& plan, const EffectPrices& prices) {
    json rows = plan_json(plan);
    for (std::size_t e = 0; e < prices.size(); ++e)
        if (prices[e]) rows[e]["price"] = {{"ms", prices[e]->ms}, {"bytes", prices[e]->bytes}};
    return rows;
}

void print_rows(const EffectPlan& plan, const EffectPrices& prices, bool training) {
    fmt::print("{:<10}  {:<3}  {:>9}  {:>9}  reason\n", "effect", "",
               training ? "ms/iter" : "ms/frame", "MB");
    for (int e = 0; e < EFFECT_COUNT; ++e) {
        const EffectRow& row = plan.row(e);
        const auto price = prices.empty() ? std::nullopt : prices[static_cast<std::size_t>(e)];
        const std::string ms = price ? fmt::format("{:+.2f}", price->ms) : "-";
        const std::string mb = price ? fmt::format("{:+.2f}", double(price->bytes) / 1e6) : "-";
        fmt::print("{:<10}  {:<3}  {:>9}  {:>9}  {}\n", effect_name(e), row.on ? "on" : "off", ms,
                   mb, row.reason);
    }
}

// none, auto and all as wholes.
json compare_choices(const Subject& s, const PlanFlags& flags) {
    json list = json::array();
    for (const char* name : {"none", "auto", "all"}) {
        const Measured m = measure(s, flags, plan_of(s, flags, parse_effects(name)));
        list.push_back(
            {{"effects", name}, {"ms", m.ms}, {"spread_ms", m.spread_ms}, {"peak_bytes", m.bytes}});
        if (!flags.as_json)
            fmt::print("{:<5} {:>9.2f} ms (spread {:.2f})  {:>9.2f} MB at the peak\n", name, m.ms,
                       m.spread_ms, static_cast<double>(m.bytes) / 1e6);
    }
    return list;
}

int run_plan(const PlanFlags& flags) {
    const EffectChoice choice = parse_effects(flags.effects);
    const Subject s = open(flags);
    EffectPlan plan = plan_of(s, flags, choice);
    const bool empty = !s.training && s.model.size() == 0;
    EffectPrices prices;
    if (!empty && (!flags.no_price || flags.compare)) {
        const Measured base = measure(s, flags, plan);
        plan.note_frame(base.huge_splats, base.longest_list);
        const int most_degree = s.training ? flags.sh_degree : s.model.sh_degree;
        const auto with = [&](const EffectPlan& p) { return measure(s, flags, p); };
        if (!flags.no_price) prices = price_effects(plan, base, s.training, most_degree, with);
    }
    if (!flags.as_json) print_rows(plan, prices, s.training);
    const char* kind = s.training ? "data set" : "scene";
    json result{{"path", flags.what.string()}, {"kind", kind}, {"effects", rows_json(plan, prices)}};
    if (flags.compare && !empty) result["compared"] = compare_choices(s, flags);
    if (flags.as_json)
        fmt::print("{}\n", result.dump(2, ' ', false, json::error_handler_t::replace));
    return 0;
}

}  // namespace

void add_plan(CLI::App& app, Action& action) {
    auto flags = std::make_shared<PlanFlags>();
    CLI::App* command = app.add_subcommand(
        "plan", "Which effects a data set or a scene calls for, why, and what each costs");
    command->add_option("what", flags->what, "a data set, a scene, or an output folder")
        ->required();
    command->add_option("--cameras", flags->cameras,
                        "of a scene: the cameras that it will be rendered through");
    command->add_option("-r,--resolution", flags->data.resolution, "as in training");
    command->add_option("--sh-degree", flags->sh_degree, "of a data set: the highest degree")
        ->capture_default_str()
        ->check(CLI::Range(0, 3));
    command->add_flag("--depth", flags->depth, "of a scene: depth images are wanted too");
    add_effects_flag(*command, flags->effects);
    add_lens_flag(*command, flags->data);
    command->add_flag("--no-price", flags->no_price, "measure no times");
    command->add_flag("--compare", flags->compare, "time and memory of none, auto and all");
    command->add_flag("--json", flags->as_json, "as JSON, on standard output");
    command->add_option("--device", flags->device, "number or part of a name, see `darb devices`");
    command->callback([flags, &action] { action = [flags] { return run_plan(*flags); }; });
}

}  // namespace darb
