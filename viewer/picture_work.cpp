#include "viewer/picture_work.h"

#include <fmt/format.h>

#include <algorithm>

namespace darb {

namespace {

// The first may compile; the lesser of the two others counts.
constexpr int kTimings = 3;

AccuracyMeasure::Frame timed_picture(SplatPicture& picture, const Camera& camera,
                                     const DisplaySettings& display) {
    double ms = 0;
    for (int i = 0; i < kTimings; ++i) {
        picture.render(camera, display, {});
        double sum = 0;
        for (const PassTime& pass : picture.pass_times())
            if (pass.name != "display") sum += pass.ms;
        if (i > 0) ms = i == 1 ? sum : std::min(ms, sum);
    }
    return {read_pixels(picture), ms};
}

}  // namespace

ImageU8 read_pixels(const Buffer& buffer, int width, int height) {
    ImageU8 image(width, height, 3);
    const size_t pixels = size_t(width) * size_t(height);
    const std::vector<std::uint32_t> bgra = buffer.download<std::uint32_t>(pixels);
    for (size_t p = 0; p < pixels; ++p)
        for (size_t c = 0; c < 3; ++c)
            image.data[3 * p + c] = static_cast<std::uint8_t>(bgra[p] >> (16 - 8 * c));
    return image;
}

ImageU8 read_pixels(const SplatPicture& picture) {
    return read_pixels(picture.pixels(), picture.width(), picture.height());
}

void PictureWork::start_export(const CameraPath& path, const ExportOptions& options) {
    export_.reset();  // it may be writing the same video
    export_.emplace(path, options);
}

void PictureWork::start_measure(const Camera& camera, const DisplaySettings& display,
                                const DisplaySettings& own) {
    measure_.emplace(camera, display, own);
}

void PictureWork::cancel() {
    export_.reset();
    measure_.reset();
}

std::string PictureWork::lose_scene(const char* why) {
    measure_.reset();
    if (!export_ || export_->has_frames()) return "";
    const std::string note = fmt::format("the export ended after {} of {} frames: {}",
                                         export_->written(), export_->frame_count(), why);
    export_.reset();
    return note;
}

std::optional<std::string> PictureWork::step_export(SplatPicture& picture, bool wait) {
    try {
        export_->step(
            [&](const Camera& camera, const DisplaySettings& display) {
                picture.render(camera, display, {});
                return read_pixels(picture);
            },
            wait);
    } catch (...) {
        export_.reset();
        throw;
    }
    if (!export_->done()) return {};
    const std::string summary = export_->summary();
    export_.reset();
    return summary;
}

std::vector<MeasuredChoice> PictureWork::step_measure(SplatPicture& picture) {
    try {
        measure_->step([&](const Camera& camera, const DisplaySettings& display) {
            return timed_picture(picture, camera, display);
        });
    } catch (...) {
        measure_.reset();
        throw;
    }
    std::vector<MeasuredChoice> results = measure_->results();
    if (measure_->done()) measure_.reset();
    return results;
}

}  // namespace darb
