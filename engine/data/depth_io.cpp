// SPDX-License-Identifier: MIT
#include "engine/data/depth_io.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/byte_reader.h"
#include "engine/data/image_io.h"

namespace darb {

namespace {

void put_u32(std::string& to, std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) to += static_cast<char>(value >> shift & 0xff);
}

void put_chunk(std::string& to, const char* type, const std::string& data) {
    put_u32(to, static_cast<std::uint32_t>(data.size()));
    const std::string body = type + data;
    to += body;
    put_u32(to, static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(body.data()),
                                                 static_cast<uInt>(body.size()))));
}

float first_channel(const ImageF& image, std::size_t pixel) {
    return image.data[pixel * static_cast<std::size_t>(image.channels)];
}

}  // namespace

DepthRange write_depth_png(const std::filesystem::path& path, const ImageF& depth, double unit) {
    if (!(unit > 0) || depth.channels < 1)
        throw Error(
            path.string(),
            fmt::format("cannot write depths of {} channels in units of {}", depth.channels, unit),
            "Use a unit above 0 and at least one channel.");
    DepthRange range;
    std::string rows;
    for (int y = 0; y < depth.height; ++y) {
        rows += '\0';  // no filter
        for (int x = 0; x < depth.width; ++x) {
            const double value =
                first_channel(depth, static_cast<std::size_t>(y) * depth.width + x);
            const double steps = value / unit + 0.5;
            const auto grey =
                static_cast<std::uint32_t>(std::clamp(steps, 0.0, double{kDepthSteps}));
            range.clipped += steps >= kDepthSteps + 1 ? 1 : 0;
            range.farthest = std::max(range.farthest, value);
            rows += static_cast<char>(grey >> 8);
            rows += static_cast<char>(grey & 0xff);
        }
    }
    uLongf bytes = compressBound(static_cast<uLong>(rows.size()));
    std::string packed(bytes, '\0');
    const int result =
        compress(reinterpret_cast<Bytef*>(packed.data()), &bytes,
                 reinterpret_cast<const Bytef*>(rows.data()), static_cast<uLong>(rows.size()));
    DARB_CHECK(result == Z_OK, "zlib {}", result);
    packed.resize(bytes);

    std::string header, file = "\x89PNG\r\n\x1a\n";
    put_u32(header, static_cast<std::uint32_t>(depth.width));
    put_u32(header, static_cast<std::uint32_t>(depth.height));
    header += std::string("\x10\0\0\0\0", 5);  // 16 bits, grey, standard methods
    put_chunk(file, "IHDR", header);
    put_chunk(file, "tEXt",
              std::string("DepthUnit") + '\0' + fmt::format("{} world units a step", unit));
    put_chunk(file, "IDAT", packed);
    put_chunk(file, "IEND", "");
    write_file_atomic(path, file);
    return range;
}

// Reading measured depths: 16-bit grey PNG, and .npy or TIFF with floats or integers. TIFF is read
// as TIFF 6.0 and the supplements for its compressions and float predictor define it, including
// BigTIFF.

namespace {

constexpr const char* kFormats =
    "Depths are 16-bit grey PNG, or TIFF or .npy of one channel: float32, float64, uint16 or "
    "int32.";

/// Metres a step.
struct Units {
    double of_floats = 1, of_integers = kMillimetre;
};

float measured(double value, double unit) {
    const double depth = value * unit;
    return std::isfinite(depth) && depth > 0 ? static_cast<float>(depth) : 0.0f;
}

/// The text after 'KEY': in the header's dictionary, up to where `end` stands.
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

/// Accepts [height][width], and a last dimension of 1.
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
        throw Error(where, "is in Fortran order", "Save numpy.ascontiguousarray of it.");
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

ImageF read_npy(std::span<const std::byte> file, const Units& units, const std::string& where) {
    ByteReader reader(file, where);
    const NpyHead head = npy_head(reader, where);
    const double metres = units.of_floats, millimetres = units.of_integers;
    if (head.type == "<f4") return npy_values<float>(reader, head, metres, where);
    if (head.type == "<f8") return npy_values<double>(reader, head, metres, where);
    if (head.type == "<u2") return npy_values<std::uint16_t>(reader, head, millimetres, where);
    if (head.type == "<i4") return npy_values<std::int32_t>(reader, head, millimetres, where);
    throw Error(where, fmt::format("holds values of the type {}", head.type), kFormats);
}

/// The fields of a TIFF's first directory, with access to the bytes of the file.
class TiffFile {
  public:
    TiffFile(std::span<const std::byte> bytes, const std::string& where)
        : bytes_(bytes), where_(where), little_(bytes[0] == std::byte{'I'}) {
        const bool big = number(2, 2) == 43;
        const std::uint64_t at = big ? number(8, 8) : number(4, 4);
        const std::uint64_t count = number(at, big ? 8 : 2);
        const std::uint64_t first = at + (big ? 8 : 2), size = big ? 20 : 12, value = big ? 8 : 4;
        if (count > bytes_.size() / size) refuse("is cut off or damaged");
        for (std::uint64_t i = 0; i < count; ++i) {
            const std::uint64_t entry = first + i * size;
            const std::uint64_t type = number(entry + 2, 2), many = number(entry + 4, value);
            const std::uint64_t width = type == 1 ? 1 : type == 3 ? 2 : type == 4 ? 4 : 8;
            if (type != 1 && type != 3 && type != 4 && type != 16) continue;  // not plain numbers
            if (many > bytes_.size() / width) refuse("is cut off or damaged");
            const std::uint64_t place =
                many * width <= value ? entry + 4 + value : number(entry + 4 + value, value);
            std::vector<std::uint64_t>& list = fields_[number(entry, 2)];
            for (std::uint64_t k = 0; k < many; ++k)
                list.push_back(number(place + k * width, width));
        }
    }

