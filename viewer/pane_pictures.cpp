// SPDX-License-Identifier: MIT
#include "viewer/pane_pictures.h"

#include <algorithm>
#include <utility>

#include "engine/primitives/groups.h"

namespace darb {

void add_times(const std::vector<PassTime>& more, std::vector<PassTime>& sum) {
    for (const PassTime& pass : more) {
        const auto same = std::find_if(sum.begin(), sum.end(),
                                       [&](const PassTime& p) { return p.name == pass.name; });
        if (same == sum.end())
            sum.push_back(pass);
        else
            same->ms += pass.ms;
    }
}

std::vector<DisplaySettings> pane_displays(const DisplaySettings& display,
                                           const std::vector<int>& kernels_beside) {
    std::vector<DisplaySettings> displays{display};
    for (const int kernel : kernels_beside) displays.emplace_back(display).kernel = kernel;
    return displays;
}

PanePictures::PanePictures(Device& device) : device_(&device), commands_(device) {}

void PanePictures::render(SplatPicture& picture, const PaneWish& wish) {
    prepare(picture, wish);
    picture.keep_panes(wish.displays.size());
    for (std::size_t i = 0; i < wish.displays.size(); ++i) {
        picture.render(wish.camera, wish.displays[i], wish.photo, wish.moving, static_cast<int>(i));
        add_times(picture.pass_times(), pass_times_);
        compiled_ |= picture.compiled();
    }
}

void PanePictures::start(int frame, SplatPicture& picture, const PaneWish& wish) {
    prepare(picture, wish);
    picture.keep_panes(wish.displays.size());
    for (std::size_t i = 0; i < wish.displays.size(); ++i) {
        picture.start(frame, wish.camera, wish.displays[i], wish.photo, wish.moving,
                      static_cast<int>(i));
        compiled_ |= picture.compiled();
    }
}

// Buffers are replaced only while nothing under way uses them.
void PanePictures::prepare(const SplatPicture& picture, const PaneWish& wish) {
    composed_.reset();
    pass_times_.clear();
    picture_ = &picture;
    photo_.reset();
    photo_first_ = wish.photo_first;
    count_ = 0;  // stays 0 where a picture has no room
    compiled_ = wish.several() && !strips_;
    if (!wish.several()) return;
    const SpecConstants threads{{"THREADS", VIEW_GROUP}};
    if (!strips_) strips_ = Pipeline(*device_, "panes", threads);
    if (photo_first_ && !photo_frame_) photo_frame_ = Pipeline(*device_, "photo_frame", threads);
    const std::uint64_t bytes =
        std::uint64_t(wish.camera.width) * std::uint64_t(wish.camera.height) * 4;
    const std::size_t count = wish.displays.size() + (photo_first_ ? 1 : 0);
    std::vector<std::pair<Buffer*, Memory>> needed{{&pixels_, Memory::device}};
    if (photo_first_) needed.emplace_back(&photo_pixels_, Memory::device);
    if (copies_.size() < count) copies_.resize(count);
    if (!wish.moving)
        for (std::size_t i = 0; i < count; ++i) needed.emplace_back(&copies_[i], Memory::host);
    for (const auto& [buffer, memory] : needed) {
        if (buffer->bytes() >= bytes) continue;
        device_->wait_idle();
        *buffer = Buffer(*device_, "panes", bytes, memory);
    }
    size_ = {wish.camera.width, wish.camera.height};
    if (photo_first_) {
        photo_ = wish.photo;
        photo_display_ = wish.displays.front();
    }
    count_ = count;
}

const Buffer& PanePictures::image(std::size_t n) const {
    const std::size_t photos = photo_first_ ? 1 : 0;
    return n < photos ? photo_pixels_ : picture_->pixels(static_cast<int>(n - photos));
}

void PanePictures::record_photo(Commands& commands) {
    if (!photo_) return;
    const gpu::DisplayArgs args = display_args(size_.x, size_.y, photo_display_, *photo_);
    const Groups g = groups_for(std::uint64_t(args.width) * args.height, VIEW_GROUP);
    commands.pass("photo");
    commands.dispatch(photo_frame_, args, {*photo_->photo, photo_pixels_}, g.x, g.y);
    photo_.reset();
}

// Where the photo has no pixels, the picture beside it shows through, darker.
void PanePictures::record(Commands& commands, const Panes& panes) {
    const Layout layout{panes.lines, panes.difference, panes.difference_max};
    if (count_ < 2 || composed_ == layout) return;
    record_photo(commands);
    const std::vector<int> edges = pane_edges(panes.lines, size_.x);
    commands.pass("panes");
    for (std::size_t i = 0; i < count_ && i + 1 < edges.size(); ++i) {
        if (edges[i + 1] <= edges[i]) continue;
        const bool difference = panes.difference && i > 0;
        const gpu::PaneArgs args{static_cast<std::uint32_t>(size_.x),
                                 static_cast<std::uint32_t>(size_.y),
                                 static_cast<std::uint32_t>(edges[i]),
                                 static_cast<std::uint32_t>(edges[i + 1]),
                                 difference ? 1u : 0u,
                                 panes.difference_max};
        const Groups g =
            groups_for(std::uint64_t(args.right - args.left) * args.height, VIEW_GROUP);
        commands.dispatch(strips_, args, {image(i), image(i > 0 ? 0 : 1), pixels_}, g.x, g.y);
    }
    composed_ = layout;
}

void PanePictures::compose(const Panes& panes, bool copies) {
    commands_.begin();
    record(commands_, panes);
    if (copies) record_copies(commands_);
    commands_.submit_and_wait();
}

void PanePictures::record_copies(Commands& commands) {
    const std::uint64_t bytes = std::uint64_t(size_.x) * std::uint64_t(size_.y) * 4;
    for (std::size_t i = 0; i < count_; ++i) commands.copy(image(i), copies_[i], bytes);
}

std::vector<double> PanePictures::psnr_db() const {
    const std::size_t pixels = std::size_t(size_.x) * std::size_t(size_.y);
    const auto copy = [&](std::size_t n) {
        return std::span(static_cast<const std::uint32_t*>(copies_[n].mapped()), pixels);
    };
    std::vector<double> result;
    for (std::size_t i = 1; i < count_; ++i) result.push_back(pixels_psnr_db(copy(i), copy(0)));
    return result;
}

}  // namespace darb
