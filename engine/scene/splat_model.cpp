// SPDX-License-Identifier: MIT
#include "engine/scene/splat_model.h"

namespace darb {

std::string ply_column(int attribute, std::size_t column) {
    const SplatAttribute& row = kSplatAttributes[static_cast<std::size_t>(attribute)];
    if (attribute == kPosition) return std::string(1, row.file_name[column]);
    if (row.floats == 1 && !row.per_coefficient) return row.file_name;
    return std::string(row.file_name) + "_" + std::to_string(column);
}

}  // namespace darb
