// PictureWork: what draws pictures of its own while the window lives, one a frame: the export of a
// camera path, and the measurement of settings and effects. Each may run beside the other.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "viewer/accuracy_measure.h"
#include "viewer/path_export.h"
#include "viewer/splat_picture.h"

namespace darb {

class PictureWork {
  public:
    /// Ends an earlier export. Throws as PathExport does.
    void start_export(const CameraPath& path, const ExportOptions& options);
    void start_measure(const Camera& camera, const DisplaySettings& display,
                       const DisplaySettings& own);
    void cancel();
    /// The scene that they show is gone: they end. What there is to say of it, may be "".
    std::string lose_scene(const char* why);

    bool exports() const { return export_.has_value(); }
    bool measures() const { return measure_.has_value(); }
    /// The next step draws into the picture.
    bool draws() const { return measures() || (exports() && !export_->has_frames()); }
    double export_share() const {
        return export_ ? export_->share() : -1;
    }  // below 0: there is none
    double measure_share() const { return measure_ ? measure_->share() : -1; }

    /// One picture of it; once all are there, a look whether the video is, or wait: until it is.
    /// Where that ends the export, what came out. A failed export is over. Throws Error.
    std::optional<std::string> step_export(SplatPicture& picture, bool wait = false);
    /// All that was measured until now. A failed measurement is over. Throws Error.
    std::vector<MeasuredChoice> step_measure(SplatPicture& picture);

  private:
    std::optional<PathExport> export_;
    std::optional<AccuracyMeasure> measure_;
};

/// RGB of B8G8R8A8 [height][width].
ImageU8 read_pixels(const Buffer& pixels, int width, int height);
/// RGB of the last rendered picture.
ImageU8 read_pixels(const SplatPicture& picture);

}  // namespace darb
