// SPDX-License-Identifier: MIT
// gzip (zlib) and Zstandard with bounds known in advance: no output is larger than the caller asks
// for, whatever the bytes claim.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace darb {

/// The first `most` bytes of the gzip stream; fewer where it ends earlier, in which case its
/// checksum has been verified. Memory grows with the actual output. Throws Error(where, ...) where
/// the stream is damaged or cut off before that.
std::vector<std::byte> gunzip(std::span<const std::byte> stream, std::size_t most,
                              const std::string& where);
std::vector<std::byte> gzip(std::span<const std::byte> bytes);

/// Exactly `size` bytes from one Zstandard frame. Throws Error(where, ...) where the frame is
/// damaged or holds another number of bytes.
std::vector<std::byte> unzstd(std::span<const std::byte> frame, std::size_t size,
                              const std::string& where);
std::vector<std::byte> zstd(std::span<const std::byte> bytes);

/// Throws Error where a file of `stored` bytes declares more than 1,024 times as many. Such a file
/// is damaged, or made to fill the memory. Call it before allocating.
void check_expansion(std::size_t stored, std::uint64_t declared, const std::string& where);

}  // namespace darb
