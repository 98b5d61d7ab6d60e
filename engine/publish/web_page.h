// SPDX-License-Identifier: MIT
// A scene as one HTML file that draws what darb draws. It contains splats, renderer and cameras,
// and fetches nothing. docs/publish.md is its guide.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/publish/fit_pictures.h"
#include "engine/publish/page_document.h"
#include "engine/scene/splat_model.h"

namespace darb {

struct WebPageOptions {
    std::string title;
    std::vector<View> views;       // bookmarks, as pinholes; empty: eight around the scene
    std::string start;             // name or number (from 1) of the first camera; empty: 1
    std::optional<glm::dvec3> up;  // world; empty: as the views are held, else a guess
    glm::vec3 background{0.0f};
    bool exact = false;           // float32; else the coarsest precision that reaches kEnoughDb
    std::uint64_t max_bytes = 0;  // splats are merged until the file fits; 0: no limit
    PictureMeasure::Progress progress = {};  // while pictures are measured; may be empty
    std::vector<PageNote> notes = {};
    std::optional<PageCollider> collider = {};
    bool panorama = false;  // also a picture of all directions from the first camera
};

struct WebPageFacts {
    std::size_t splats = 0;        // splats in the page, without those that are never drawn
    std::size_t merged_from = 0;   // splats of the source, where some were merged; else 0
    std::size_t bytes = 0;         // size of the file
    std::size_t script_bytes = 0;  // size of script and shaders
    int level = 0;                 // see page_precision
    bool exact = false;
    PictureLoss loss;  // page against model, drawn by darb from the bookmarks
};

/// Makes the document. Renders on the device, to measure and for the picture that shows while the
/// page loads. Throws Error for a scene without visible splats, for a start that no view has, and
/// for a size that not even one splat fits into.
std::string make_web_page(Device& device, const SplatModel& model, const WebPageOptions& options,
                          WebPageFacts* facts = nullptr);

/// Makes the page of a scene in streamed SOG, which is to lie beside the scene's lod-meta.json.
/// stored: what a reader gets of the finest level; its kernel, footprint and origin are ignored.
/// levels: how many there are. Fills what the facts say of splats, sizes and loss. Throws Error as
/// make_web_page, and for options that a streamed page has no place for: exact and max_bytes.
std::string make_streamed_page(Device& device, const SplatModel& model, SplatModel stored,
                               std::size_t levels, const WebPageOptions& options,
                               WebPageFacts* facts = nullptr);

/// One or two lines about the page, for a terminal.
std::string web_page_text(const WebPageFacts& facts);

}  // namespace darb
