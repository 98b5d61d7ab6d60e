// Work on several threads, as many as the system starts.
#pragma once

#include <cstddef>
#include <system_error>
#include <thread>
#include <vector>

namespace darb {

/// Calls work() on `threads` threads, the caller's among them, and returns when each has returned.
/// Where the system starts no more they are fewer: work() takes what is left until nothing is.
/// work() must not throw.
template <class Work>
void on_threads(std::size_t threads, const Work& work) {
    std::vector<std::jthread> others;
    try {
        for (std::size_t t = 1; t < threads; ++t) others.emplace_back([&work] { work(); });
    } catch (const std::system_error&) {
    } catch (const std::bad_alloc&) {
    }
    work();
}

}  // namespace darb
