#include "engine/core/memory.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

namespace darb {

namespace {

constexpr std::uint64_t kUnknown = std::numeric_limits<std::uint64_t>::max();

/// "MemAvailable:   123 kB"
std::uint64_t meminfo() {
    std::ifstream file("/proc/meminfo");
    std::uint64_t sum = 0, value = 0;
    bool found = false;
    for (std::string name, unit; file >> name >> value && std::getline(file, unit);) {
        if (name != "MemAvailable:" && name != "SwapFree:") continue;
        sum += value * 1024;
        found |= name == "MemAvailable:";
    }
    return found ? sum : kUnknown;
}

std::uint64_t control_group() {
    std::uint64_t most = 0, used = 0;
    std::ifstream limit("/sys/fs/cgroup/memory.max"), now("/sys/fs/cgroup/memory.current");
    if (!(limit >> most) || !(now >> used)) return kUnknown;  // "max"
    return most - std::min(used, most);
}

}  // namespace

std::uint64_t free_memory() {
    return std::min(meminfo(), control_group());
}

void give_back_freed_memory() {
#ifdef __GLIBC__
    ::malloc_trim(0);
#endif
}

}  // namespace darb
