// SPDX-License-Identifier: MIT
// The memory that a process holds, as Linux reports it.
#pragma once

#include <unistd.h>

#include <cstdint>
#include <fstream>
#include <string>

namespace darb::test {

/// 0 once it has ended.
inline std::uint64_t resident_bytes(pid_t process = ::getpid()) {
    std::ifstream statm("/proc/" + std::to_string(process) + "/statm");
    std::uint64_t pages = 0;
    statm >> pages >> pages;
    return statm ? pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) : 0;
}

}  // namespace darb::test
