// SPDX-License-Identifier: MIT
#include "engine/scene/inflate.h"

#include <fmt/format.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "engine/core/error.h"

namespace darb {

namespace {

constexpr std::size_t kStep = std::size_t{1} << 20;  // bytes of output at a time
constexpr int kGzipWindow = 16 + MAX_WBITS;
constexpr int kZstdLevel = 12;  // that of SPZ's reference writer

// deflate reaches at most 1,032; scenes reach 20.
constexpr std::uint64_t kLargestExpansion = 1024;
constexpr std::uint64_t kAlwaysAllowed = std::uint64_t{1} << 20;  // bytes

struct Inflate {
    z_stream stream{};
    Inflate() { DARB_CHECK(inflateInit2(&stream, kGzipWindow) == Z_OK); }
    ~Inflate() { inflateEnd(&stream); }
    Inflate(const Inflate&) = delete;
    Inflate& operator=(const Inflate&) = delete;
};

}  // namespace

std::vector<std::byte> gunzip(std::span<const std::byte> stream, std::size_t most,
                              const std::string& where) {
    Inflate zlib;
    std::vector<std::byte> out;
    int status = Z_OK;
    while (out.size() < most && status != Z_STREAM_END) {
        const std::size_t before = out.size(), step = std::min(kStep, most - before);
        out.resize(before + step);
        zlib.stream.next_out = reinterpret_cast<Bytef*>(out.data() + before);
        zlib.stream.avail_out = static_cast<uInt>(step);
        if (zlib.stream.avail_in == 0) {
            const std::size_t part =
                std::min<std::size_t>(stream.size(), std::numeric_limits<uInt>::max());
            zlib.stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(stream.data()));
            zlib.stream.avail_in = static_cast<uInt>(part);
            stream = stream.subspan(part);
        }
        status = ::inflate(&zlib.stream, Z_NO_FLUSH);
        out.resize(before + step - zlib.stream.avail_out);
        const bool stuck = status == Z_BUF_ERROR || (status == Z_OK && zlib.stream.avail_in == 0 &&
                                                     stream.empty() && out.size() < most);
        if (stuck || (status != Z_OK && status != Z_STREAM_END))
            throw Error(where,
                        fmt::format("the gzip stream {} after {} bytes of content",
                                    stuck ? "ends" : "is damaged", out.size()),
                        kCopyAgain);
    }
    return out;
}

std::vector<std::byte> gzip(std::span<const std::byte> bytes) {
    z_stream stream{};
    DARB_CHECK(deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzipWindow, 9,
                            Z_DEFAULT_STRATEGY) == Z_OK);
    std::vector<std::byte> out(deflateBound(&stream, static_cast<uLong>(bytes.size())));
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    DARB_CHECK(deflate(&stream, Z_FINISH) == Z_STREAM_END);
    out.resize(stream.total_out);
    deflateEnd(&stream);
    return out;
}

std::vector<std::byte> unzstd(std::span<const std::byte> frame, std::size_t size,
                              const std::string& where) {
    std::vector<std::byte> out(size);
    const std::size_t got = ZSTD_decompress(out.data(), size, frame.data(), frame.size());
    if (ZSTD_isError(got))
        throw Error(where, fmt::format("a Zstandard stream is damaged: {}", ZSTD_getErrorName(got)),
                    kCopyAgain);
    if (got != size)
        throw Error(where,
                    fmt::format("a Zstandard stream holds {} bytes, {} are needed", got, size),
                    kCopyAgain);
    return out;
}

std::vector<std::byte> zstd(std::span<const std::byte> bytes) {
    std::vector<std::byte> out(ZSTD_compressBound(bytes.size()));
    const std::unique_ptr<ZSTD_CCtx, std::size_t (*)(ZSTD_CCtx*)> context(ZSTD_createCCtx(),
                                                                          ZSTD_freeCCtx);
    DARB_CHECK(context != nullptr);
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, kZstdLevel);
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
    const std::size_t size =
        ZSTD_compress2(context.get(), out.data(), out.size(), bytes.data(), bytes.size());
    DARB_CHECK(!ZSTD_isError(size), "{}", ZSTD_getErrorName(size));
    out.resize(size);
    return out;
}

void check_expansion(std::size_t stored, std::uint64_t declared, const std::string& where) {
    if (declared > kAlwaysAllowed && declared / kLargestExpansion > stored)
        throw Error(where,
                    fmt::format("declares {} bytes of content in a file of {}", declared, stored),
                    kCopyAgain);
}

}  // namespace darb
