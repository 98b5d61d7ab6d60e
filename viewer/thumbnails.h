// SPDX-License-Identifier: MIT
// Thumbnails: small pictures of the photos, read by a thread of their own as they are asked for.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/dataset.h"

namespace darb {

/// A8B8G8R8 [height][width], as draw lists have colours. Empty: the photo cannot be read.
struct Thumbnail {
    int width = 0, height = 0;  // px
    std::vector<std::uint32_t> pixels;
};

/// A photo, RGB or RGBA, as boxes of its pixels, so that the longer side has `longest` px or fewer.
/// Where it is transparent it is dark.
Thumbnail thumbnail_of(const ImageU8& photo, int longest);

class Thumbnails {
  public:
    static constexpr int kLongest = 64;  // px

    /// wake: called from the thread whenever there is a new one.
    explicit Thumbnails(std::function<void()> wake) : wake_(std::move(wake)) {}
    ~Thumbnails();
    Thumbnails(const Thumbnails&) = delete;
    Thumbnails& operator=(const Thumbnails&) = delete;

    /// The thumbnail of a view, by its index in the data set; null while it is not there. What was
    /// asked for last is read first.
    std::shared_ptr<const Thumbnail> get(std::size_t index, const View& view);

  private:
    void run();
    std::function<void()> wake_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::map<std::size_t, std::shared_ptr<const Thumbnail>> ready_;
    std::map<std::size_t, View> wanted_;
    std::size_t latest_ = 0;
    bool leaves_ = false;
    std::thread thread_;  // started by the first get()
};

}  // namespace darb
