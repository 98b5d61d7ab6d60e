// Which combinations to measure, which rows are on the front, and what that means in words.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "tools/cost/accuracy_cost.h"

namespace darb {

namespace {

constexpr double kPhotoLossDb = 0.1;
constexpr double kVisible = 1.0 / 255;  // one step of an 8-bit screen

struct Predicted {
    Accuracy accuracy;
    double ms = 0, mse = 0;
};

/// What a choice alone does to time and squared error.
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

/// The rows of the least `key` for their time, fastest first.
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

/// Whether measuring again would not turn the two around.
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
        // Another footprint is another model, and no way to a better picture of this one.
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

// On the front is what is faster than all that is better, by more than the spread of the times.
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
