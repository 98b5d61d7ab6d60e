#include "viewer/accuracy_measure.h"

#include "engine/data/metrics.h"
#include "viewer/switches.h"

namespace darb {

AccuracyMeasure::AccuracyMeasure(const DisplaySettings& display, const DisplaySettings& own)
    : display_(display) {
    display_.mode = VIEW_COLOUR;
    display_.style = SplatStyle::splats;
    reference_ = display_;
    reference_.accuracy = preset_accuracy(kExact);
    for (const int row : kEffectRows) choose(row, chosen(row, own), reference_);
    const auto add = [&](int row) {
        const int count = static_cast<int>(row_choices(row, own.sh_degree).size());
        for (int choice = 0; choice < count; ++choice) todo_.push_back({row, choice, 0, 0});
    };
    for (const int row : kAccuracyRows) add(row);
    for (const int row : kEffectRows) add(row);
}

void AccuracyMeasure::step(const std::function<Frame(const DisplaySettings&)>& render) {
    if (done()) return;
    if (next_ == 0) {
        exact_ = to_float(render(reference_).picture);
    } else {
        MeasuredChoice m = todo_[next_ - 1];
        DisplaySettings display = display_;
        choose(m.row, m.choice, display);
        const Frame frame = render(display);
        m.ms = frame.ms;
        m.psnr_db = psnr(to_float(frame.picture), exact_);
        results_.push_back(m);
    }
    ++next_;
}

}  // namespace darb
