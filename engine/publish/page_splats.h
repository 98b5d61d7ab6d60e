// SPDX-License-Identifier: MIT
// The splats of a web page: columns of integers or of float32, which the page's script
// (page/1_decode.js) turns back into values. For the order, see engine/scene/quantise.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/scene/splat_model.h"

namespace darb {

/// Step sizes to which values are rounded.
struct PagePrecision {
    bool exact = false;              // float32 unchanged, in the order of the model; steps are
                                     // ignored
    double position = 0;             // as a share of a typical splat's second largest standard
                                     // deviation
    double log_scale = 0;            // natural logarithm
    double rotation = 0;             // for each component of the unit quaternion
    double opacity = 0, colour = 0;  // both 0 to 1
    double harmonics = 0;            // for coefficients above the first
    double shape = 0;                // what a splat learns of its own, see shaped_kernel.h
};

/// Level 0 is the coarsest; each level halves the steps of the one before; kPageLevels and above
/// are exact.
constexpr int kPageLevels = 4;
PagePrecision page_precision(int level, int kernel);

/// value = low + step * integer, or the bits of a float32. A column is stored as `bytes` planes of
/// N bytes each, low bytes first.
struct PageColumn {
    int attribute =
        0;  // kPosition, ...; of kOpacityLogit the opacity itself, unless exact the logit
    int component = 0;  // rotation, unless exact: 0 to 2 of SmallestThree::others, 3 its largest
    int bytes = 1;
    double low = 0, step = 1;
    bool difference = false;  // integers are zigzag-coded differences from the splat before
    bool exact = false;
    // Where the page's shaders have it: of the words of a splat, and of the bits of that word. The
    // first three words are the position in float32; harmonics in float32 become halves.
    int bits = 32, word = 0, shift = 0;
};

struct PageSplats {
    std::size_t count = 0;  // N
    int sh_degree = 0;
    std::vector<PageColumn> columns;
    std::vector<std::byte> planes;  // all columns, in order
    int words = 3;                  // of 32 bits, of a splat in the page's memory
};

/// Leaves out splats that are never drawn: those with NaN, without a rotation, or with an opacity
/// below the cut-off.
PageSplats pack_page_splats(const SplatModel& model, const PagePrecision& precision);
/// The model as the page draws it. like: gives kernel, footprint and everything else that is not
/// per splat.
SplatModel unpack_page_splats(const PageSplats& packed, const SplatModel& like);

}  // namespace darb
