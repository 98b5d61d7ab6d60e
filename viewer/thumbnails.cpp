// SPDX-License-Identifier: MIT
#include "viewer/thumbnails.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "engine/core/system.h"

namespace darb {

namespace {
constexpr int kThumbnailNice = 10;  // a run has the processor first
}

Thumbnail thumbnail_of(const ImageU8& photo, int longest) {
    Thumbnail t;
    if (photo.width <= 0 || photo.height <= 0) return t;
    const double share = std::min(1.0, double(longest) / std::max(photo.width, photo.height));
    t.width = std::max(1, static_cast<int>(photo.width * share));
    t.height = std::max(1, static_cast<int>(photo.height * share));
    for (int y = 0; y < t.height; ++y)
        for (int x = 0; x < t.width; ++x) {
            const int x0 = x * photo.width / t.width, x1 = (x + 1) * photo.width / t.width;
            const int y0 = y * photo.height / t.height, y1 = (y + 1) * photo.height / t.height;
            std::uint64_t sum[3] = {};
            for (int j = y0; j < y1; ++j)
                for (int i = x0; i < x1; ++i) {
                    const int alpha = photo.channels == 4 ? photo.at(i, j, 3) : 255;
                    for (int c = 0; c < 3; ++c)
                        sum[c] += static_cast<std::uint64_t>(photo.at(i, j, c) * alpha / 255);
                }
            const auto count = static_cast<std::uint64_t>((x1 - x0) * (y1 - y0));
            std::uint32_t colour = 0xFF000000u;
            for (int c = 0; c < 3; ++c)
                colour |= static_cast<std::uint32_t>(sum[c] / count) << (8 * c);
            t.pixels.push_back(colour);
        }
    return t;
}

Thumbnails::~Thumbnails() {
    {
        const std::lock_guard lock(mutex_);
        leaves_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
}

std::shared_ptr<const Thumbnail> Thumbnails::get(std::size_t index, const View& view) {
    const std::lock_guard lock(mutex_);
    if (const auto found = ready_.find(index); found != ready_.end()) return found->second;
    if (wanted_.try_emplace(index, view).second) {
        latest_ = index;
        changed_.notify_all();
    }
    if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
    return nullptr;
}

void Thumbnails::run() {
    lower_thread_priority(kThumbnailNice);
    std::unique_lock lock(mutex_);
    while (!leaves_) {
        if (wanted_.empty()) {
            changed_.wait(lock);
            continue;
        }
        auto next = wanted_.lower_bound(latest_);
        if (next == wanted_.end()) next = wanted_.begin();
        const std::size_t index = next->first;
        const View view = next->second;
        lock.unlock();
        Thumbnail made;
        try {
            if (!view.photo.empty()) made = thumbnail_of(load_photo(view), kLongest);
        } catch (const std::exception&) {  // looking through the camera says why
        }
        lock.lock();
        wanted_.erase(index);
        ready_[index] = std::make_shared<const Thumbnail>(std::move(made));
        if (!leaves_ && wake_) wake_();
    }
}

}  // namespace darb
