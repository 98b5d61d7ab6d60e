#include "tools/darb/live_curves.h"

#include <algorithm>

#include "engine/data/camera_list.h"
#include "engine/data/point_cloud_ply.h"

namespace darb {

namespace {

constexpr size_t kLongestCurve = 1000;
constexpr std::size_t kPointsLookedAt = 20'000;
constexpr float kSmoothing = 0.05f;  // of loss and PSNR, which jump from photo to photo

void thin(std::vector<float>& values) {
    for (size_t i = 0; 2 * i < values.size(); ++i) values[i] = values[2 * i];
    values.resize((values.size() + 1) / 2);
}

}  // namespace

Bounds bounds_of(const Dataset& dataset) {
    const std::size_t step = dataset.points.size() / kPointsLookedAt + 1;
    PointCloud few;
    for (std::size_t i = 0; i < dataset.points.size(); i += step)
        for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) {
            few.position.push_back(dataset.points.position[c]);
            few.colour.push_back(dataset.points.colour[c]);
        }
    if (few.size() > 0) return subject_of(points_as_splats(few), cameras_of(dataset.views));
    Bounds bounds;
    for (const View& view : dataset.views)
        bounds.centre += view.camera.centre() / double(dataset.views.size());
    bounds.radius = std::max(scene_extent(dataset), 1e-3);
    return bounds;
}

void LiveCurves::add(const LiveStep& step, TrainingCurves& t) {
    t.iteration = step.iteration;
    t.last_iteration = step.last_iteration;
    const IterationResult& r = step.result;
    if (r.iteration == 0) return;
    const float share = t.loss.empty() ? 1 : kSmoothing;
    loss += share * (static_cast<float>(r.loss) - loss);
    psnr_db += share * (static_cast<float>(r.psnr_db) - psnr_db);
    if (r.iteration % stride != 0 && !t.loss.empty()) return;
    t.loss.push_back(loss);
    t.psnr_db.push_back(psnr_db);
    t.splats.push_back(static_cast<float>(r.splats));
    if (t.loss.size() > kLongestCurve) {
        for (std::vector<float>* curve : {&t.loss, &t.psnr_db, &t.splats}) thin(*curve);
        stride *= 2;
    }
    for (size_t e = t.held_out_psnr_db.size(); e < step.evaluations.size(); ++e)
        t.held_out_psnr_db.push_back(static_cast<float>(step.evaluations[e].psnr_db));
}

}  // namespace darb
