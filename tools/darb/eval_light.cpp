#include "tools/darb/eval_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/core/say.h"
#include "engine/render/light_share.h"

namespace darb {

namespace {

std::vector<Camera> cameras_of(std::vector<View> views, const EffectPlan& plan) {
    apply_plan(plan, views);
    std::vector<Camera> cameras;
    for (const View& view : views) cameras.push_back(view.camera);
    return cameras;
}

std::optional<double> mean_of(const std::vector<double>& shares) {
    if (shares.empty()) return std::nullopt;
    double sum = 0;
    for (const double share : shares) sum += share;
    return sum / double(shares.size());
}

}  // namespace

LightReport measure_light(Device& device, const SplatModel& model, const EffectChoice& effects,
                          const std::vector<View>& all, const std::vector<View>& views,
                          const std::vector<View>& off_path) {
    SplatModel planned = model;
    const EffectPlan plan = plan_rendering(planned, views, {}, effects);
    apply_plan(plan, planned);
    std::vector<View> training = all;
    std::erase_if(training, [](const View& view) { return view.is_test; });
    const std::vector<std::uint32_t> seen =
        views_that_see(device, planned, cameras_of(training, plan));
    std::vector<std::uint8_t> few;
    for (const std::uint32_t count : seen) few.push_back(count < kFewViews ? 1 : 0);
    LightReport light;
    light.splats = few.size();
    light.few = static_cast<std::size_t>(std::count(few.begin(), few.end(), 1));
    std::vector<double> in_arc, others;
    const std::vector<double> shares = light_shares(device, planned, few, cameras_of(views, plan));
    for (std::size_t v = 0; v < views.size(); ++v) {
        light.views.push_back({views[v].name, shares[v]});
        (views[v].in_arc ? in_arc : others).push_back(shares[v]);
    }
    light.mean = mean_of(others.empty() ? in_arc : others);
    if (!others.empty()) light.arc = mean_of(in_arc);
    light.off_path = mean_of(light_shares(device, planned, few, cameras_of(off_path, plan)));
    return light;
}

namespace {

void print_light(std::FILE* out, const LightReport& light) {
    const auto percent = [](const char* what, const std::optional<double>& share) {
        return share ? fmt::format("{}{:.2f} %", what, 100 * *share) : std::string();
    };
    tell(out, "light of splats that fewer than {} training views see ({} of {}): {}{}{}\n",
         kFewViews, light.few, light.splats, percent("", light.mean), percent(", arc ", light.arc),
         percent(", off path ", light.off_path));
}

}  // namespace

nlohmann::json told_light(std::FILE* out, const LightReport& light) {
    print_light(out, light);
    nlohmann::json views = nlohmann::json::array();
    for (const LightOfView& view : light.views)
        views.push_back({{"name", view.name}, {"share", view.share}});
    nlohmann::json json{{"fewer_than", kFewViews},
                        {"splats", light.few},
                        {"of_splats", light.splats},
                        {"views", views}};
    const std::pair<const char*, const std::optional<double>&> means[] = {
        {"mean", light.mean}, {"arc", light.arc}, {"off_path", light.off_path}};
    for (const auto& [name, share] : means)
        if (share) json[name] = *share;
    return json;
}

}  // namespace darb
