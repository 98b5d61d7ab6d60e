// SPDX-License-Identifier: MIT
#include "viewer/live_picture.h"

#include <algorithm>
#include <utility>

#include "engine/core/error.h"
#include "viewer/seconds.h"
#include "viewer/view_camera.h"

namespace darb {

namespace {

constexpr double kDrawnShare = 0.1;  // share of the time that pictures may take from training
constexpr double kBetween_s = 0.2;   // time between two pictures of splats that change
// time that a wish stays unchanged before its whole picture is drawn
constexpr double kUnchanged_s = 0.12;

}  // namespace

bool LiveWish::operator==(const LiveWish& o) const {
    return key == o.key && area == o.area && panes.lines == o.panes.lines &&
           panes.difference == o.panes.difference && panes.difference_max == o.panes.difference_max;
}

LiveScene live_scene(const GpuSplats& splats) {
    return {splats.kernel(), splats.sh_degree(), splats.footprint(), splats.antialias(),
            splats.smoothing().bytes() == std::uint64_t{splats.count()} * 4};
}

void LivePicture::wish(const LiveWish& wish) {
    const std::lock_guard lock(mutex_);
    wish_ = wish;
}

std::optional<LiveWish> LivePicture::wished() const {
    const std::lock_guard lock(mutex_);
    return wish_;
}

void LivePicture::give(LiveMade made) {
    {
        const std::lock_guard lock(mutex_);
        made_ = std::move(made);
    }
    if (wake_) wake_();
}

std::optional<LiveMade> LivePicture::take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(made_, std::nullopt);
}

void RunWishes::ask(const std::vector<RunWish>& wishes) {
    const std::lock_guard lock(mutex_);
    waiting_.insert(waiting_.end(), wishes.begin(), wishes.end());
}

std::vector<RunWish> RunWishes::take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(waiting_, {});
}

bool RunWishes::empty() const {
    const std::lock_guard lock(mutex_);
    return waiting_.empty();
}

LiveDrawer::LiveDrawer(Device& device, std::vector<View> views, const Bounds& bounds)
    : device_(&device), bounds_(bounds), picture_(device), panes_(device) {
    photos_.views = std::move(views);
}

bool LiveDrawer::draw(const GpuSplats& splats, LiveChange change, LivePicture& to) {
    const std::optional<LiveWish> wish = to.wished();
    if (!wish) return false;
    const bool other = !drawn_ || !(*drawn_ == *wish);
    const bool refine = !whole_ && seconds_since(drawn_at_) >= kUnchanged_s;
    const bool anew = change == LiveChange::at_once ||
                      (change == LiveChange::seldom && LiveClock::now() >= next_);
    if (!other && !refine && !anew) return false;
    const bool whole = !drawn_ || !other;
    LiveMade made = make(splats, *wish, whole);
    if (!whole && !compiled_ && made.error.empty())
        motion_.measured(motion_cost(made.ms, made.passes));
    drawn_ = wish;
    whole_ = whole;
    drawn_at_ = LiveClock::now();
    // what was compiled for it is compiled once
    const double share_s = compiled_ ? 0 : made.ms / 1000 / kDrawnShare;
    next_ = drawn_at_ + std::chrono::duration_cast<LiveClock::duration>(
                            std::chrono::duration<double>(std::max(kBetween_s, share_s)));
    to.give(std::move(made));
    return true;
}

LiveMade LiveDrawer::make(const GpuSplats& splats, const LiveWish& wish, bool whole) {
    LiveMade made;
    made.scene = live_scene(splats);
    made.whole = whole;
    made.quality = whole ? MotionQuality() : motion_.quality();
    device_->wait_idle();  // the run's own work does not count as the picture's time
    try {
        if (shown_ != &splats) picture_.set_live(splats, bounds_);
        shown_ = &splats;
        read_photo(wish, made);
        const auto start = LiveClock::now();
        const Camera camera = at_scale(wish.key.camera, made.quality.scale);
        const PaneWish pictures{camera, pane_displays(wish.key.display, wish.key.kernels_beside),
                                overlay_of(photos_, camera, wish.area),
                                photo_beside(photos_, wish.key.display),
                                whole ? std::nullopt : std::optional(made.quality.splats)};
        const bool panes = pictures.several();
        panes_.render(picture_, pictures);
        compiled_ = panes_.compiled();
        if (panes) {
            Panes layout = wish.panes;
            fit_lines(panes_.count(), layout, compared_strip(photos_, wish.key.display, wish.area));
            panes_.compose(layout, whole);
            if (whole) made.psnr_db = panes_.psnr_db();
        }
        made.width = camera.width;
        made.height = camera.height;
        made.pixels =
            (panes ? panes_.pixels() : picture_.pixels())
                .download<std::uint32_t>(std::size_t(camera.width) * std::size_t(camera.height));
        made.passes = panes_.pass_times();
        made.visible = picture_.status().visible;
        made.intersections = picture_.status().intersections;
        made.ms = seconds_since(start) * 1000;
    } catch (const DeviceLost&) {  // the run gets the same error
        throw;
    } catch (const Error& e) {
        made.error = e.what();
    }
    return made;
}

void LiveDrawer::read_photo(const LiveWish& wish, LiveMade& made) {
    photos_.current = wish.key.photo;
    photos_.compare = wish.key.photo_beside;
    const bool wanted = photos_.compare || wish.key.display.mode == VIEW_ERROR;
    if (wanted && photos_.current >= 0 && photos_.loaded != photos_.current) try {
            load_photo_of_view(*device_, photos_);
        } catch (const DeviceLost&) {
            throw;
        } catch (const Error& e) {
            made.error = e.what();
            photos_.compare = false;
        }
    made.photo = photos_.loaded;
}

}  // namespace darb
