// SPDX-License-Identifier: MIT
// GLSL type names for C++, so that the structs of shaders/shared read the same in both languages.
// Layout is scalar: vec3 is 12 bytes and nothing is padded. Under GLSL this file is empty. A file
// with structs begins with #include "types.h", and each struct is followed, in C++ only, by a
// static_assert on its size.
#ifndef DARB_SHARED_TYPES_H
#define DARB_SHARED_TYPES_H

#ifdef __cplusplus

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace darb::gpu {

using uint = std::uint32_t;
using vec2 = glm::vec2;
using vec3 = glm::vec3;
using vec4 = glm::vec4;
using ivec2 = glm::ivec2;
using uvec2 = glm::uvec2;
using uvec3 = glm::uvec3;
using uvec4 = glm::uvec4;
using mat3 = glm::mat3;
using mat4 = glm::mat4;

static_assert(sizeof(vec3) == 12 && alignof(vec3) == 4, "scalar layout");
static_assert(sizeof(vec4) == 16 && alignof(vec4) == 4, "scalar layout");
static_assert(sizeof(mat3) == 36 && alignof(mat3) == 4, "scalar layout");

}  // namespace darb::gpu

#endif

#endif
