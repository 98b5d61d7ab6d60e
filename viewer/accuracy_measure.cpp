#include "viewer/accuracy_measure.h"

#include "engine/data/metrics.h"

namespace darb {

AccuracyMeasure::AccuracyMeasure(const DisplaySettings& display) : display_(display) {
    display_.mode = VIEW_COLOUR;
    display_.style = SplatStyle::splats;
    for (const int setting : kShownAccuracy) {
        const int count = static_cast<int>(accuracy_settings()[setting].choices.size());
        for (int choice = 0; choice < count; ++choice) todo_.push_back({setting, choice, 0, 0});
    }
}

void AccuracyMeasure::step(const std::function<Frame(const DisplaySettings&)>& render) {
    if (done()) return;
    DisplaySettings display = display_;
    if (next_ == 0) {
        display.accuracy = preset_accuracy(kExact);
        exact_ = to_float(render(display).picture);
    } else {
        MeasuredChoice m = todo_[next_ - 1];
        display.accuracy.choice[m.setting] = m.choice;
        const Frame frame = render(display);
        m.ms = frame.ms;
        m.psnr_db = psnr(to_float(frame.picture), exact_);
        results_.push_back(m);
    }
    ++next_;
}

}  // namespace darb
