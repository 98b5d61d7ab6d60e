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

bool PanePictures::render_all(SplatPicture& picture, const Camera& camera,
                              const std::vector<DisplaySettings>& displays,
                              const PhotoOverlay& photo, bool photo_first,
                              std::optional<double> moving) {
    const bool several = photo_first || displays.size() > 1;
    if (several) {
        render(picture, camera, displays, photo, photo_first, moving);
    } else {
        picture.keep_panes(1);
        picture.render(camera, displays.front(), photo, moving);
    }
    return several;
}

PanePictures::PanePictures(Device& device) : device_(&device), commands_(device) {}

void PanePictures::render(SplatPicture& picture, const Camera& camera,
                          const std::vector<DisplaySettings>& displays, const PhotoOverlay& photo,
                          bool photo_first, std::optional<double> moving) {
    const std::uint64_t bytes = std::uint64_t(camera.width) * std::uint64_t(camera.height) * 4;
    const std::size_t photos = photo_first ? 1 : 0;
    composed_.reset();
    pass_times_.clear();
    compiled_ = !strips_;
    std::vector<Buffer> pictures = std::exchange(pictures_, {});  // none where one has no room
    pictures.resize(photos + displays.size());
    for (Buffer& b : pictures)
        if (b.bytes() < bytes) b = Buffer(*device_, "pane", bytes);
    if (pixels_.bytes() < bytes) pixels_ = Buffer(*device_, "panes", bytes);
    pictures_ = std::move(pictures);
    size_ = {camera.width, camera.height};
    if (photos > 0) draw_photo(photo, displays.front());
    picture.keep_panes(displays.size());
    for (std::size_t i = 0; i < displays.size(); ++i) {
        picture.render(camera, displays[i], photo, moving, static_cast<int>(i));
        picture.take_pixels(pictures_[photos + i]);
        add_times(picture.pass_times(), pass_times_);
        compiled_ |= picture.compiled();
    }
}

void PanePictures::draw_photo(const PhotoOverlay& photo, const DisplaySettings& display) {
    if (!photo_frame_)
        photo_frame_.emplace(*device_, "photo_frame", SpecConstants{{"THREADS", VIEW_GROUP}});
    const gpu::DisplayArgs args = display_args(size_.x, size_.y, display, photo);
    const Groups g = groups_for(std::uint64_t(args.width) * args.height, VIEW_GROUP);
    commands_.begin();
    commands_.pass("photo");
    commands_.dispatch(*photo_frame_, args, {*photo.photo, pictures_.front()}, g.x, g.y);
    commands_.submit_and_wait();
}

// Where the photo has nothing, the picture beside it is seen, darker.
void PanePictures::compose(const Panes& panes) {
    const Layout layout{panes.lines, panes.difference, panes.difference_max};
    if (pictures_.size() < 2 || composed_ == layout) return;
    if (!strips_) strips_.emplace(*device_, "panes", SpecConstants{{"THREADS", VIEW_GROUP}});
    const std::vector<int> edges = pane_edges(panes.lines, size_.x);
    commands_.begin();
    commands_.pass("panes");
    for (std::size_t i = 0; i < pictures_.size() && i + 1 < edges.size(); ++i) {
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
        commands_.dispatch(*strips_, args, {pictures_[i], pictures_[i > 0 ? 0 : 1], pixels_}, g.x,
                           g.y);
    }
    commands_.submit_and_wait();
    composed_ = layout;
}

std::vector<double> PanePictures::psnr_db() const {
    const std::size_t pixels = std::size_t(size_.x) * std::size_t(size_.y);
    std::vector<double> result;
    if (pictures_.empty()) return result;
    const auto first = pictures_.front().download<std::uint32_t>(pixels);
    for (std::size_t i = 1; i < pictures_.size(); ++i)
        result.push_back(pixels_psnr_db(pictures_[i].download<std::uint32_t>(pixels), first));
    return result;
}

}  // namespace darb
