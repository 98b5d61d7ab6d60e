// SPDX-License-Identifier: MIT
#include "engine/core/error.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <string>
#include <vector>

#include "engine/core/on_threads.h"

namespace darb {
namespace {

TEST(WhileDoing, names_what_the_system_had_no_room_for) {
    const auto message = [](const auto& work) -> std::string {
        try {
            while_doing("photo.jpg", work);
        } catch (const Error& e) {
            return e.what();
        }
        return "";
    };
    EXPECT_NE(message([]() -> int { throw std::bad_alloc(); }).find("photo.jpg: no memory is left"),
              std::string::npos);
    EXPECT_NE(
        message([] { std::vector<int>().reserve(~std::size_t{0}); }).find("photo.jpg: more memory"),
        std::string::npos);
    const auto no_thread = [] {
        throw std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again));
    };
    EXPECT_NE(message(no_thread).find("photo.jpg: no thread can be started"), std::string::npos);
    EXPECT_EQ(message([] { throw Error("scene.ply", "is cut off"); }), "scene.ply: is cut off");
    EXPECT_EQ(while_doing("a sum", [] { return 2 + 3; }), 5);
}

// A stack is 8 MB of address space: a few threads fit, and not a thousand.
TEST(OnThreads, those_that_start_do_the_work_of_all) {
    const pid_t child = ::fork();
    if (child == 0) {
        std::ifstream statm("/proc/self/statm");
        rlim_t pages = 0;
        statm >> pages;
        const rlim_t bytes = pages * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE)) + (100u << 20);
        const rlimit limit{bytes, bytes};
        ::setrlimit(RLIMIT_AS, &limit);
        std::atomic<int> next{0}, done{0};
        on_threads(1'000, [&] {
            while (next++ < 5'000) ++done;
        });
        ::_exit(done == 5'000 ? 0 : 1);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
}

}  // namespace
}  // namespace darb
