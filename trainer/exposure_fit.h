// Per-photo exposure on the host: an affine map of colours, fitted and applied.
#pragma once

#include <array>
#include <glm/vec3.hpp>

#include "engine/core/image.h"

namespace darb {

/// Row-major [3][4]: out_r = m[r][0] R + m[r][1] G + m[r][2] B + m[r][3].
using ColourMap = std::array<float, 12>;
constexpr ColourMap kIdentityColours = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// Least squares of apply_exposure(map, render, photo) against the photo over the background, over
/// pixels that count (all, or alpha of at least 128 where alpha is a mask); held to the identity by
/// a weight of 1e-6 a pixel, so that pictures of one colour have an answer.
ColourMap fit_exposure(const ImageF& render, const ImageU8& photo, const glm::vec3& background,
                       bool alpha_is_mask);

/// RGB, not clamped. Where alpha is no mask a pixel is mapped by the share that the photo's alpha
/// says: what is behind is the background, which no exposure changes.
ImageF apply_exposure(const ColourMap& map, const ImageF& image, const ImageU8& photo,
                      bool alpha_is_mask);

}  // namespace darb
