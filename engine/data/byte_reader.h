// SPDX-License-Identifier: MIT
// ByteReader: reads little-endian binary data with bounds checks.
#pragma once

#include <fmt/format.h>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <utility>

#include "engine/core/error.h"

namespace darb {

static_assert(std::endian::native == std::endian::little);

class ByteReader {
  public:
    ByteReader(std::span<const std::byte> bytes, std::string where)
        : bytes_(bytes), where_(std::move(where)) {}

    /// Names what is being read, for error messages: "image 3 of 10".
    void set_record(std::string record) { record_ = std::move(record); }
    std::string where() const { return record_.empty() ? where_ : where_ + ", " + record_; }
    std::size_t left() const { return bytes_.size() - at_; }

    template <class T>
    T read() {
        need(sizeof(T));
        T value;
        std::memcpy(&value, bytes_.data() + at_, sizeof(T));
        at_ += sizeof(T);
        return value;
    }
    void skip(std::size_t count) {
        need(count);
        at_ += count;
    }
    /// Reads up to the terminating zero byte and returns the text without it.
    std::string read_string() {
        const auto* begin = reinterpret_cast<const char*>(bytes_.data() + at_);
        const void* end = left() == 0 ? nullptr : std::memchr(begin, 0, left());
        if (!end) need(left() + 1);
        std::string text(begin, static_cast<const char*>(end));
        at_ += text.size() + 1;
        return text;
    }
    /// Reads a 64-bit count of records that take at least `least` bytes each, and checks it against
    /// the bytes left.
    std::size_t read_count(std::size_t least, const char* what) {
        const auto count = read<std::uint64_t>();
        if (count > left() / least)
            throw Error(
                where(),
                fmt::format("declares {} {} of at least {} bytes each, but {} bytes are left",
                            count, what, least, left()),
                kCutOff);
        return static_cast<std::size_t>(count);
    }

  private:
    static constexpr const char* kCutOff =
        "The file is cut off or damaged: copy or export it again.";

    void need(std::size_t count) const {
        if (count > left()) throw Error(where(), "the file ends here", kCutOff);
    }

    std::span<const std::byte> bytes_;
    std::size_t at_ = 0;
    std::string where_, record_;
};

}  // namespace darb
