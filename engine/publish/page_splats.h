// The splats of a web page: columns of integers, or of float32, that the page's script
// (page/1_decode.js) turns back into values. Source of the order: engine/scene/chunk_order.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/scene/splat_model.h"

namespace darb {

/// Steps that values are rounded to.
struct PagePrecision {
    bool exact = false;              // float32 as it is, in the order of the model; no step counts
    double position = 0;             // of a typical splat's second largest standard deviation
    double log_scale = 0;            // natural logarithm
    double rotation = 0;             // of a component of the unit quaternion
    double opacity = 0, colour = 0;  // both 0 to 1
    double harmonics = 0;            // of a coefficient above the first
};

/// 0 is the coarsest; each level has half the steps of the one before; kPageLevels and above are
/// exact.
constexpr int kPageLevels = 4;
PagePrecision page_precision(int level, int kernel);

/// value = low + step * integer, or the bits of a float32. A column is `bytes` planes of N bytes,
/// low bytes first.
struct PageColumn {
    int attribute =
        0;  // kPosition, ...; of kOpacityLogit the opacity itself, unless exact the logit
    int component = 0;  // rotation, unless exact: 0 to 2 of SmallestThree::others, 3 its largest
    int bytes = 1;
    double low = 0, step = 1;
    bool difference = false;  // integers are zigzag differences from the splat before
    bool exact = false;
};

struct PageSplats {
    std::size_t count = 0;  // N
    int sh_degree = 0;
    std::vector<PageColumn> columns;
    std::vector<std::byte> planes;  // of all columns, in order
};

/// Without splats that are never drawn: those with NaN, without a rotation, and of an opacity below
/// the cut-off.
PageSplats pack_page_splats(const SplatModel& model, const PagePrecision& precision);
/// What the page draws. like: kernel, footprint and all else that is not per splat.
SplatModel unpack_page_splats(const PageSplats& packed, const SplatModel& like);

}  // namespace darb
