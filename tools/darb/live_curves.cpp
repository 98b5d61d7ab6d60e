#include "tools/darb/live_curves.h"

#include <algorithm>

namespace darb {

namespace {

constexpr size_t kLongestCurve = 1000;
constexpr float kSmoothing = 0.05f;  // of loss and PSNR, which jump from photo to photo

void thin(std::vector<float>& values) {
    for (size_t i = 0; 2 * i < values.size(); ++i) values[i] = values[2 * i];
    values.resize((values.size() + 1) / 2);
}

}  // namespace

Bounds bounds_of(const Dataset& dataset) {
    SplatModel points;
    const std::vector<double>& p = dataset.points.position;
    points.resize(p.size() / 3);
    std::transform(p.begin(), p.end(), points.position.begin(),
                   [](double v) { return static_cast<float>(v); });
    if (points.size() > 0) return scene_bounds(points);
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
