// A scene as one HTML file that draws what darb draws: splats, renderer and cameras within, nothing
// fetched. docs/publish.md is its guide.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/publish/fit_pictures.h"
#include "engine/scene/splat_model.h"

namespace darb {

struct WebPageOptions {
    std::string title;
    std::vector<View> views;       // bookmarks, as pinholes; none: eight around the scene
    std::string start;             // name or number, from 1, of the first camera; empty: 1
    std::optional<glm::dvec3> up;  // world; nothing: as the views are held, else a guess
    glm::vec3 background{0.0f};
    bool exact = false;           // float32; else the coarsest precision that comes to kEnoughDb
    std::uint64_t max_bytes = 0;  // of the file; splats are merged to fit. 0: as it comes
    PictureMeasure::Progress progress = {};  // of the pictures that decide; may be empty
};

struct WebPageFacts {
    std::size_t splats = 0;        // in the page; those that are never drawn are left out
    std::size_t merged_from = 0;   // splats of the source where some were merged, else 0
    std::size_t bytes = 0;         // of the file
    std::size_t script_bytes = 0;  // of script and shaders
    int level = 0;                 // of page_precision
    bool exact = false;
    PictureLoss loss;  // the page's splats against the model's, drawn by darb from bookmarks
};

/// The document. Renders on the device to measure and for the picture that shows while it loads.
/// Throws Error for a scene without splats that are drawn, for a start that no view has, and for a
/// size that not even one splat fits into.
std::string make_web_page(Device& device, const SplatModel& model, const WebPageOptions& options,
                          WebPageFacts* facts = nullptr);

/// A line or two about them, for a terminal.
std::string web_page_text(const WebPageFacts& facts);

}  // namespace darb