    bool little() const { return little_; }
    std::uint64_t field(std::uint64_t tag, std::uint64_t absent) const {
        const auto at = fields_.find(tag);
        return at == fields_.end() || at->second.empty() ? absent : at->second[0];
    }
    const std::vector<std::uint64_t>& list(std::uint64_t tag) const {
        const auto at = fields_.find(tag);
        if (at == fields_.end()) refuse(fmt::format("has no field {}", tag));
        return at->second;
    }
    std::span<const std::byte> part(std::uint64_t at, std::uint64_t size) const {
        if (at > bytes_.size() || size > bytes_.size() - at) refuse("is cut off or damaged");
        return bytes_.subspan(at, size);
    }
    [[noreturn]] void refuse(const std::string& why) const { throw Error(where_, why, kFormats); }

  private:
    std::uint64_t number(std::uint64_t at, std::uint64_t size) const {
        const std::span<const std::byte> from = part(at, size);
        std::uint64_t value = 0;
        for (std::uint64_t i = 0; i < size; ++i)
            value = value << 8 | std::to_integer<std::uint64_t>(from[little_ ? size - 1 - i : i]);
        return value;
    }

    std::span<const std::byte> bytes_;
    const std::string& where_;
    bool little_;
    std::map<std::uint64_t, std::vector<std::uint64_t>> fields_;
};

/// Decodes TIFF's LZW: codes of 9 to 12 bits, highest bit first, which grow wider one code earlier
/// than necessary. Returns fewer than `size` bytes where the codes are cut off or damaged.
std::vector<std::byte> unlzw(std::span<const std::byte> codes, std::size_t size) {
    constexpr unsigned kClear = 256, kEnd = 257, kMost = 4096, kNone = kMost;
    std::vector<std::uint16_t> before(kMost), length(kMost, 1);
    std::vector<std::byte> last(kMost), out;
    for (unsigned c = 0; c < 256; ++c) last[c] = static_cast<std::byte>(c);
    unsigned width = 9, next = 258, previous = kNone, bits = 0, held = 0;
    const auto emit = [&](unsigned code) {
        const std::size_t begin = out.size(), count = length[code];
        out.resize(begin + count);
        for (std::size_t i = count; i-- > 0; code = before[code]) out[begin + i] = last[code];
        return out[begin];
    };
    for (std::size_t at = 0; out.size() < size;) {
        while (bits < width && at < codes.size()) {
            held = (held << 8 | std::to_integer<unsigned>(codes[at++])) & 0xFFFFFF;
            bits += 8;
        }
        if (bits < width) break;
        bits -= width;
        const unsigned code = held >> bits & ((1u << width) - 1);
        if (code == kEnd) break;
        if (code == kClear) {
            width = 9;
            next = 258;
            previous = kNone;
            continue;
        }
        if (code > next || (code == next && previous == kNone)) break;
        if (previous != kNone && next < kMost) {
            before[next] = static_cast<std::uint16_t>(previous);
            length[next] = static_cast<std::uint16_t>(length[previous] + 1);
            unsigned start = code == next ? previous : code;
            while (length[start] > 1) start = before[start];
            last[next] = last[start];
            ++next;
        }
        emit(code);
        if (next >= (1u << width) - 1 && width < 12) ++width;
        previous = code;
    }
    out.resize(std::min(out.size(), size));
    return out;
}

std::vector<std::byte> unpack_bits(std::span<const std::byte> runs, std::size_t size) {
    std::vector<std::byte> out;
    for (std::size_t at = 0; at < runs.size() && out.size() < size;) {
        const int head = static_cast<std::int8_t>(runs[at++]);
        const auto count = static_cast<std::size_t>(head >= 0 ? 1 + head : 1 - head);
        if (head == -128) continue;
        for (std::size_t i = 0; i < count && at + (head >= 0 ? i : 0) < runs.size(); ++i)
            out.push_back(runs[at + (head >= 0 ? i : 0)]);
        at += head >= 0 ? count : 1;
    }
    out.resize(std::min(out.size(), size));
    return out;
}

/// How the samples of a TIFF are laid out in tiles; strips count as tiles as wide as the picture.
struct TiffLayout {
    std::size_t width = 0, height = 0, tile_width = 0, tile_height = 0, bytes = 0;
    bool floats = false, is_signed = false;
    std::uint64_t compression = 1, predictor = 1;
};

TiffLayout tiff_layout(const TiffFile& tiff, std::size_t file_bytes, const std::string& where) {
    TiffLayout in;
    in.width = tiff.field(256, 0);
    in.height = tiff.field(257, 0);
    const std::uint64_t bits = tiff.field(258, 1), format = tiff.field(339, 1);
    in.bytes = bits / 8;
    in.floats = format == 3;
    in.is_signed = format == 2;
    in.compression = tiff.field(259, 1);
    in.predictor = tiff.field(317, 1);
    const bool integer = (format == 1 || format == 2) && (bits == 16 || bits == 32);
    if (tiff.field(277, 1) != 1 || !(integer || (in.floats && (bits == 32 || bits == 64))))
        tiff.refuse(fmt::format("is a TIFF with {} channels of {} bits and sample format {}",
                                tiff.field(277, 1), bits, format));
    if (tiff.field(274, 1) != 1) tiff.refuse("is a TIFF with an orientation, which is not applied");
    if (in.predictor < 1 || in.predictor > 3 || (in.predictor == 3 && !in.floats))
        tiff.refuse(fmt::format("is a TIFF with predictor {}", in.predictor));
    constexpr std::uint64_t kMostPacked =
        4096;  // bytes that one byte of LZW or deflate can expand to
    if (in.width > INT32_MAX || in.height > INT32_MAX) in.width = 0;
    check_photo_claim(static_cast<std::int64_t>(in.width), static_cast<std::int64_t>(in.height),
                      in.width * in.height * in.bytes / kMostPacked, file_bytes, where);
    const bool tiled = tiff.field(322, 0) > 0;
    in.tile_width = tiled ? tiff.field(322, 0) : in.width;
    in.tile_height = tiled ? tiff.field(323, 0) : tiff.field(278, in.height);
    in.tile_height = tiled ? in.tile_height : std::min(in.tile_height, in.height);
    if (in.tile_width < 1 || in.tile_height < 1 || in.tile_width > 65'536 ||
        in.tile_height > 65'536 || in.tile_width * in.tile_height > (std::size_t{1} << 28))
        tiff.refuse("is a TIFF whose tiles have no size");
    return in;
}

/// The samples of a strip or tile `rows` high, in native byte order.
std::vector<std::byte> tiff_samples(const TiffFile& tiff, const TiffLayout& in,
                                    std::span<const std::byte> packed, std::size_t rows) {
    const std::size_t row = in.tile_width * in.bytes, size = rows * row;
    std::vector<std::byte> raw;
    if (in.compression == 1) {
        raw.assign(packed.begin(),
                   packed.begin() + static_cast<std::ptrdiff_t>(std::min(size, packed.size())));
    } else if (in.compression == 8 || in.compression == 32946) {
        raw.resize(size);
        auto made = static_cast<uLongf>(size);
        uncompress(reinterpret_cast<Bytef*>(raw.data()), &made,
                   reinterpret_cast<const Bytef*>(packed.data()),
                   static_cast<uLong>(packed.size()));
        raw.resize(std::min<std::size_t>(made, size));
    } else if (in.compression == 5) {
        raw = unlzw(packed, size);
    } else if (in.compression == 32773) {
        raw = unpack_bits(packed, size);
    } else {
        tiff.refuse(
            fmt::format("is a TIFF with compression {}; none, LZW, deflate and PackBits "
                        "are read",
                        in.compression));
    }
    if (raw.size() < size) tiff.refuse("is cut off or damaged");
    std::vector<std::byte> line(row);
    for (std::size_t y = 0; y < rows; ++y) {
        std::byte* const begin = raw.data() + y * row;
        if (in.predictor == 3) {  // differences of bytes, the highest bytes of all samples first
            for (std::size_t i = 1; i < row; ++i)
                begin[i] = static_cast<std::byte>(std::to_integer<unsigned>(begin[i]) +
                                                  std::to_integer<unsigned>(begin[i - 1]));
            std::copy_n(begin, row, line.begin());
            for (std::size_t x = 0; x < in.tile_width; ++x)
                for (std::size_t b = 0; b < in.bytes; ++b)
                    begin[x * in.bytes + in.bytes - 1 - b] = line[b * in.tile_width + x];
            continue;
        }
        if (!tiff.little())
            for (std::size_t x = 0; x < in.tile_width; ++x)
                std::reverse(begin + x * in.bytes, begin + (x + 1) * in.bytes);
        if (in.predictor != 2) continue;
        std::uint64_t sum = 0;
        for (std::size_t x = 0; x < in.tile_width; ++x) {
            std::uint64_t value = 0;
            std::memcpy(&value, begin + x * in.bytes, in.bytes);
            sum += value;
            std::memcpy(begin + x * in.bytes, &sum, in.bytes);
        }
    }
    return raw;
}

template <class T>
double tiff_value(const std::byte* at) {
    T value;
    std::memcpy(&value, at, sizeof value);
    return static_cast<double>(value);
}

double tiff_sample(const TiffLayout& in, const std::byte* at) {
    if (in.floats) return in.bytes == 4 ? tiff_value<float>(at) : tiff_value<double>(at);
    if (in.bytes == 2)
        return in.is_signed ? tiff_value<std::int16_t>(at) : tiff_value<std::uint16_t>(at);
    return in.is_signed ? tiff_value<std::int32_t>(at) : tiff_value<std::uint32_t>(at);
}

ImageF read_tiff(std::span<const std::byte> file, const Units& units, const std::string& where) {
    const TiffFile tiff(file, where);
    const TiffLayout in = tiff_layout(tiff, file.size(), where);
    const bool tiled = tiff.field(322, 0) > 0;
    const std::vector<std::uint64_t>&places = tiff.list(tiled ? 324 : 273),
          &sizes = tiff.list(tiled ? 325 : 279);
    const std::size_t across = (in.width + in.tile_width - 1) / in.tile_width;
    const std::size_t down = (in.height + in.tile_height - 1) / in.tile_height;
    if (places.size() < across * down || sizes.size() < across * down)
        tiff.refuse("is cut off or damaged");
    const double unit = in.floats ? units.of_floats : units.of_integers;
    ImageF depth(static_cast<int>(in.width), static_cast<int>(in.height), 1);
    for (std::size_t t = 0; t < across * down; ++t) {
        const std::size_t x0 = t % across * in.tile_width, y0 = t / across * in.tile_height;
        const std::size_t w = std::min(in.tile_width, in.width - x0),
                          h = std::min(in.tile_height, in.height - y0);
        const std::vector<std::byte> samples =
            tiff_samples(tiff, in, tiff.part(places[t], sizes[t]), tiled ? in.tile_height : h);
        for (std::size_t y = 0; y < h; ++y)
            for (std::size_t x = 0; x < w; ++x)
                depth.data[(y0 + y) * in.width + x0 + x] = measured(
                    tiff_sample(in, samples.data() + (y * in.tile_width + x) * in.bytes), unit);
    }
    return depth;
}

bool is_tiff(std::span<const std::byte> file) {
    if (file.size() < 8) return false;
    const std::string_view head(reinterpret_cast<const char*>(file.data()), 4);
    using namespace std::string_view_literals;
    return head == "II*\0"sv || head == "MM\0*"sv || head == "II+\0"sv || head == "MM\0+"sv;
}

ImageF read_png(std::span<const std::byte> file, const Units& units, const std::string& where) {
    const GreyU16 grey = decode_png16(file, where, kFormats);
    ImageF depth(grey.width, grey.height, 1);
    for (std::size_t p = 0; p < depth.data.size(); ++p)
        depth.data[p] = measured(grey.data[p], units.of_integers);
    return depth;
}

}  // namespace

ImageF read_depth(const std::filesystem::path& path, double unit, bool of_integers) {
    const std::string where = path.string();
    Units units;
    if (unit > 0) units.of_integers = unit;
    if (unit > 0 && !of_integers) units.of_floats = unit;
    const std::vector<std::byte> file = read_file(path);
    const bool npy = has_extension(path, ".npy");
    if (!npy && !is_png(file) && !is_tiff(file))
        throw Error(where, "is neither PNG, TIFF nor .npy", kFormats);
    ImageF depth = npy            ? read_npy(file, units, where)
                   : is_png(file) ? read_png(file, units, where)
                                  : read_tiff(file, units, where);
    if (std::none_of(depth.data.begin(), depth.data.end(), [](float d) { return d > 0; }))
        throw Error(where, "holds no measured depth: every value is 0 or no number",
                    "Remove the file where nothing was measured.");
    return depth;
}

}  // namespace darb
