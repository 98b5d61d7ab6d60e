// The document of a web page from its parts: text, script, shaders, splats.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/publish/page_splats.h"

namespace darb {

struct PageDocument {
    std::string title, facts;
    std::vector<View> views;  // at least one
    std::size_t start = 0;    // of views
    glm::dvec3 up{0, -1, 0};  // world
    glm::vec3 background{0.0f};
    std::vector<std::byte> poster;  // JPEG of views[start]
};

/// Where the splats begin in a document.
constexpr std::string_view kFirstPart = "<script type=\"text/plain\" id=\"part0\">";

/// model: of which the splats are packed.
std::string page_document(const PageDocument& document, const SplatModel& model,
                          const PageSplats& packed);

/// Bytes of a document that are script and shaders.
std::size_t page_script_bytes();

}  // namespace darb
