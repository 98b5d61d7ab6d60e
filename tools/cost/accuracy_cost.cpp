// SPDX-License-Identifier: MIT
#include "tools/cost/accuracy_cost.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>

#include "engine/core/error.h"
#include "engine/core/quantile.h"
#include "engine/plan/accuracy.h"
#include "engine/reference/reference_render.h"
#include "engine/render/renderer.h"
#include "trainer/run/run_report.h"

namespace darb {

namespace {

constexpr double kPercentile = 0.999;
constexpr double kLeastMse = 1e-20;  // 200 dB

}  // namespace

PictureError picture_error(const std::vector<ImageF>& pictures, const std::vector<ImageF>& truth) {
    DARB_CHECK(pictures.size() == truth.size(), "{} and {}", pictures.size(), truth.size());
    std::vector<float> errors;
    double sum = 0;
    for (size_t v = 0; v < truth.size(); ++v) {
        DARB_CHECK(pictures[v].data.size() == truth[v].data.size(), "view {}", v);
        for (size_t i = 0; i < truth[v].data.size(); ++i) {
            const double e = std::abs(double(std::clamp(pictures[v].data[i], 0.0f, 1.0f)) -
                                      double(std::clamp(truth[v].data[i], 0.0f, 1.0f)));
            sum += e * e;
            errors.push_back(static_cast<float>(e));
        }
    }
    PictureError result;
    if (errors.empty()) return result;
    result.mse = sum / static_cast<double>(errors.size());
    result.psnr_db = -10 * std::log10(std::max(result.mse, kLeastMse));
    result.largest = *std::max_element(errors.begin(), errors.end());
    const auto at = errors.begin() + static_cast<std::ptrdiff_t>(
                                         kPercentile * static_cast<double>(errors.size() - 1));
    std::nth_element(errors.begin(), at, errors.end());
    result.percentile = *at;
    return result;
}

std::vector<ImageF> true_pictures(const SplatModel& model, const std::vector<Camera>& cameras,
                                  const glm::vec3& background, bool by_pixel) {
    const Accuracy exact = preset_accuracy(kExact);
    reference::RenderSettings settings;
    settings.alpha_cutoff = exact.value(kAlphaCutoff);
    settings.transmittance_stop = exact.value(kTransmittanceStop);
    if (by_pixel) settings.depth_order = DEPTH_ORDER_PIXEL;
    for (int c = 0; c < 3; ++c) settings.background[c] = background[c];
    const auto splats = reference::make_splats<double>(model);
    std::vector<ImageF> pictures;
    for (Camera camera : cameras) {
        camera.translation += camera.rotation * model.origin;  // positions are relative to it
        const auto result = reference::render(splats, camera, settings);
        ImageF picture(camera.width, camera.height, 3);
        std::copy(result.images.colour.data.begin(), result.images.colour.data.end(),
                  picture.data.begin());
        pictures.push_back(std::move(picture));
    }
    return pictures;
}

namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Collects the samples of one row, one value per repeat.
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

