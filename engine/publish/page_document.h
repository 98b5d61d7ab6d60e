// SPDX-License-Identifier: MIT
// Assembles the document of a web page from its parts: text, script, shaders, splats.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/publish/page_notes.h"
#include "engine/publish/page_splats.h"

namespace darb {

/// What one walks on in a page: triangles, in world units and axes.
struct PageCollider {
    std::vector<glm::dvec3> position;
    std::vector<std::array<std::uint32_t, 3>> face;  // indices of positions
    double metres_per_unit = 0;                      // 0: a unit counts as a metre
};

/// All directions around a place: a picture as engine/scene/panorama.h has it.
struct PagePanorama {
    std::vector<std::byte> jpeg;
    glm::dmat3 rotation{1.0};  // of the world into the panorama's frame
};

struct PageDocument {
    std::string title, facts;
    std::vector<View> views;  // at least one
    std::size_t start = 0;    // index into views
    glm::dvec3 up{0, -1, 0};  // world
    glm::vec3 background{0.0f};
    std::vector<std::byte> poster;  // JPEG that shows views[start]
    std::vector<PageNote> notes;
    std::optional<PageCollider> collider;
    std::optional<PagePanorama> panorama;  // from the place of views[start]
};

/// The offset in a document at which the splats begin.
constexpr std::string_view kFirstPart = "<script type=\"text/plain\" id=\"part0\">";

/// model: the scene whose splats are packed.
std::string page_document(const PageDocument& document, const SplatModel& model,
                          const PageSplats& packed);

/// A page without splats: it fetches those of streamed SOG, whose lod-meta.json lies beside it.
/// model: the scene, of which the page takes kernel, footprint, anti-aliasing and degree of
/// harmonics.
std::string streamed_page_document(const PageDocument& document, const SplatModel& model);

/// How many bytes of a document are script and shaders; and script alone, in a page that has all
/// there is.
std::size_t page_script_bytes();
std::size_t most_page_script_bytes();

// Text that is embedded in the script of an HTML page, where data must never end it.

/// JSON in ASCII without '<' or '>', fit for a <script> of any type: "</script>", "<!--", marks of
/// writing direction and line separators are escaped. Bytes that are not UTF-8 become U+FFFD.
std::string script_json(const nlohmann::json& value);

/// The source without its comment lines ("//" first), blank lines and indentation.
std::string without_comment_lines(std::string_view source);

}  // namespace darb
