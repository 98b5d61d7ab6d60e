// Constants of shaders/densify/shape_rows.glsl: which rows the tables over a kernel's shapes have.
#pragma once

#include "engine/gpu/pipeline.h"
#include "engine/kernels/shaped_kernel.h"
#include "shaders/shared/kernel_forms.h"

namespace darb {

inline SpecConstants shape_row_constants(int kernel) {
    if (!kernel_has_shape(kernel)) return {{"SHAPES", 1}};
    const ShapedKernel& shaped = shaped_kernel(kernel);
    return {{"SHAPES", SHAPE_ROWS},
            {"SHAPE_FIRST", static_cast<float>(shaped.first_shape())},
            {"SHAPE_LAST", static_cast<float>(shaped.last_shape())}};
}

}  // namespace darb
