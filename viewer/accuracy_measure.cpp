#include "viewer/accuracy_measure.h"

#include "engine/data/metrics.h"
#include "viewer/switches.h"

namespace darb {

AccuracyMeasure::AccuracyMeasure(const Camera& camera, const DisplaySettings& display,
                                 const DisplaySettings& own)
    : camera_(camera) {
    DisplaySettings now = display;
    now.mode = VIEW_COLOUR;
    now.style = SplatStyle::splats;
    DisplaySettings exact = now;
    choose(kPresetRow, kExact, exact);
    exact.footprint = own.footprint;
    exact.sh_degree = own.sh_degree;
    exact.effects = own.effects;
    exact.huge_splat_path = own.huge_splat_path;
    pictures_ = {{exact, {}}, {now, {}}};
    const auto add = [&](int row) {
        const int count = static_cast<int>(row_choices(row, own.sh_degree).size());
        for (int choice = 0; choice < count; ++choice) {
            DisplaySettings changed = now;
            choose(row, choice, changed);
            if (!(changed == now)) pictures_.push_back({changed, {}});
            Picture& picture = changed == now ? pictures_[1] : pictures_.back();
            picture.choices.push_back({row, choice, 0, 0});
        }
    };
    for (const int row : kAccuracyRows) add(row);
    for (const int row : kEffectRows) add(row);
}

void AccuracyMeasure::step(
    const std::function<Frame(const Camera&, const DisplaySettings&)>& render) {
    if (done()) return;
    const Picture& picture = pictures_[next_];
    const Frame frame = render(camera_, picture.display);
    if (next_ == 0) exact_ = to_float(frame.picture);
    const double psnr_db = psnr(to_float(frame.picture), exact_);
    for (MeasuredChoice choice : picture.choices) {
        choice.ms = frame.ms;
        choice.psnr_db = psnr_db;
        results_.push_back(choice);
    }
    ++next_;
}

}  // namespace darb
