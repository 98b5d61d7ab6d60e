// Measured depths as files: 16-bit grey PNG, and .npy of float or integer.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/byte_reader.h"
#include "engine/data/depth_io.h"
#include "engine/data/photo_decoder.h"

namespace darb {

namespace {

constexpr const char* kFormats =
    "Depths are 16-bit grey PNG, or .npy of float32, float64, uint16 or int32, [height][width].";

float measured(double value, double unit) {
    const double depth = value * unit;
    return std::isfinite(depth) && depth > 0 ? static_cast<float>(depth) : 0.0f;
}

/// The text behind 'KEY': of the header's dictionary, up to where `end` is.
std::string entry_of(const std::string& header, const std::string& key, char end,
                     const std::string& where) {
    const std::size_t at = header.find("'" + key + "':");
    const std::size_t begin = at == std::string::npos ? at : at + key.size() + 3;
    const std::size_t stop = begin == std::string::npos ? begin : header.find(end, begin + 2);
    if (stop == std::string::npos)
        throw Error(where, fmt::format("its header names no '{}'", key), kFormats);
    std::string text = header.substr(begin, stop - begin);
    std::erase_if(text, [](char c) { return c == ' ' || c == '\''; });
    return text;
}

struct NpyHead {
    std::string type;
    std::size_t height = 0, width = 0;
};

/// [height][width], a last dimension of 1 beside.
NpyHead npy_head(ByteReader& reader, const std::string& where) {
    std::array<char, 6> magic{};
    for (char& c : magic) c = reader.read<char>();
    if (std::string_view(magic.data(), 6) != "\x93NUMPY")
        throw Error(where, "is no .npy file", kFormats);
    const auto version = reader.read<std::uint8_t>();
    reader.skip(1);
    const std::size_t length =
        version == 1 ? reader.read<std::uint16_t>() : reader.read<std::uint32_t>();
    if (length > reader.left()) throw Error(where, "ends within its header", kFormats);
    std::string header(length, '\0');
    for (char& c : header) c = reader.read<char>();
    if (entry_of(header, "fortran_order", ',', where) != "False")
        throw Error(where, "is in Fortran's order", "Save numpy.ascontiguousarray of it.");
    NpyHead head{.type = entry_of(header, "descr", ',', where)};
    std::vector<std::size_t> shape;
    std::string sizes = entry_of(header, "shape", ')', where);
    for (char& c : sizes) c = c >= '0' && c <= '9' ? c : ' ';
    std::istringstream numbers(sizes);
    for (std::size_t size; numbers >> size;) shape.push_back(size);
    if (shape.size() == 3 && shape[2] == 1) shape.pop_back();
    if (shape.size() == 3 && shape[0] == 1) shape.erase(shape.begin());
    if (shape.size() != 2 || shape[0] < 1 || shape[1] < 1)
        throw Error(where, "is no array of two dimensions", kFormats);
    head.height = shape[0];
    head.width = shape[1];
    return head;
}

template <class T>
ImageF npy_values(ByteReader& reader, const NpyHead& head, double unit, const std::string& where) {
    check_photo_claim(static_cast<std::int64_t>(head.width), static_cast<std::int64_t>(head.height),
                      std::uint64_t{head.width} * head.height * sizeof(T), reader.left(), where);
    ImageF depth(static_cast<int>(head.width), static_cast<int>(head.height), 1);
    for (float& d : depth.data) d = measured(static_cast<double>(reader.read<T>()), unit);
    return depth;
}

ImageF read_npy(std::span<const std::byte> file, double unit, const std::string& where) {
    ByteReader reader(file, where);
    const NpyHead head = npy_head(reader, where);
    const double metres = unit > 0 ? unit : 1, millimetres = unit > 0 ? unit : kMillimetre;
    if (head.type == "<f4") return npy_values<float>(reader, head, metres, where);
    if (head.type == "<f8") return npy_values<double>(reader, head, metres, where);
    if (head.type == "<u2") return npy_values<std::uint16_t>(reader, head, millimetres, where);
    if (head.type == "<i4") return npy_values<std::int32_t>(reader, head, millimetres, where);
    throw Error(where, fmt::format("holds values of the type {}", head.type), kFormats);
}

ImageF read_png(std::span<const std::byte> file, double unit, const std::string& where) {
    const GreyU16 grey = decode_png16(file, where, kFormats);
    ImageF depth(grey.width, grey.height, 1);
    for (std::size_t p = 0; p < depth.data.size(); ++p)
        depth.data[p] = measured(grey.data[p], unit > 0 ? unit : kMillimetre);
    return depth;
}

}  // namespace

ImageF read_depth(const std::filesystem::path& path, double unit) {
    const std::string where = path.string();
    const std::vector<std::byte> file = read_file(path);
    const bool npy = has_extension(path, ".npy");
    if (!npy && !is_png(file)) throw Error(where, "is neither PNG nor .npy", kFormats);
    ImageF depth = npy ? read_npy(file, unit, where) : read_png(file, unit, where);
    if (std::none_of(depth.data.begin(), depth.data.end(), [](float d) { return d > 0; }))
        throw Error(where, "holds no measured depth: every value is 0 or no number",
                    "Remove the file where nothing was measured.");
    return depth;
}

}  // namespace darb
