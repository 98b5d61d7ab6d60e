// SPDX-License-Identifier: MIT
// Work on several threads, or on as many as the system will start.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace darb {

/// A thread that its destructor joins: std::jthread, which libc++ before 18 lacks.
class JoinedThread {
  public:
    template <class Work>
    explicit JoinedThread(Work work) : thread_(std::move(work)) {}
    JoinedThread(JoinedThread&&) noexcept = default;
    JoinedThread& operator=(JoinedThread&&) = delete;
    ~JoinedThread() {
        if (thread_.joinable()) thread_.join();
    }

  private:
    std::thread thread_;
};

/// Calls work() on `threads` threads, the caller's among them, and returns when every call has
/// returned. There are fewer threads where the system will not start that many, so work() must keep
/// taking pieces until none is left. work() must not throw.
template <class Work>
void on_threads(std::size_t threads, const Work& work) {
    std::vector<JoinedThread> others;
    try {
        for (std::size_t t = 1; t < threads; ++t) others.emplace_back([&work] { work(); });
    } catch (const std::system_error&) {
    } catch (const std::bad_alloc&) {
    }
    work();
}

/// Calls work(first, count) for pieces of [0, size), in any order. Meant for loops limited by
/// memory bandwidth, so it uses four threads at most. work() must not throw.
template <class Work>
void in_pieces(std::size_t size, std::size_t piece, const Work& work) {
    const std::size_t threads = std::min(std::thread::hardware_concurrency(), 4u);
    std::atomic<std::size_t> next{0};
    on_threads(std::min(threads, (size + piece - 1) / piece), [&] {
        for (std::size_t first = 0; (first = next.fetch_add(piece)) < size;)
            work(first, std::min(piece, size - first));
    });
}

}  // namespace darb
