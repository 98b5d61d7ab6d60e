// The pipeline cache on disk: a magic word and a hash before the driver's bytes, because drivers
// have crashed on cut or flipped caches.
#include <cstring>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/gpu/device_state.h"

namespace darb {

namespace {

struct CacheHead {
    std::uint64_t magic;
    std::uint64_t hash;
};
constexpr std::uint64_t kCacheMagic = 0x3148434342524144;  // "DARBCCH1"

// FNV-1a, 64 bits.
std::uint64_t hash_bytes(std::span<const std::byte> data) {
    std::uint64_t hash = 0xcbf29ce484222325;
    for (const std::byte byte : data)
        hash = (hash ^ static_cast<std::uint64_t>(byte)) * 0x100000001b3;
    return hash;
}

}  // namespace

std::vector<std::byte> load_pipeline_cache(const std::filesystem::path& file) try {
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) return {};
    std::vector<std::byte> bytes = read_file(file);
    CacheHead head{};
    if (bytes.size() < sizeof(head)) return {};
    std::memcpy(&head, bytes.data(), sizeof(head));
    bytes.erase(bytes.begin(), bytes.begin() + sizeof(head));
    if (head.magic != kCacheMagic || head.hash != hash_bytes(bytes)) return {};
    return bytes;
} catch (const Error&) {
    return {};
}

void save_pipeline_cache(const std::filesystem::path& file, std::span<const std::byte> data) try {
    const CacheHead head{kCacheMagic, hash_bytes(data)};
    std::vector<std::byte> bytes(sizeof(head) + data.size());
    std::memcpy(bytes.data(), &head, sizeof(head));
    if (!data.empty()) std::memcpy(bytes.data() + sizeof(head), data.data(), data.size());
    write_file_atomic(file, bytes);
} catch (const Error&) {
}

}  // namespace darb
