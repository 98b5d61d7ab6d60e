// PanePictures: the pictures of panes on the device, whole ones, and the strips of them that a
// window shows. Moving a line draws no splats.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "viewer/panes.h"
#include "viewer/splat_picture.h"

namespace darb {

class PanePictures {
  public:
    explicit PanePictures(Device& device);

    /// A picture for each display; photo_first: before them the photo, which is there. Waits.
    void render(SplatPicture& picture, const Camera& camera,
                const std::vector<DisplaySettings>& displays, const PhotoOverlay& photo,
                bool photo_first, std::optional<double> moving);
    /// The same where there are several pictures; else the one, into `picture`. Whether there are.
    bool render_all(SplatPicture& picture, const Camera& camera,
                    const std::vector<DisplaySettings>& displays, const PhotoOverlay& photo,
                    bool photo_first, std::optional<double> moving);
    /// The strips, as they are asked for; nothing where they are so already.
    void compose(const Panes& panes);
    /// Each against the first; see Panes.
    std::vector<double> psnr_db() const;

    std::size_t count() const { return pictures_.size(); }
    /// What compose made.
    const Buffer& pixels() const { return pixels_; }
    int width() const { return size_.x; }
    int height() const { return size_.y; }
    /// Of the last render, summed over the pictures.
    const std::vector<PassTime>& pass_times() const { return pass_times_; }
    bool compiled() const { return compiled_; }

  private:
    void draw_photo(const PhotoOverlay& photo, const DisplaySettings& display);
    struct Layout {
        std::vector<float> lines;
        bool difference = false;
        float difference_max = 0;
        bool operator==(const Layout&) const = default;
    };

    Device* device_;
    Commands commands_;
    std::optional<Pipeline> strips_, photo_frame_;
    std::vector<Buffer> pictures_;  // B8G8R8A8 [height][width]
    Buffer pixels_;
    glm::ivec2 size_{0};  // px
    std::optional<Layout> composed_;
    std::vector<PassTime> pass_times_;
    bool compiled_ = false;
};

/// What the pictures of the kernels show: the first the display as it is.
std::vector<DisplaySettings> pane_displays(const DisplaySettings& display,
                                           const std::vector<int>& kernels_beside);
/// Adds the times of passes to those of the same name.
void add_times(const std::vector<PassTime>& more, std::vector<PassTime>& sum);

}  // namespace darb
