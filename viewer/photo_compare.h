// SPDX-License-Identifier: MIT
// The cameras of a data set, the one that is looked through, and its photo beside the picture.
#pragma once

#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/buffer.h"
#include "viewer/display.h"
#include "viewer/navigation.h"
#include "viewer/panes.h"

namespace darb {

struct PhotoOverlay;

struct Photos {
    std::vector<View> views;
    int current = -1;        // -1: free camera
    double shown_fov_y = 0;  // the window's, while a camera is looked through
    double shown_centre_x = 0.5, shown_centre_y = 0.5;  // likewise
    bool compare = false;  // the photo is the first of the panes (panes.h)
    Buffer buffer;         // uint [height][width]
    int width = 0, height = 0;
    int loaded = -1;      // the view that buffer holds
    bool failed = false;  // this view's photo could not be read

    const View& view() const { return views[static_cast<size_t>(current)]; }
};

/// The size of a window, px, and how much of its sides the panels cover.
struct WindowArea {
    int width = 0, height = 0, left = 0, right = 0, top = 0;

    int free_width() const { return width - left - right; }
    int free_height() const { return height - top; }
    bool operator==(const WindowArea&) const = default;
};
/// The photo's camera fitted into the free part of the window, or the free camera where no photo's
/// camera is looked through.
Camera camera_in_window(const Photos& photos, const Navigation& free, const WindowArea& area);
/// Where the photo lies in a picture by `camera`, which may have fewer pixels than the window.
PhotoOverlay overlay_of(const Photos& photos, const Camera& camera, const WindowArea& area);
/// Whether the photo is shown beside the picture: it is wanted and available, and no error map is
/// shown.
bool photo_beside(const Photos& photos, const DisplaySettings& display);
/// Where the lines between panes are put at first. Where the photo is one of the panes they lie
/// over it, because beside it there is nothing to compare with. Otherwise they lie beside the
/// panels.
Strip compared_strip(const Photos& photos, const DisplaySettings& display, const WindowArea& area);
/// Loads the photo of the camera that is looked through. Throws Error where it has none.
void load_photo_of_view(Device& device, Photos& photos);

}  // namespace darb
