// SPDX-License-Identifier: MIT
// Points of a laser scan as LAS 1.0 to 1.4, uncompressed. Source: ASPRS, "LAS Specification 1.4
// R15".
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "engine/data/dataset.h"

namespace darb {

/// Whether the bytes begin as LAS and LAZ do.
bool looks_like_las(std::span<const std::byte> file);

/// Positions in the file's units, and colours where its point format has them, else mid grey.
/// Points that the file marks as withheld are left out and counted in `dropped`, as are those with
/// NaN or infinity. notes: where not null, receives a sentence where there are no colours, or where
/// they have 8 bits in place of 16. Throws Error naming file, place, reason and remedy; for LAZ,
/// the compressed form, it says how to expand it.
PointCloud parse_las(std::span<const std::byte> file, const std::string& where,
                     std::size_t& dropped, std::vector<std::string>* notes = nullptr);

}  // namespace darb
