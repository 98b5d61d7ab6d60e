// SPDX-License-Identifier: MIT
#include "trainer/run/evaluation.h"

#include <cmath>
#include <optional>
#include <set>

#include "engine/data/image_io.h"

namespace darb {

namespace {

// The means over the views in the arc, or over the others.
ArcMeans means_of(const std::vector<ViewMetrics>& views, bool in_arc) {
    ArcMeans means;
    double count = 0;
    for (const ViewMetrics& v : views) {
        if (v.in_arc != in_arc) continue;
        ++means.views;
        if (std::isnan(v.psnr_db)) continue;
        means.psnr_db += v.psnr_db;
        means.ssim += v.ssim;
        ++count;
    }
    if (means.views == 0) return means;
    means.psnr_db /= count;
    means.ssim /= count;
    return means;
}

std::optional<DepthError> depth_means(const std::vector<ViewMetrics>& views) {
    DepthError sum;
    double count = 0;
    for (const ViewMetrics& v : views) {
        if (!v.depth) continue;
        sum.mean_m += v.depth->mean_m;
        sum.median_m += v.depth->median_m;
        ++count;
    }
    if (count == 0) return std::nullopt;
    return DepthError{sum.mean_m / count, sum.median_m / count};
}

}  // namespace

void take_means(Evaluation& evaluation) {
    evaluation.depth = depth_means(evaluation.views);
    const ArcMeans arc = means_of(evaluation.views, true);
    const ArcMeans others = means_of(evaluation.views, false);
    evaluation.arc.reset();
    if (arc.views > 0 && others.views > 0) evaluation.arc = arc;
    const ArcMeans& means = others.views > 0 ? others : arc;
    evaluation.psnr_db = means.psnr_db;
    evaluation.ssim = means.ssim;
}

Evaluation evaluate_held_out(Trainer& trainer, const Dataset& dataset,
                             const std::vector<ImageU8>& photos) {
    Evaluation evaluation;
    for (size_t i = 0; i < dataset.views.size(); ++i) {
        const View& view = dataset.views[i];
        if (!view.is_test) continue;
        evaluation.views.push_back(compare_view(view.name, trainer.render(trainer.camera(i)),
                                                photos[i], trainer.background(),
                                                dataset.alpha_is_mask));
        evaluation.views.back().in_arc = view.in_arc;
    }
    take_means(evaluation);
    return evaluation;
}

std::vector<std::filesystem::path> write_side_by_side(Trainer& trainer, const Dataset& dataset,
                                                      const std::vector<ImageU8>& photos,
                                                      const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    std::set<std::string> used;
    for (size_t i = 0; i < dataset.views.size(); ++i) {
        const View& view = dataset.views[i];
        if (!view.is_test) continue;
        const auto path = folder / picture_name(view.name, used);
        write_png(path, side_by_side(composite(photos[i], trainer.background()),
                                     trainer.render(trainer.camera(i))));
        files.push_back(path);
    }
    return files;
}

}  // namespace darb
