// Shaders of the web page: GLSL ES 3.00 made from the page's own files and, through their includes,
// from the very functions of shaders/.
#pragma once

#include <string>
#include <string_view>

#include "engine/gpu/pipeline.h"

namespace darb {

/// name: of a file in engine/publish/page, "project.frag". Specialization constants of the source
/// become constants: of the values given, else as declared.
std::string page_shader(std::string_view name, const SpecConstants& constants);

}  // namespace darb
