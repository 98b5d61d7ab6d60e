#include "trainer/evaluation.h"

#include <cmath>
#include <set>

#include "engine/data/image_io.h"

namespace darb {

void take_means(Evaluation& evaluation) {
    double psnr_sum = 0, ssim_sum = 0, count = 0;
    for (const ViewMetrics& v : evaluation.views) {
        if (std::isnan(v.psnr_db)) continue;
        psnr_sum += v.psnr_db;
        ssim_sum += v.ssim;
        ++count;
    }
    if (evaluation.views.empty()) count = 1;
    evaluation.psnr_db = psnr_sum / count;
    evaluation.ssim = ssim_sum / count;
}

Evaluation evaluate_held_out(Trainer& trainer, const Dataset& dataset,
                             const std::vector<ImageU8>& photos) {
    Evaluation evaluation;
    for (size_t i = 0; i < dataset.views.size(); ++i) {
        const View& view = dataset.views[i];
        if (view.is_test)
            evaluation.views.push_back(compare_view(view.name, trainer.render(view.camera),
                                                    photos[i], trainer.background(),
                                                    dataset.alpha_is_mask));
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
                                     trainer.render(view.camera)));
        files.push_back(path);
    }
    return files;
}

}  // namespace darb