    /// Warms up, fills errors and photos of rows[first ...], then times all of them and balanced in
    /// turn. Returns the number of repeats.
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
    if (balanced_.empty()) balanced_ = pictures;  // the very first row
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
            for (size_t i = 0; i < renderers.size(); ++i) {  // each turn begins with another row
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
            if (s == kArithmetic &&
                !(device.info().half_arithmetic && has_half_blend(model.kernel)))
                continue;
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

// Which combinations to measure, which rows are on the front, and what that means in words.

namespace {

constexpr double kPhotoLossDb = 0.1;
constexpr double kVisible = 1.0 / 255;  // one step of an 8-bit screen

struct Predicted {
    Accuracy accuracy;
    double ms = 0, mse = 0;
};

/// The effect of a single choice on time and squared error.
struct Effect {
    int choice = 0;
    double ratio = 1, added = 0;
};

std::vector<std::vector<Effect>> effects_of(const std::vector<CostRow>& rows) {
    std::vector<std::vector<Effect>> effects(kAccuracyCount, {Effect{}});
    for (const CostRow& row : rows) {
        if (row.setting < 0 || row.same_as_balanced) continue;
        effects[row.setting].push_back({row.accuracy.choice[row.setting],
                                        row.ms.median / rows[0].ms.median,
                                        row.error.mse - rows[0].error.mse});
    }
    return effects;
}

/// The rows with the smallest `key` for their time, fastest first.
template <class Row, class Ms, class Key>
std::vector<size_t> front_of(const std::vector<Row>& rows, const Ms& ms, const Key& key) {
    std::vector<size_t> order(rows.size());
    for (size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
        return ms(rows[a]) != ms(rows[b]) ? ms(rows[a]) < ms(rows[b]) : key(rows[a]) < key(rows[b]);
    });
    std::vector<size_t> front;
    for (const size_t i : order)
        if (front.empty() || key(rows[i]) < key(rows[front.back()])) front.push_back(i);
    return front;
}

/// Whether a second measurement would leave the order of the two as it is.
bool is_faster(const CostRow& row, const CostRow& other) {
    return std::max(row.ms.high, row.ms.median) <
           (other.ms.low > 0 ? std::min(other.ms.low, other.ms.median) : other.ms.median);
}

bool holds(const std::vector<CostRow>& rows, const Accuracy& accuracy) {
    return std::any_of(rows.begin(), rows.end(),
                       [&](const CostRow& row) { return row.accuracy == accuracy; });
}

double milliseconds(const CostRow& row) {
    return row.ms.median;
}

std::string sentence(const CostResult& result, const std::string& condition,
                     const std::function<bool(const CostRow&)>& fits) {
    const CostRow* best = nullptr;
    for (const CostRow& row : result.rows)
        if (fits(row) && (best == nullptr || row.ms.median < best->ms.median)) best = &row;
    if (best == nullptr) return fmt::format("{}: none of the measured ones.", condition);
    const bool apart = is_faster(*best, result.rows[0]);
    if (fits(result.rows[0]) && !apart) best = result.rows.data();
    const double gain = result.rows[0].ms.median / best->ms.median;
    std::string text =
        fmt::format("{}: {}, {:.3g} ms a frame", condition, best->name, best->ms.median);
    if (best != result.rows.data())
        text += apart ? fmt::format(", {:.2f} times as fast as balanced", gain)
                      : ", no faster than balanced beyond the spread";
    text += fmt::format(", {:.1f} dB from the truth", best->error.psnr_db);
    if (best->photo_psnr_db)
        text += fmt::format(", {:.2f} dB against the photos", *best->photo_psnr_db);
    return text + ".";
}

}  // namespace

std::vector<Accuracy> promising_combinations(const std::vector<CostRow>& rows, size_t most) {
    std::vector<Predicted> all{{Accuracy{}, rows[0].ms.median, rows[0].error.mse}};
    const std::vector<std::vector<Effect>> effects = effects_of(rows);
    for (int s = 0; s < kAccuracyCount; ++s) {
        // Another footprint makes another model, not a better picture of this one.
        if (s == kFootprint) continue;
        std::vector<Predicted> next;
        for (const Predicted& p : all)
            for (const Effect& e : effects[s]) {
                Predicted q = p;
                q.accuracy.choice[s] = e.choice;
                q.ms *= e.ratio;
                q.mse = std::max(q.mse + e.added, 1e-16);
                next.push_back(q);
            }
        all = std::move(next);
    }
    std::vector<Accuracy> wanted;
    for (const size_t i : front_of(
             all, [](const Predicted& p) { return p.ms; },
             [](const Predicted& p) { return p.mse; }))
        if (!holds(rows, all[i].accuracy)) wanted.push_back(all[i].accuracy);
    if (wanted.size() <= most) return wanted;
    std::vector<Accuracy> spread;
    for (size_t k = 0; k < most; ++k) spread.push_back(wanted[k * wanted.size() / most]);
    return spread;
}

// A row is on the front if it is faster than all better rows, by more than the spread of the times.
void mark_fronts(std::vector<CostRow>& rows) {
    const auto mark = [&](const auto& key, bool CostRow::*on) {
        for (const size_t i : front_of(rows, milliseconds, key))
            rows[i].*on = std::ranges::all_of(rows, [&](const CostRow& other) {
                return key(other) >= key(rows[i]) || is_faster(rows[i], other);
            });
    };
    mark([](const CostRow& r) { return r.error.mse; }, &CostRow::on_front);
    if (rows.empty() || !rows[0].photo_psnr_db) return;
    mark([](const CostRow& r) { return -*r.photo_psnr_db; }, &CostRow::on_photo_front);
}

std::vector<std::string> cost_answers(const CostResult& result) {
    std::vector<std::string> answers;
    if (result.rows[0].photo_psnr_db) {
        const Accuracy exact = preset_accuracy(kExact);
        for (const CostRow& row : result.rows)
            if (row.accuracy == exact)
                answers.push_back(sentence(
                    result,
                    fmt::format("Fastest within {} dB of the photos' PSNR at exact", kPhotoLossDb),
                    [&](const CostRow& r) {
                        return *r.photo_psnr_db >= *row.photo_psnr_db - kPhotoLossDb;
                    }));
    }
    answers.push_back(sentence(result,
                               "Fastest with 99.9 % of the values within 1/255 of the truth",
                               [](const CostRow& r) { return r.error.percentile <= kVisible; }));
    for (const double db : {60.0, 50.0, 40.0})
        answers.push_back(sentence(result,
                                   fmt::format("Fastest at {} dB or more from the truth", db),
                                   [&](const CostRow& r) { return r.error.psnr_db >= db; }));
    return answers;
}

}  // namespace darb
