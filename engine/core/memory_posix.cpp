// SPDX-License-Identifier: MIT
#include "engine/core/memory.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <fstream>
#include <limits>
#include <map>
#include <string>

namespace darb {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kUnknown = std::numeric_limits<std::uint64_t>::max();

// Parses lines of a name, a number and whatever follows: "MemAvailable:   123 kB".
std::map<std::string, std::uint64_t> numbers_of(const fs::path& path) {
    std::map<std::string, std::uint64_t> numbers;
    std::ifstream file(path);
    std::string name, rest;
    for (std::uint64_t value = 0; file >> name >> value; std::getline(file, rest))
        numbers[name] = value;
    return numbers;
}

std::uint64_t machine(const fs::path& root) {
    auto numbers = numbers_of(root / "proc/meminfo");
    if (!numbers.contains("MemAvailable:")) return kUnknown;
    return 1024 * (numbers["MemAvailable:"] + numbers["SwapFree:"]);
}

// Both versions of control groups have these figures, in files of different names. In version 1,
// figures that include the groups below have a prefix.
struct Names {
    const char *limit, *used, *prefix;
};
constexpr Names kVersion1{"memory.limit_in_bytes", "memory.usage_in_bytes", "total_"};
constexpr Names kVersion2{"memory.max", "memory.current", ""};

// What one group has left; kUnknown where it has no limit ("max").
std::uint64_t left_in(const fs::path& group, const Names& names) {
    std::uint64_t limit = 0, used = 0;
    std::ifstream limit_file(group / names.limit), used_file(group / names.used);
    if (!(limit_file >> limit) || !(used_file >> used)) return kUnknown;
    auto stat = numbers_of(group / "memory.stat");
    std::uint64_t kept = 0;  // file cache and kernel memory that Linux can reclaim, bytes
    for (const char* name : {"inactive_file", "active_file", "slab_reclaimable"})
        kept += stat[names.prefix + std::string(name)];
    // Version 1 only: the smallest limit of the groups above, whose files a container may not see.
    if (stat.contains("hierarchical_memory_limit"))
        limit = std::min(limit, stat["hierarchical_memory_limit"]);
    used -= std::min(kept, used);
    return limit - std::min(used, limit);
}

// What the group and those that contain it have left. A container sees its own group as the top
// one, although its name is the one outside; the folders below do not exist then.
std::uint64_t left_in_all(const fs::path& top, const fs::path& name, const Names& names) {
    std::uint64_t least = left_in(top, names);
    fs::path group = top;
    for (const fs::path& part : name.relative_path())
        least = std::min(least, left_in(group /= part, names));
    return least;
}

// "4:memory:/name" in version 1, "0::/name" in version 2.
std::uint64_t control_groups(const fs::path& root) {
    const fs::path top = root / "sys/fs/cgroup";
    std::uint64_t least = left_in(top, kVersion2);
    std::ifstream file(root / "proc/self/cgroup");
    for (std::string line; std::getline(file, line);) {
        const std::size_t first = line.find(':'), second = line.find(':', first + 1);
        if (first == std::string::npos || second == std::string::npos) continue;
        const std::string kinds = "," + line.substr(first + 1, second - first - 1) + ",";
        const fs::path name = line.substr(second + 1);
        if (kinds == ",,") {
            least = std::min({least, left_in_all(top, name, kVersion2),
                              left_in_all(top / "unified", name, kVersion2)});
        } else if (kinds.find(",memory,") != std::string::npos) {
            least = std::min(least, left_in_all(top / "memory", name, kVersion1));
        }
    }
    return least;
}

}  // namespace

std::uint64_t free_memory(const fs::path& root) {
    return std::min(machine(root), control_groups(root));
}

void give_back_freed_memory() {
#ifdef __GLIBC__
    ::malloc_trim(0);
#endif
}

}  // namespace darb
