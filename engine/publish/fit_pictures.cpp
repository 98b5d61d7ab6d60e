// SPDX-License-Identifier: MIT
#include "engine/publish/fit_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/text.h"
#include "engine/data/metrics.h"
#include "engine/render/renderer.h"
#include "engine/scene/merge_splats.h"

namespace darb {

namespace {

constexpr std::size_t kFittedViews = 8;
constexpr int kFittedWidth = 800;      // px
constexpr double kShareOfRoom = 0.98;  // because fewer splats deflate slightly worse

Camera pinhole_at_most(Camera camera, int width) {
    camera.lens = {};
    if (camera.width <= width) return camera;
    const double share = double(width) / camera.width;
    return resized(camera, width,
                   std::max(1, static_cast<int>(std::lround(camera.height * share))));
}

/// A smaller number of splats whose output is likely to fit.
std::size_t count_that_fits(std::size_t splats, std::size_t fixed, std::size_t bytes,
                            std::uint64_t most) {
    const double share = (static_cast<double>(most) - static_cast<double>(fixed)) /
                         static_cast<double>(bytes - fixed);
    const double count = std::floor(kShareOfRoom * share * static_cast<double>(splats));
    if (count < 1)
        throw Error("--max-size",
                    fmt::format("{} bytes have no room for splats", most) +
                        (fixed > 0 ? fmt::format(": what comes beside them takes {}", fixed) : ""),
                    "Allow more bytes.");
    return static_cast<std::size_t>(count);
}

struct Search {
    const SplatModel& source;
    const PictureMeasure* measure;
    const PictureLimits& limits;
    PictureOutput& output;

    /// Chooses the level, or the next finer ones, by pictures alone.
    PictureFit by_pictures() const {
        std::vector<PictureLoss> losses;
        PictureFit fit;
        for (fit.level = limits.least_level; fit.level < limits.levels; ++fit.level) {
            losses.push_back(measure->compare(output.pack(source, fit.level)));
            fit.loss = losses.back();
            if (fit.loss.worst_db >= kEnoughDb) return fit;
        }
        const double finest = losses.back().worst_db;
        const auto first = std::ranges::find_if(
            losses, [&](const PictureLoss& one) { return one.worst_db >= finest - kNoWorseDb; });
        fit.loss = *first;
        fit.level = limits.least_level + static_cast<int>(first - losses.begin());
        if (fit.level + 1 < limits.levels) output.pack(source, fit.level);
        return fit;
    }

    /// Merges until the output fits, which is finished but too large.
    void shrink(PictureFit& fit, SplatModel& kept) const {
        while (fit.bytes > limits.max_bytes) {
            const SplatModel& from = kept.size() > 0 ? kept : source;
            kept = merge_splats(from, count_that_fits(from.size(), output.fixed_bytes(), fit.bytes,
                                                      limits.max_bytes));
            fit.merged_from = source.size();
            const SplatModel shown = output.pack(kept, fit.level);
            if (measure) fit.loss = measure->compare(shown);
            fit.bytes = output.finish(fit);
        }
    }

    PictureFit at_level(int level, SplatModel& kept) const {
        PictureFit fit;
        fit.level = level;
        const SplatModel shown = output.pack(source, level);
        if (measure) fit.loss = measure->compare(shown);
        fit.bytes = output.finish(fit);
        shrink(fit, kept);
        return fit;
    }
};

}  // namespace

PictureMeasure::PictureMeasure(Device& device, const SplatModel& source,
                               const std::vector<View>& views, const glm::vec3& background,
                               Progress progress)
    : device_(device), background_(background), progress_(std::move(progress)) {
    const std::size_t count = std::min(kFittedViews, views.size());
    Renderer renderer(device, source);
    for (std::size_t i = 0; i < count; ++i) {
        const View& view = views[i * views.size() / count];
        names_.push_back(view.name);
        cameras_.push_back(pinhole_at_most(view.camera, kFittedWidth));
        truths_.push_back(picture(renderer, i));
    }
}

ImageF PictureMeasure::picture(Renderer& renderer, std::size_t view) const {
    ImageF made = renderer.render(cameras_[view], background_);
    if (progress_) progress_(++pictures_);
    return made;
}

PictureLoss PictureMeasure::compare(const SplatModel& splats) const {
    Renderer renderer(device_, splats);
    PictureLoss loss{cameras_.size(), 0, 2 * kEqualPicturesDb, ""};
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
        const double db = std::min(psnr(picture(renderer, i), truths_[i]), kEqualPicturesDb);
        loss.mean_db += db / static_cast<double>(cameras_.size());
        if (db >= loss.worst_db) continue;
        loss.worst_db = db;
        loss.worst_view = names_[i];
    }
    return loss;
}

PictureFit fit_pictures(const SplatModel& source, const PictureMeasure* measure,
                        const PictureLimits& limits, PictureOutput& output) {
    const Search search{source, measure, limits, output};
    PictureFit best;
    if (measure) {
        best = search.by_pictures();
    } else {
        best.level = limits.levels - 1;
        output.pack(source, best.level);
    }
    best.bytes = output.finish(best);
    if (limits.max_bytes == 0 || best.bytes <= limits.max_bytes) return best;
    SplatModel kept;
    search.shrink(best, kept);
    bool last = true;  // whether the output holds the best one
    for (int level = best.level - 1; measure && level >= limits.least_level; --level) {
        SplatModel fewer;
        const PictureFit next = search.at_level(level, fewer);
        last = next.loss.worst_db > best.loss.worst_db;
        if (!last) break;
        best = next;
        kept = std::move(fewer);
    }
    if (!last) {
        output.pack(kept.size() > 0 ? kept : source, best.level);
        best.bytes = output.finish(best);
    }
    return best;
}

std::string loss_text(const PictureLoss& loss) {
    return fmt::format("{:.2f} dB mean over {} views, {:.2f} dB at worst ({})", loss.mean_db,
                       loss.views, loss.worst_db, printable(loss.worst_view));
}

}  // namespace darb
