// SPDX-License-Identifier: MIT
// PanePictures: the pictures of the panes, with the photo among them, and the strips of them that a
// window shows. Moving a line between panes draws no splats.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "viewer/panes.h"
#include "viewer/splat_picture.h"

namespace darb {

/// Pictures from one camera, one for each display. photo_first: the photo, which is there, comes
/// first.
struct PaneWish {
    Camera camera;
    std::vector<DisplaySettings> displays;
    PhotoOverlay photo;
    bool photo_first = false;
    std::optional<double> moving;  // as SplatPicture::render

    bool several() const { return photo_first || displays.size() > 1; }
};

class PanePictures {
  public:
    explicit PanePictures(Device& device);

    /// Renders the wish into the panes of `picture`. Waits. Throws Error.
    void render(SplatPicture& picture, const PaneWish& wish);
    /// Does the same as a part of this frame, without waiting. Where there are several pictures,
    /// `record` belongs to the frame, too.
    void start(int frame, SplatPicture& picture, const PaneWish& wish);
    /// Copies the strips of several pictures as `panes` asks; does nothing where they are there
    /// already.
    void record(Commands& commands, const Panes& panes);
    /// Does the same and waits. copies: also calls record_copies.
    void compose(const Panes& panes, bool copies = false);
    /// Copies the pictures for psnr_db, which is valid once these commands are done.
    void record_copies(Commands& commands);
    /// Compares each picture with the first; see Panes.
    std::vector<double> psnr_db() const;

    /// How many pictures there are, with the photo.
    std::size_t count() const { return count_; }
    /// What compose made.
    const Buffer& pixels() const { return pixels_; }
    int width() const { return size_.x; }
    int height() const { return size_.y; }
    /// Times of what was rendered last, summed over the pictures.
    const std::vector<PassTime>& pass_times() const { return pass_times_; }
    /// Whether something was built for the last pictures.
    bool compiled() const { return compiled_; }

  private:
    struct Layout {
        std::vector<float> lines;
        bool difference = false;
        float difference_max = 0;
        bool operator==(const Layout&) const = default;
    };
    void prepare(const SplatPicture& picture, const PaneWish& wish);
    void record_photo(Commands& commands);
    const Buffer& image(std::size_t n) const;

    Device* device_;
    Commands commands_;
    Pipeline strips_, photo_frame_;
    const SplatPicture* picture_ = nullptr;
    std::size_t count_ = 0;
    bool photo_first_ = false;
    std::optional<PhotoOverlay> photo_;  // the photo that is to be drawn
    DisplaySettings photo_display_;
    Buffer photo_pixels_, pixels_;  // B8G8R8A8 [height][width]
    std::vector<Buffer> copies_;    // the pictures' copies for the host
    glm::ivec2 size_{0};            // px
    std::optional<Layout> composed_;
    std::vector<PassTime> pass_times_;
    bool compiled_ = false;
};

/// The displays of the panes, one for each kernel; the first is the display as it is.
std::vector<DisplaySettings> pane_displays(const DisplaySettings& display,
                                           const std::vector<int>& kernels_beside);
/// Adds the times of passes to the sums under the same names.
void add_times(const std::vector<PassTime>& more, std::vector<PassTime>& sum);

}  // namespace darb
