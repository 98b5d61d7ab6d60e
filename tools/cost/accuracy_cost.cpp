#include "tools/cost/accuracy_cost.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>

#include "engine/core/quantile.h"
#include "engine/render/renderer.h"
#include "trainer/run/evaluation.h"

namespace darb {

namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// What the samples of one row are gathered in, a value a repeat.
struct Samples {
    std::vector<double> frame;
    std::vector<std::pair<std::string, std::vector<double>>> passes;

    std::vector<double>& of(const std::string& name) {
        for (auto& [known, values] : passes)
            if (known == name) return values;
        return passes.emplace_back(name, std::vector<double>{}).second;
    }
};

class Measurement {
  public:
    Measurement(Device& device, const SplatModel& model, const CostViews& views,
                const glm::vec3& background)
        : device_(device), model_(model), views_(views), background_(background) {
        const auto start = Clock::now();
        truth_ = true_pictures(model, views.cameras, background, false);
        truth_by_pixel_ = true_pictures(model, views.cameras, background, true);
        truth_seconds_ = since(start);
    }

    double truth_seconds() const { return truth_seconds_; }

    /// Warms up, fills errors and photos of rows[first ...], then times all of them and balanced,
    /// turn by turn. Returns the repeats.
    int run(std::vector<CostRow>& rows, size_t first, const CostPlan& plan, size_t& group_size,
            double& balanced_ms);

  private:
    void judge(CostRow& row, Renderer& renderer);
    void time_once(Renderer& renderer, Samples& samples);

    Device& device_;
    const SplatModel& model_;
    const CostViews& views_;
    glm::vec3 background_;
    std::vector<ImageF> truth_, truth_by_pixel_, balanced_;
    double truth_seconds_ = 0;
};

void Measurement::judge(CostRow& row, Renderer& renderer) {
    std::vector<ImageF> pictures;
    for (const Camera& camera : views_.cameras)
        pictures.push_back(renderer.render(camera, background_));
    row.error = picture_error(pictures, truth_);
    row.error_by_pixel = picture_error(pictures, truth_by_pixel_);
    if (!views_.photos.empty()) {
        Evaluation evaluation;
        for (size_t v = 0; v < pictures.size(); ++v) {
            evaluation.views.push_back(compare_view(views_.names[v], pictures[v], views_.photos[v],
                                                    background_, views_.alpha_is_mask));
        }
        take_means(evaluation);
        row.photo_psnr_db = evaluation.psnr_db;
        row.photo_ssim = evaluation.ssim;
    }
    if (balanced_.empty()) balanced_ = pictures;  // the first row of all
    row.same_as_balanced = true;
    for (size_t v = 0; v < pictures.size(); ++v)
        row.same_as_balanced &= pictures[v].data == balanced_[v].data;
}

void Measurement::time_once(Renderer& renderer, Samples& samples) {
    const double share = 1.0 / static_cast<double>(views_.cameras.size());
    double frame = 0;
    std::vector<std::pair<std::string, double>> passes;
    for (const Camera& camera : views_.cameras) {
        renderer.draw(camera, background_);
        for (const PassTime& pass : renderer.pass_times()) {
            frame += pass.ms * share;
            const auto known = std::find_if(passes.begin(), passes.end(),
                                            [&](const auto& p) { return p.first == pass.name; });
            if (known == passes.end())
                passes.emplace_back(pass.name, pass.ms * share);
            else
                known->second += pass.ms * share;
        }
    }
    samples.frame.push_back(frame);
    for (const auto& [name, ms] : passes) samples.of(name).push_back(ms);
}

int Measurement::run(std::vector<CostRow>& rows, size_t first, const CostPlan& plan,
                     size_t& group_size, double& balanced_ms) {
    const std::uint64_t before = device_.allocated_bytes();
    Renderer balanced(device_, model_);
    judge(rows[0], balanced);
    const std::uint64_t each = std::max<std::uint64_t>(device_.allocated_bytes() - before, 1);
    const std::uint64_t budget = device_.info().heap_bytes / 3;
    group_size = std::clamp<size_t>(budget / each, 1, std::max<size_t>(rows.size() - first, 1));
    Samples of_balanced;
    std::vector<Samples> samples(rows.size());
    const double groups =
        std::ceil(static_cast<double>(rows.size() - first) / static_cast<double>(group_size));
    int fewest = plan.most_repeats;
    for (size_t begin = first; begin < rows.size(); begin += group_size) {
        const size_t end = std::min(rows.size(), begin + group_size);
        std::vector<std::unique_ptr<Renderer>> renderers;
        for (size_t r = begin; r < end; ++r) {
            renderers.push_back(std::make_unique<Renderer>(device_, model_, rows[r].accuracy));
            judge(rows[r], *renderers.back());
        }
        const auto start = Clock::now();
        int repeat = 0;
        while (repeat < plan.most_repeats &&
               (repeat < plan.least_repeats || since(start) < plan.seconds / groups)) {
            time_once(balanced, of_balanced);
            for (size_t i = 0; i < renderers.size(); ++i) {  // each turn begins elsewhere
                const size_t r = (i + static_cast<size_t>(repeat)) % renderers.size();
                time_once(*renderers[r], samples[begin + r]);
            }
            ++repeat;
        }
        fewest = std::min(fewest, repeat);
    }
    if (first <= 1) samples[0] = of_balanced;
    balanced_ms = spread_of(of_balanced.frame).median;
    for (size_t r = first <= 1 ? 0 : first; r < rows.size(); ++r) {
        rows[r].ms = spread_of(samples[r].frame);
        for (const auto& [name, values] : samples[r].passes)
            rows[r].passes.emplace_back(name, spread_of(values));
    }
    return fewest;
}

std::vector<CostRow> single_rows(const Device& device, const SplatModel& model) {
    std::vector<CostRow> rows(1);
    rows[0].name = accuracy_text({});
    for (int s = 0; s < kAccuracyCount; ++s)
        for (size_t c = 1; c < accuracy_settings()[s].choices.size(); ++c) {
            CostRow row;
            row.accuracy.choice[s] = static_cast<int>(c);
            row.setting = s;
            row.name = fmt::format("{} {}", accuracy_settings()[s].name, row.accuracy.of(s).name);
            if (s == kShDegree && row.accuracy.value(s) >= model.sh_degree) continue;
            if (s == kFootprint && row.accuracy.value(s) == static_cast<int>(model.footprint))
                continue;
            // Rings are always built in, some kernels never.
            if (s == kEvaluation && kernel_pulses(model.kernel) > 1) continue;
            if (s == kEvaluation && row.accuracy.of(s).name == std::string_view("builtin") &&
                !has_builtin_evaluation(model.kernel))
                continue;
            if (s == kEvaluation && !changes_evaluation(device, row.accuracy, model.kernel))
                continue;
            if (s == kFootprint && !has_exact_footprint(model.kernel)) continue;
            rows.push_back(std::move(row));
        }
    for (const int preset : {int(kFast), int(kExact)}) {
        CostRow row;
        row.accuracy = preset_accuracy(preset);
        row.name = preset_name(preset);
        rows.push_back(std::move(row));
    }
    return rows;
}

void scale(Spread& s, double factor) {
    s.median *= factor;
    s.low *= factor;
    s.high *= factor;
}

}  // namespace

