// SPDX-License-Identifier: MIT
// Cameras of a data set, the one that is looked through, and its photo beside the picture.
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
    int current = -1;                              // -1: free camera
    double shown_fov_y = 0, shown_centre_x = 0.5;  // of the window, while one is looked through
    bool compare = false;                          // the photo is the first of the panes (panes.h)
    Buffer buffer;                                 // uint [height][width]
    int width = 0, height = 0;
    int loaded = -1;      // the view that buffer holds
    bool failed = false;  // this view's photo could not be read

    const View& view() const { return views[static_cast<size_t>(current)]; }
};

/// A window, px, and how much of it the panels take from the left.
struct WindowArea {
    int width = 0, height = 0, left = 0;
};
/// The photo's camera fitted into what is free of the window; where none is looked through, the
/// free camera.
Camera camera_in_window(const Photos& photos, const Navigation& free, const WindowArea& area);
/// Where the photo lies in a picture by `camera`, which may have fewer px than the window.
PhotoOverlay overlay_of(const Photos& photos, const Camera& camera, const WindowArea& area);
/// Whether the photo is shown beside the picture: it is wanted, there, and no error map is.
bool photo_beside(const Photos& photos, const DisplaySettings& display);
/// Where the lines between panes are put at first: over the photo where it is one of them, as
/// beside it there is nothing to compare with; else right of the panels.
Strip compared_strip(const Photos& photos, const DisplaySettings& display, const WindowArea& area);
/// The photo of the camera that is looked through. Throws Error where it has none.
void load_photo_of_view(Device& device, Photos& photos);

}  // namespace darb
