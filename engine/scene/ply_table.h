// SPDX-License-Identifier: MIT
// The PLY container: its header, and the rows of one element as doubles. ascii and binary of both
// byte orders. Splat files (ply.h) and point clouds (engine/data/point_cloud_ply.h) are read with
// it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace darb {

enum class PlyFormat { ascii, little_endian, big_endian };
enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct PlyProperty {
    std::string name;
    PlyType type = PlyType::float32;
    bool is_list = false;
    PlyType count_type = PlyType::uint8;  // lists only: the type of their length
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties;
    /// Column of the property; -1 where there is none with that name.
    int find(std::string_view property) const;
};

struct PlyHeader {
    PlyFormat format = PlyFormat::little_endian;
    std::vector<std::string> comments;  // without the word "comment"
    std::vector<PlyElement> elements;
    std::size_t data_begin = 0;  // first byte after the line end_header
    const PlyElement* find(std::string_view element) const;
};

/// Whether the bytes begin like a PLY: the first line is "ply", possibly with blanks around it and
/// a UTF-8 byte order mark.
bool looks_like_ply(std::span<const std::byte> file);
/// Throws Error(where, ...) where the header is malformed.
PlyHeader parse_ply_header(std::span<const std::byte> file, const std::string& where);

/// Throws Error where the file is too short for the counts that its header declares, up to and
/// including `element`. Call it before allocating.
void check_ply_size(std::span<const std::byte> file, const PlyHeader& header,
                    const PlyElement& element, const std::string& where);

/// Calls row(i, values) for each row i of the element; values[c] is column c (0 for lists). Skips
/// the elements before it. Returns where the rows end. Throws Error naming the row where the file
/// ends or has something else than a number. progress: called now and then with the share of rows
/// read; it may throw to stop. list: called before row(i) with each list of the row; lists are
/// skipped where it is empty.
using PlyRow = std::function<void(std::size_t row, const double* values)>;
using PlyList =
    std::function<void(std::size_t row, std::size_t column, std::span<const double> values)>;
using ReadProgress = std::function<void(double share)>;
std::size_t read_ply_rows(std::span<const std::byte> file, const PlyHeader& header,
                          const PlyElement& element, const std::string& where, const PlyRow& row,
                          const ReadProgress& progress = {}, const PlyList& list = {});

/// A sentence on bytes after the last row of the last element, which ends at `end`. Empty where
/// there are none, or where `element` is not the last. Spaces and line ends do not count in ascii
/// files.
std::string ply_bytes_behind(std::span<const std::byte> file, const PlyHeader& header,
                             const PlyElement& element, std::size_t end);

}  // namespace darb
