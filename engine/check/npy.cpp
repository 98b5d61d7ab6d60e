#include "engine/check/npy.h"

#include <bit>
#include <cstring>
#include <numeric>

#include "engine/core/check.h"
#include "engine/core/files.h"

namespace darb::check {

namespace {

static_assert(std::endian::native == std::endian::little, "the header says little-endian");

std::string header(const char* type, const std::vector<size_t>& shape) {
    std::string sides;
    for (const size_t side : shape) sides += fmt::format("{},", side);
    std::string text =
        fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", type, sides);
    constexpr size_t kMagic = 10, kAlign = 64;  // magic, version, length; then text up to \n
    text.append(kAlign - 1 - (kMagic + text.size()) % kAlign, ' ');
    text += '\n';
    const auto length = static_cast<std::uint16_t>(text.size());
    std::string head("\x93NUMPY\x01\x00", 8);
    head += static_cast<char>(length & 0xFF);
    head += static_cast<char>(length >> 8);
    return head + text;
}

template <class T>
void write(const std::filesystem::path& path, const char* type, const std::vector<size_t>& shape,
           std::span<const T> values) {
    const size_t count =
        std::accumulate(shape.begin(), shape.end(), size_t{1}, std::multiplies<>());
    DARB_CHECK(count == values.size(), "{} values in a shape of {}", values.size(), count);
    const std::string head = header(type, shape);
    std::vector<std::byte> file(head.size() + values.size_bytes());
    std::memcpy(file.data(), head.data(), head.size());
    if (!values.empty()) std::memcpy(file.data() + head.size(), values.data(), values.size_bytes());
    write_file_atomic(path, file);
}

}  // namespace

void write_npy(const std::filesystem::path& path, const std::vector<size_t>& shape,
               std::span<const float> values) {
    write(path, "<f4", shape, values);
}
void write_npy(const std::filesystem::path& path, const std::vector<size_t>& shape,
               std::span<const double> values) {
    write(path, "<f8", shape, values);
}

}  // namespace darb::check
