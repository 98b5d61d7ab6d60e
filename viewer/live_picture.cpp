#include "viewer/live_picture.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/core/error.h"

namespace darb {

namespace {

constexpr double kDrawnShare = 0.1;    // of the time, that pictures may take from training
constexpr double kBetween_s = 0.2;     // two pictures of splats that change
constexpr double kUnchanged_s = 0.12;  // a wish, before the whole picture of it

double seconds_from(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

Camera at_scale(const Camera& camera, double scale) {
    const auto px = [&](int full) {
        return std::max(1, static_cast<int>(std::lround(full * scale)));
    };
    return scale == 1 ? camera : resized(camera, px(camera.width), px(camera.height));
}

}  // namespace

bool LiveWish::operator==(const LiveWish& o) const {
    return key == o.key && area.left == o.area.left && compare == o.compare &&
           panes.lines == o.panes.lines && panes.difference == o.panes.difference &&
           panes.difference_max == o.panes.difference_max;
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

LiveDrawer::LiveDrawer(Device& device, std::vector<View> views, const Bounds& bounds)
    : device_(&device), bounds_(bounds), picture_(device), panes_(device) {
    photos_.views = std::move(views);
}

bool LiveDrawer::draw(const GpuSplats& splats, LiveChange change, LivePicture& to) {
    const std::optional<LiveWish> wish = to.wished();
    if (!wish) return false;
    const bool other = !drawn_ || !(*drawn_ == *wish);
    const bool refine = !whole_ && seconds_from(drawn_at_) >= kUnchanged_s;
    const bool anew = change == LiveChange::at_once ||
                      (change == LiveChange::seldom && LiveClock::now() >= next_);
    if (!other && !refine && !anew) return false;
    const bool whole = !drawn_ || !other;
    LiveMade made = make(splats, *wish, whole ? MotionQuality() : motion_.quality());
    if (!whole && !picture_.compiled()) motion_.measured(motion_cost(made.ms, made.passes));
    drawn_ = wish;
    whole_ = whole;
    drawn_at_ = LiveClock::now();
    next_ = drawn_at_ +
            std::chrono::duration_cast<LiveClock::duration>(
                std::chrono::duration<double>(std::max(kBetween_s, made.ms / 1000 / kDrawnShare)));
    to.give(std::move(made));
    return true;
}

LiveMade LiveDrawer::make(const GpuSplats& splats, const LiveWish& wish,
                          const MotionQuality& quality) {
    LiveMade made;
    made.scene = live_scene(splats);
    made.quality = quality;
    try {
        if (shown_ != &splats) picture_.set_live(splats, bounds_);
        shown_ = &splats;
        read_photo(wish, made);
        const auto start = LiveClock::now();
        const Camera camera = at_scale(wish.key.camera, quality.scale);
        const PhotoOverlay photo = overlay_of(photos_, camera, wish.area);
        std::vector<DisplaySettings> displays{wish.key.display};
        for (const int kernel : wish.key.kernels_beside)
            displays.emplace_back(wish.key.display).kernel = kernel;
        const bool photo_first = photo_beside(photos_, wish.key.display);
        const bool panes = photo_first || displays.size() > 1;
        const std::optional<double> moving =
            quality.scale < 1 ? std::optional(quality.splats) : std::nullopt;
        if (panes) {
            panes_.render(picture_, camera, displays, photo, photo_first, moving);
            Panes layout = wish.panes;
            fit_lines(panes_.count(), layout,
                      static_cast<float>(wish.area.left) / static_cast<float>(wish.area.width));
            panes_.compose(layout);
            if (!moving) made.psnr_db = panes_.psnr_db();
        } else {
            picture_.keep_panes(1);
            picture_.render(camera, displays.front(), photo, moving);
        }
        made.width = camera.width;
        made.height = camera.height;
        made.pixels =
            (panes ? panes_.pixels() : picture_.pixels())
                .download<std::uint32_t>(std::size_t(camera.width) * std::size_t(camera.height));
        made.passes = panes ? panes_.pass_times() : picture_.pass_times();
        made.visible = picture_.status().visible;
        made.intersections = picture_.status().intersections;
        made.ms = seconds_from(start) * 1000;
    } catch (const Error& e) {
        made.error = e.what();
    }
    return made;
}

void LiveDrawer::read_photo(const LiveWish& wish, LiveMade& made) {
    photos_.current = wish.key.photo;
    photos_.compare = wish.compare;
    const bool wanted = wish.compare || wish.key.display.mode == VIEW_ERROR;
    if (wanted && photos_.current >= 0 && photos_.loaded != photos_.current) try {
            load_photo_of_view(*device_, photos_);
        } catch (const Error& e) {
            made.error = e.what();
            photos_.compare = false;
        }
    made.photo = photos_.loaded;
}

}  // namespace darb