Spread spread_of(std::vector<double> samples) {
    if (samples.empty()) return {};
    std::sort(samples.begin(), samples.end());
    return {quantile(samples, 0.5), quantile(samples, 0.25), quantile(samples, 0.75)};
}

CostResult measure_cost(Device& device, const SplatModel& model, const CostViews& views,
                        const glm::vec3& background, const CostPlan& plan,
                        const std::function<void(const std::string&)>& progress) {
    CostResult result;
    progress(fmt::format("truth: {} views in double precision", views.cameras.size()));
    Measurement measurement(device, model, views, background);
    result.truth_seconds = measurement.truth_seconds();
    result.rows = single_rows(device, model);
    progress(fmt::format("each setting alone: {} rows", result.rows.size()));
    double alone_ms = 0, together_ms = 0;
    result.repeats = measurement.run(result.rows, 1, plan, result.group, alone_ms);
    const size_t first = result.rows.size();
    for (const Accuracy& accuracy : promising_combinations(result.rows, plan.combinations)) {
        CostRow row;
        row.accuracy = accuracy;
        row.name = accuracy_text(accuracy);
        result.rows.push_back(std::move(row));
    }
    if (result.rows.size() > first) {
        progress(fmt::format("combinations: {} rows", result.rows.size() - first));
        size_t group = 0;
        const int repeats = measurement.run(result.rows, first, plan, group, together_ms);
        result.repeats = std::min(result.repeats, repeats);
        result.drift = together_ms / alone_ms;
        for (size_t r = first; r < result.rows.size(); ++r) {
            scale(result.rows[r].ms, 1 / result.drift);
            for (auto& [name, spread] : result.rows[r].passes) scale(spread, 1 / result.drift);
        }
    }
    mark_fronts(result.rows);
    result.view_names = views.names;
    for (const Camera& c : views.cameras) result.pixels += std::uint64_t(c.width) * c.height;
    result.splats = model.size();
    result.device = device.info().name;
    result.driver = device.info().driver;
    result.kernel = kernel_name(model.kernel);
    result.footprint = footprint_name(model.footprint);
    return result;
}

}  // namespace darb
