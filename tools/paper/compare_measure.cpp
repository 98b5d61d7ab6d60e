// SPDX-License-Identifier: MIT
#include "tools/paper/compare_measure.h"

#include <algorithm>
#include <filesystem>

#include "engine/core/error.h"
#include "engine/data/metrics.h"
#include "engine/scene/splat_file.h"

namespace darb {

double ViewLpips::distance(const ComparedView& view, const HeldOutPicture& picture) {
    const LpipsFeatures render = lpips_->features(to_float(picture.render));
    if (const auto kept = photos_.find(view.name); kept != photos_.end())
        return lpips_->distance(render, kept->second);
    LpipsFeatures photo = lpips_->features(to_float(picture.photo));
    const double distance = lpips_->distance(render, photo);
    if (const std::size_t bytes = photo.bytes(); bytes <= room_) {
        room_ -= bytes;
        photos_.emplace(view.name, std::move(photo));
    }
    return distance;
}

void ViewLpips::measure(ComparedRun& run) {
    if (lpips_ == nullptr) return;
    for (ComparedAt& at : run.at) {
        double sum = 0;
        std::size_t measured = 0;
        for (ComparedView& view : at.views) {
            if (!std::filesystem::exists(view.picture)) continue;
            const HeldOutPicture p = read_held_out(view.picture);
            if (std::min(p.photo.width, p.photo.height) < lpips_->least_size()) continue;
            view.lpips = distance(view, p);
            sum += *view.lpips;
            ++measured;
        }
        if (measured > 0 && measured == at.views.size())
            at.lpips = sum / static_cast<double>(measured);
    }
}

void count_exception(const std::exception& e, ComparedRun& run) {
    const bool user = dynamic_cast<const Error*>(&e) != nullptr ||
                      dynamic_cast<const std::filesystem::filesystem_error*>(&e) != nullptr;
    if (run.exit_code != 1) run.exit_code = user ? 2 : 1;
}

void attempt(ComparedRun& run, const std::string& what, const std::function<void()>& measurement) {
    try {
        measurement();
    } catch (const std::exception& e) {
        run.notes += "Without " + what + ": " + e.what() + " ";
        count_exception(e, run);
    }
}

void measure_blending_of(ComparedRun& run, Device& device, std::vector<Camera> cameras, int views) {
    if (run.at.empty() || run.at.back().model.empty()) return;
    cameras.resize(std::min(cameras.size(), static_cast<std::size_t>(views)));
    run.blending = measure_blending(device, load_splats(run.at.back().model), cameras);
}

}  // namespace darb
