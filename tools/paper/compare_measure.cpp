#include "tools/paper/compare_measure.h"

#include <algorithm>

#include "engine/data/metrics.h"
#include "engine/scene/splat_file.h"

namespace darb {

void ViewLpips::measure(ComparedRun& run) {
    if (lpips_ == nullptr) return;
    for (ComparedAt& at : run.at) {
        double sum = 0;
        std::size_t measured = 0;
        for (ComparedView& view : at.views) {
            if (!std::filesystem::exists(view.picture)) continue;
            const HeldOutPicture p = read_held_out(view.picture);
            if (std::min(p.photo.width, p.photo.height) < lpips_->least_size()) continue;
            if (!photos_.contains(view.name))
                photos_[view.name] = lpips_->features(to_float(p.photo));
            view.lpips = lpips_->distance(lpips_->features(to_float(p.render)), photos_[view.name]);
            sum += *view.lpips;
            ++measured;
        }
        if (measured > 0 && measured == at.views.size())
            at.lpips = sum / static_cast<double>(measured);
    }
}

void measure_blending_of(ComparedRun& run, Device& device, std::vector<Camera> cameras, int views) {
    if (run.at.empty() || run.at.back().model.empty()) return;
    cameras.resize(std::min(cameras.size(), static_cast<std::size_t>(views)));
    run.blending = measure_blending(device, load_splats(run.at.back().model), cameras);
}

}  // namespace darb
