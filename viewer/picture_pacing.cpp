// SPDX-License-Identifier: MIT
#include "viewer/picture_pacing.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <new>
#include <numbers>
#include <utility>

#include "engine/core/system.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/merge_splats.h"

namespace darb {

namespace {

constexpr int kSlowFrames = 2, kQuickFrames = 12;
// shares of the target: what a change aims at, and what counts as room for more
constexpr double kAim = 0.85, kRoom = 0.7;
constexpr double kMostUp = 2;                // largest factor of one change
constexpr double kPixelsWeight = 2.5;        // weight of the pixels in the error
constexpr int kScales = 8, kLeastScale = 2;  // eighths
constexpr double kLeastSplats = 10'000;

}  // namespace

MotionCost motion_cost(double frame_ms, std::span<const PassTime> passes) {
    MotionCost cost;
    for (const PassTime& pass : passes) {
        const bool of_splats =
            pass.name == "project" || pass.name == "compact" || pass.name == "depth sort";
        const bool of_pixels = pass.name == "blend" || pass.name == "display";
        const double share = of_splats ? 1 : of_pixels ? 0 : 0.5;
        cost.splats_ms += share * pass.ms;
        cost.pixels_ms += (1 - share) * pass.ms;
    }
    cost.fixed_ms = std::max(0.0, frame_ms - cost.splats_ms - cost.pixels_ms);
    return cost;
}

double motion_error(const MotionQuality& q) {
    return kPixelsWeight * (1 / (q.scale * q.scale) - 1) + 1 / q.splats - 1;
}

std::vector<double> motion_shares(std::size_t splats, double most) {
    std::vector<double> shares;
    const double least = (1 - 1e-9) * kLeastSplats / std::max(static_cast<double>(splats), 1.0);
    for (double share = most; share > 0 && (shares.empty() || share >= least);
         share /= std::numbers::sqrt2)
        shares.push_back(share);
    return shares;
}

void MotionControl::start(std::vector<double> shares) {
    *this = MotionControl(target_ms_);
    shares_ = std::move(shares);
    for (const double share : shares_)
        // about a quarter of the splats, or the nearest share there is
        if (share >= 0.2) quality_.splats = share;
    if (quality_.splats == 1 && !shares_.empty()) quality_.splats = shares_.front();
}

// Chooses by the time of the best of the last frames; where nothing fits, it takes the cheapest.
void MotionControl::choose(double room_ms) {
    const double splats_ms = best_.splats_ms / quality_.splats;
    const double pixels_ms = best_.pixels_ms / (quality_.scale * quality_.scale);
    std::vector<double> shares = {1};
    shares.insert(shares.end(), shares_.begin(), shares_.end());
    double largest = kMostUp * quality_.splats;  // or the next share, where that is farther away
    for (const double share : shares)
        if (share > quality_.splats) largest = std::max(kMostUp * quality_.splats, share);
    const MotionQuality now = quality_;
    double best_error = 0, least_ms = 0;
    bool any_fits = false, first = true;
    for (const double share : shares)
        for (int eighths = kLeastScale; eighths <= kScales; ++eighths) {
            const MotionQuality q{static_cast<double>(eighths) / kScales, share};
            const double ms = splats_ms * q.splats + pixels_ms * q.scale * q.scale;
            if (share > largest || q.scale > kMostUp * now.scale) continue;
            const bool fits = ms <= room_ms;
            const double error = motion_error(q);
            if (fits ? !any_fits || error < best_error : !any_fits && (first || ms < least_ms)) {
                quality_ = q;
                best_error = error;
            }
            least_ms = first ? ms : std::min(least_ms, ms);
            any_fits |= fits;
            first = false;
        }
}

void MotionControl::measured(const MotionCost& cost) {
    const double ms = cost.total_ms();
    if (!(ms > 0)) return;
    const bool slow = ms > target_ms_, quick = ms < kRoom * target_ms_;
    const bool first = slow ? slow_ == 0 : quick_ == 0;
    slow_ = slow ? slow_ + 1 : 0;
    quick_ = quick ? quick_ + 1 : 0;
    if (first || ms < best_.total_ms()) best_ = cost;
    if (slow_ < kSlowFrames && quick_ < kQuickFrames) return;
    slow_ = quick_ = 0;
    // Where panels and presentation leave nothing, the picture still gets a fifth of the time.
    const double room_ms = std::max(kAim * target_ms_ - best_.fixed_ms, 0.2 * target_ms_);
    const bool fits = best_.splats_ms + best_.pixels_ms <= room_ms;
    if (slow != fits) choose(room_ms);
}

namespace {

constexpr double kRest_s = 0.12;  // time without change before the picture is refined
constexpr double kForever = std::numeric_limits<double>::infinity();

double seconds_between(PicturePacing::Time from, PicturePacing::Time to) {
    return std::chrono::duration<double>(to - from).count();
}

}  // namespace

bool PictureKey::operator==(const PictureKey& o) const {
    const Camera &a = camera, &b = o.camera;
    return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy &&
           a.cx == b.cx && a.cy == b.cy && a.rotation == b.rotation &&
           a.translation == b.translation && display == o.display && photo == o.photo &&
           photo_beside == o.photo_beside && kernels_beside == o.kernels_beside &&
           version == o.version;
}

PictureStep PicturePacing::next(const PictureKey& key, const Frame& frame, Time now) {
    last_.version = key.version;  // an edit or a training step is not motion
    if (!(key == last_)) changed_at_ = now;
    last_ = key;
    const bool refine =
        frame.whole_at_once || !drawn_ || seconds_between(changed_at_, now) >= kRest_s;
    step_ = PictureStep::none;
    if (frame.works) return step_;  // its pictures are shown as they come
    if (is_whole()) {
        if (frame.may_rehearse && !frame.whole_at_once) step_ = PictureStep::rehearsal;
    } else if (!refine) {
        if (!is_drawn()) step_ = PictureStep::in_motion;
    } else if (frame.preview_pays && !frame.whole_at_once && !refined()) {
        step_ = PictureStep::preview;
    } else {
        step_ = PictureStep::whole;
    }
    return step_;
}

void PicturePacing::drew(PictureStep step, const MotionQuality& quality) {
    drawn_ = last_;
    missed_ = false;
    drawn_as_ = step;
    all_pixels_ = step != PictureStep::in_motion || quality.scale == 1;
}

void PicturePacing::failed() {
    drawn_ = last_;
    missed_ = false;
    drawn_as_ = PictureStep::whole;
    all_pixels_ = true;
}

bool PicturePacing::refined() const {
    return is_drawn() && all_pixels_;
}

bool PicturePacing::is_whole() const {
    return is_drawn() && drawn_as_ == PictureStep::whole;
}

double PicturePacing::seconds_to_refine(Time now) const {
    if (drawn_as_ == PictureStep::whole) return kForever;
    return std::max(0.001, kRest_s - seconds_between(changed_at_, now));
}

double PicturePacing::count_still_frame() {
    unsettled_ = step_ == PictureStep::whole ? kSettlingFrames : std::max(unsettled_ - 1, 0);
    return unsettled_ > 0 ? 0 : kForever;
}

namespace {

struct LevelsCancelled {};

constexpr int kQuickNice = 5, kNice = 15;  // lower priority than the pictures

SplatModel without(const SplatModel& model, const std::vector<std::uint8_t>& removed) {
    SplatModel kept = model;
    if (!removed.empty()) keep_splats([&](std::size_t i) { return removed[i] == 0; }, kept);
    return kept;
}

}  // namespace

MotionLevels::MotionLevels(const SplatModel& model, const std::vector<std::uint8_t>& removed,
                           std::vector<std::size_t> counts, std::function<void()> wake)
    : model_(without(model, removed)),
      counts_(std::move(counts)),
      wake_(std::move(wake)),
      thread_([this] { run(); }) {}

MotionLevels::~MotionLevels() {
    cancel();
    thread_.join();
}

void MotionLevels::run() {
    try {
        make_levels(true);
        make_levels(false);
    } catch (const LevelsCancelled&) {
    } catch (const std::bad_alloc&) {  // the important splats do without levels
    }
    model_ = SplatModel();
    done_ = true;
    if (wake_) wake_();
}

void MotionLevels::make_levels(bool quick) {
    lower_thread_priority(quick ? kQuickNice : kNice);
    const MergeOptions options{.threads = 1, .quick = quick, .progress = [this](double) {
                                   if (cancelled_) throw LevelsCancelled();
                               }};
    SplatModel last;
    for (std::size_t i = 0; i < counts_.size(); ++i) {
        if (cancelled_) throw LevelsCancelled();
        last = merge_splats(i == 0 ? model_ : last, counts_[i], options);
        if (!quick && i == 0) model_ = SplatModel();
        {
            const std::lock_guard lock(mutex_);
            ready_.push_back(last);
        }
        if (wake_) wake_();
    }
}

std::optional<SplatModel> MotionLevels::take() {
    const std::lock_guard lock(mutex_);
    if (ready_.empty()) return {};
    SplatModel level = std::move(ready_.front());
    ready_.pop_front();
    return level;
}

// Functions are looked up in the libraries that are loaded: GLFW may be built without X11, and an
// older libX11 lacks one of them.

namespace {

constexpr std::size_t kRequestRoom = 1
                                     << 20;  // bytes: requests of a window's end take some hundred

// The beginning of Xlib's Display (X11/Xlib.h: _XPrivDisplay, with the names of X11/Xlibint.h).
struct DisplayHead {
    void *extensions, *free_functions;
    int socket, connection_index, major_version, minor_version;
    char* vendor;
    unsigned long id_base, id_mask, next_id;
    int id_shift;
    void (*id_allocator)();
    int byte_order, bitmap_unit, bitmap_pad, bitmap_order, format_count;
    void* formats;
    int vendor_number, release;
    void *queue_head, *queue_tail;
    int queue_length;
    unsigned long last_read, last_sent;
    char *last_request, *buffer, *end, *limit;  // the requests that wait to be sent
};

// Once Xcb has the connection back and it is dead, requests find no room, and Xlib returns a null
// pointer that its own functions do not check. This gives them room; nothing that is written there
// is sent.
void make_room(void* display) {
    auto* const head = static_cast<DisplayHead*>(display);
    auto* const room = static_cast<char*>(std::malloc(kRequestRoom));  // XCloseDisplay frees it
    if (room == nullptr) return;
    std::free(head->buffer);
    head->buffer = head->end = head->last_request = room;
    head->limit = room + kRequestRoom;
}

void note_loss(void* display, void* user) {
    *static_cast<std::atomic<bool>*>(user) = true;
    make_room(display);
}

}  // namespace

bool survive_display_loss(std::atomic<bool>& lost) {
    using GetDisplay = void* (*)();
    using OnExit = void (*)(void* display, void* user);
    using SetOnExit = void (*)(void* display, OnExit on_exit, void* user);
    constexpr const char* kX11 = "libX11.so.6";
    const auto get_display =
        reinterpret_cast<GetDisplay>(loaded_function(nullptr, "glfwGetX11Display"));
    if (get_display == nullptr) return false;
    const auto set = reinterpret_cast<SetOnExit>(loaded_function(kX11, "XSetIOErrorExitHandler"));
    using OnError = int (*)(void* display);
    using SetOnError = OnError (*)(OnError on_error);
    const auto set_on_error =
        reinterpret_cast<SetOnError>(loaded_function(kX11, "XSetIOErrorHandler"));
    void* const display = set != nullptr && set_on_error != nullptr ? get_display() : nullptr;
    if (display == nullptr) return false;
    // The first handler ends the process unless it is replaced; the second one does so if the first
    // returns.
    set_on_error([](void*) { return 0; });
    set(display, note_loss, &lost);
    return true;
}

}  // namespace darb
