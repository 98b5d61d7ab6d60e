// SPDX-License-Identifier: MIT
#include "engine/data/panorama_cameras.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <glm/gtc/quaternion.hpp>
#include <map>
#include <mutex>
#include <numbers>
#include <thread>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/on_threads.h"
#include "engine/core/process.h"
#include "engine/core/quantile.h"
#include "engine/data/colmap.h"
#include "engine/data/image_io.h"
#include "engine/data/masks.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr int kMostViewSide = 1600;  // px; finer views cost COLMAP time and gain no cameras
constexpr int kViewQuality = 95;     // of the JPEG files
constexpr double kAgreeDegrees = 2;
constexpr double kAgreeReach = 0.1;   // of the median distance to the next panorama
constexpr double kEnoughViews = 0.5;  // share of the views; fewer, and COLMAP tries harder
constexpr const char* kMadeBy = "# Written by darb\n";

/// A view of the folder that COLMAP gets: which panorama it is of, and which view of that.
struct ViewSource {
    std::size_t panorama = 0, view = 0;
};

std::string view_name(const std::string& panorama, std::size_t view) {
    const fs::path name = panorama;
    return (name.parent_path() /
            fmt::format("{}@{}.jpg", name.stem().string(), panorama_views()[view].name))
        .generic_string();
}

double degrees_between(const glm::dmat3& a, const glm::dmat3& b) {
    const glm::dmat3 turn = a * glm::transpose(b);
    const double cosine = (turn[0][0] + turn[1][1] + turn[2][2] - 1) / 2;
    return glm::degrees(std::acos(std::clamp(cosine, -1.0, 1.0)));
}

bool agrees(const PanoramaPose& a, const PanoramaPose& b, double reach) {
    return degrees_between(a.rotation, b.rotation) <= kAgreeDegrees &&
           glm::distance(a.centre(), b.centre()) <= reach;
}

/// The mean of poses that agree.
PanoramaPose mean_pose(const std::vector<PanoramaPose>& poses) {
    const glm::dquat first = glm::quat_cast(poses.front().rotation);
    glm::dvec4 turn(0.0);
    glm::dvec3 centre(0.0);
    for (const PanoramaPose& pose : poses) {
        const glm::dquat q = glm::quat_cast(pose.rotation);
        const double sign = glm::dot(q, first) < 0 ? -1 : 1;
        turn += sign * glm::dvec4(q.w, q.x, q.y, q.z);
        centre += pose.centre();
    }
    turn = glm::normalize(turn);
    centre /= static_cast<double>(poses.size());
    PanoramaPose mean;
    mean.rotation = glm::mat3_cast(glm::dquat(turn.x, turn.y, turn.z, turn.w));
    mean.translation = -(mean.rotation * centre);
    mean.agree = poses.size();
    return mean;
}

}  // namespace

const std::array<CubeFace, kPanoramaViews>& panorama_views() {
    static const auto views = [] {
        constexpr std::array<std::string_view, kPanoramaViews> names{"000", "060", "120",
                                                                     "180", "240", "300"};
        std::array<CubeFace, kPanoramaViews> all;
        for (std::size_t v = 0; v < kPanoramaViews; ++v) {
            const double angle = 2 * std::numbers::pi * double(v) / double(kPanoramaViews);
            const double s = std::sin(angle), c = std::cos(angle);
            // Rows: right, down and ahead of the view, which is turned to the right by the angle.
            all[v] = {names[v], glm::transpose(glm::dmat3(glm::dvec3(c, 0, -s), glm::dvec3(0, 1, 0),
                                                          glm::dvec3(s, 0, c)))};
        }
        return all;
    }();
    return views;
}

std::optional<PanoramaPose> agreed_pose(std::span<const PanoramaPose> views, double reach) {
    std::vector<PanoramaPose> best;
    for (const PanoramaPose& middle : views) {
        std::vector<PanoramaPose> near;
        for (const PanoramaPose& other : views)
            if (agrees(middle, other, reach)) near.push_back(other);
        if (near.size() > best.size()) best = std::move(near);
    }
    if (best.empty()) return std::nullopt;
    return mean_pose(best);
}

std::vector<std::pair<std::size_t, std::size_t>> panorama_pairs(std::size_t count,
                                                                bool neighbours) {
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    for (std::size_t i = 0; i < count; ++i) {
        if (!neighbours) {
            for (std::size_t j = i + 1; j < count; ++j) pairs.emplace_back(i, j);
            continue;
        }
        constexpr std::size_t kNext = 4;
        for (std::size_t step = 1; i + step < count; step = step < kNext ? step + 1 : 2 * step)
            pairs.emplace_back(i, i + step);
    }
    return pairs;
}

namespace {

/// The state of one call of find_panorama_cameras.
class PanoramaCameras {
  public:
    PanoramaCameras(const ColmapRun& run, const std::vector<std::string>& names,
                    const ColmapReports& reports)
        : run_(run), names_(names), reports_(reports) {
        for (std::size_t p = 0; p < names.size(); ++p)
            for (std::size_t v = 0; v < kPanoramaViews; ++v)
                sources_[view_name(names[p], v)] = {p, v};
        if (sources_.size() != names.size() * kPanoramaViews)
            throw Error(run.photos.string(),
                        "has panoramas whose names differ only in their extensions",
                        "Rename one of each pair.");
    }
    fs::path data_set();

  private:
    int view_side();
    void cut_views(int side) const;
    std::vector<View> masked() const;
    void cut_masks(int side, const fs::path& masks) const;
    void write_pairs(const fs::path& file) const;
    using Poses = std::vector<std::optional<PanoramaPose>>;
    Poses poses_of(const ColmapModel& model) const;
    std::string points_text(const ColmapModel& model, const Poses& poses,
                            std::vector<std::string>& observed) const;
    void write_data_set(const ColmapModel& model) const;
    void link_photos(const fs::path& from, const fs::path& to,
                     const std::vector<std::string>& names) const;
    void note(const std::string& text) const {
        if (reports_.note) reports_.note(text);
    }

    const ColmapRun& run_;
    const std::vector<std::string>& names_;
    const ColmapReports& reports_;
    std::map<std::string, ViewSource> sources_;  // by the view's name
    std::vector<std::pair<int, int>> sizes_;     // of the panoramas, px
    fs::path cut_ = run_.workspace / "views", inner_ = run_.workspace / "of_views";
};

// All views have one size, so that COLMAP has one camera: that of the smallest panorama.
int PanoramaCameras::view_side() {
    int side = kMostViewSide;
    for (const std::string& name : names_) {
        const ImageInfo info = read_image_info(run_.photos / name);
        if (info.width != 2 * info.height)
            throw Error((run_.photos / name).string(),
                        fmt::format("the panorama is {} x {} px, and one of all directions is "
                                    "twice as wide as high",
                                    info.width, info.height),
                        "Leave it out, or use --panoramas off for flat photos.");
        sizes_.emplace_back(info.width, info.height);
        side = std::min(side, face_size(info.width));
    }
    return side;
}

// The panoramas with the masks that add_masks finds for them.
std::vector<View> PanoramaCameras::masked() const {
    Dataset dataset;
    for (const std::string& name : names_) {
        View& view = dataset.views.emplace_back();
        view.name = name;
        view.photo = run_.photos / name;
    }
    add_masks(run_.photos.parent_path(), {}, dataset);
    std::erase_if(dataset.views, [](const View& view) { return view.mask.empty(); });
    return std::move(dataset.views);
}

void PanoramaCameras::cut_masks(int side, const fs::path& masks) const {
    for (const View& view : masked()) {
        ImageU8 seen = to_rgba(read_image(view.photo));
        std::ranges::fill(seen.data, std::uint8_t{255});
        apply_mask(seen, read_image(view.mask));
        for (std::size_t v = 0; v < kPanoramaViews; ++v) {
            const ImageU8 cut = cut_face(seen, panorama_views()[v], side);
            ImageU8 mask(side, side, 1);
            for (std::size_t i = 0; i < mask.data.size(); ++i)
                mask.data[i] = cut.data[4 * i + 3] < 128 ? 0 : 255;
            write_png(masks / (view_name(view.name, v) + ".png"), mask);
        }
    }
}

void PanoramaCameras::cut_views(int side) const {
    if (fs::exists(cut_)) return;
    note(
        fmt::format("Each panorama is cut into {} views of {} px, whose cameras COLMAP looks for. "
                    "{} panoramas are compared with each other.",
                    kPanoramaViews, side, run_.sequential ? "Neighbouring" : "All"));
    const fs::path unfinished = run_.workspace / "views.unfinished";
    fs::remove_all(unfinished);
    std::atomic<std::size_t> next{0};
    std::exception_ptr failure;
    std::mutex lock;
    const auto work = [&] {
        for (std::size_t p = next++; p < names_.size(); p = next++) try {
                if (run_.stop && run_.stop->load()) return;
                const ImageU8 photo = to_rgba(read_image(run_.photos / names_[p]));
                for (std::size_t v = 0; v < kPanoramaViews; ++v)
                    write_file_atomic(
                        unfinished / "photos" / view_name(names_[p], v),
                        encode_jpeg(cut_face(photo, panorama_views()[v], side), kViewQuality));
            } catch (...) {
                const std::lock_guard held(lock);
                failure = std::current_exception();
                return;
            }
    };
    on_threads(std::max(1u, std::thread::hardware_concurrency()), work);
    if (failure) std::rethrow_exception(failure);
    if (run_.stop && run_.stop->load()) throw ColmapStopped{};
    if (!run_.masks.empty()) cut_masks(side, unfinished / "masks");
    write_pairs(unfinished / "pairs.txt");
    fs::rename(unfinished, cut_);
}

// Neighbouring views of one panorama show no depth, as they stand in one place, but what both see
// ties what is ahead to what is behind.
void PanoramaCameras::write_pairs(const fs::path& file) const {
    std::string text;
    for (const std::string& name : names_)
        for (std::size_t a = 0; a < kPanoramaViews; ++a)
            text += view_name(name, a) + " " + view_name(name, (a + 1) % kPanoramaViews) + "\n";
    for (const auto& [first, second] : panorama_pairs(names_.size(), run_.sequential))
        for (std::size_t a = 0; a < kPanoramaViews; ++a)
            for (std::size_t b = 0; b < kPanoramaViews; ++b)
                text += view_name(names_[first], a) + " " + view_name(names_[second], b) + "\n";
    write_file_atomic(file, text);
}

PanoramaCameras::Poses PanoramaCameras::poses_of(const ColmapModel& model) const {
    std::vector<std::vector<PanoramaPose>> said(names_.size());
    for (const ColmapImage& image : model.images) {
        const auto at = sources_.find(image.name);
        if (at == sources_.end()) continue;
        const glm::dmat3 back = glm::transpose(panorama_views()[at->second.view].rotation);
        said[at->second.panorama].push_back({back * image.rotation, back * image.translation, 1});
    }
    std::vector<double> steps;  // from each panorama to the next that COLMAP found
    std::optional<glm::dvec3> last;
    for (const auto& views : said) {
        if (views.empty()) continue;
        if (last) steps.push_back(glm::distance(*last, views.front().centre()));
        last = views.front().centre();
    }
    const double reach = steps.empty() ? 0 : kAgreeReach * median(steps);
    Poses poses;
    std::size_t lonely = 0, differ = 0;
    for (const auto& views : said) {
        poses.push_back(agreed_pose(views, reach));
        if (views.size() == 1) ++lonely;
        if (poses.back()) differ += views.size() - poses.back()->agree;
    }
    note(
        fmt::format("COLMAP placed {} of {} views; {} of them contradict the others of their "
                    "panoramas and do not count; {} panoramas have a single view.",
                    model.images.size(), sources_.size(), differ, lonely));
    return poses;
}

void PanoramaCameras::link_photos(const fs::path& from, const fs::path& to,
                                  const std::vector<std::string>& names) const {
    for (const std::string& name : names) {
        fs::create_directories((to / name).parent_path());
        std::error_code cannot;  // another disk, or a system without such links
        fs::create_hard_link(from / name, to / name, cannot);
        if (cannot) fs::copy_file(from / name, to / name);
    }
}

// The points with their tracks; `observed` gets, for each panorama, where it sees them.
std::string PanoramaCameras::points_text(const ColmapModel& model, const Poses& poses,
                                         std::vector<std::string>& observed) const {
    std::map<std::uint32_t, ViewSource> by_id;
    for (const ColmapImage& image : model.images)
        if (const auto at = sources_.find(image.name); at != sources_.end())
            by_id[image.id] = at->second;
    std::vector<std::size_t> counts(names_.size());
    std::string text = kMadeBy;
    const PointCloud& cloud = model.points;
    for (std::size_t p = 0; cloud.has_tracks() && p < cloud.size(); ++p) {
        std::map<std::size_t, std::size_t> track;  // number of the observation, by panorama
        for (std::size_t k = cloud.seen_begin[p]; k < cloud.seen_begin[p + 1]; ++k) {
            const auto at = by_id.find(cloud.seen_by[k]);
            if (at == by_id.end()) continue;
            const auto [panorama, view] = at->second;
            if (!poses[panorama] || track.contains(panorama)) continue;  // or in two of its views
            const glm::dvec3 ray(2.0 * cloud.seen_at[2 * k] - 1, 2.0 * cloud.seen_at[2 * k + 1] - 1,
                                 1);
            const glm::dvec2 pixel =
                panorama_pixel(glm::transpose(panorama_views()[view].rotation) * ray,
                               sizes_[panorama].first, sizes_[panorama].second);
            if (!std::isfinite(pixel.x) || !std::isfinite(pixel.y)) continue;
            observed[panorama] += fmt::format("{:.4f} {:.4f} {} ", pixel.x, pixel.y, p + 1);
            track[panorama] = counts[panorama]++;
        }
        if (track.empty()) continue;
        text += fmt::format("{} {:.9g} {:.9g} {:.9g} {} {} {} 0", p + 1, cloud.position[3 * p],
                            cloud.position[3 * p + 1], cloud.position[3 * p + 2],
                            cloud.colour[3 * p], cloud.colour[3 * p + 1], cloud.colour[3 * p + 2]);
        for (const auto& [panorama, number] : track)
            text += fmt::format(" {} {}", panorama + 1, number);
        text += "\n";
    }
    return text;
}

void PanoramaCameras::write_data_set(const ColmapModel& model) const {
    const Poses poses = poses_of(model);
    std::vector<std::string> observed(names_.size()), found;
    const std::string points = points_text(model, poses, observed);
    std::map<std::pair<int, int>, std::size_t> cameras;  // by size
    std::string lens = kMadeBy, images = kMadeBy;
    for (std::size_t p = 0; p < names_.size(); ++p) {
        if (!poses[p]) continue;
        const auto [camera, is_new] = cameras.try_emplace(sizes_[p], cameras.size() + 1);
        if (is_new)
            lens += fmt::format("{0} EQUIRECTANGULAR {1} {2} {1} {2}\n", camera->second,
                                sizes_[p].first, sizes_[p].second);
        const glm::dquat q = glm::quat_cast(poses[p]->rotation);
        const glm::dvec3& t = poses[p]->translation;
        images += fmt::format(
            "{} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {} {}\n{}\n", p + 1, q.w,
            q.x, q.y, q.z, t.x, t.y, t.z, camera->second, names_[p], observed[p]);
        found.push_back(names_[p]);
    }
    const fs::path dense = run_.workspace / "dense",
                   unfinished = run_.workspace / "dense.unfinished";
    fs::remove_all(unfinished);
    write_file_atomic(unfinished / "sparse" / "cameras.txt", lens);
    write_file_atomic(unfinished / "sparse" / "images.txt", images);
    write_file_atomic(unfinished / "sparse" / "points3D.txt", points);
    link_photos(run_.photos, unfinished / "images", found);
    if (!run_.masks.empty())
        for (const View& view : masked())
            write_png(unfinished / "masks" / (view.name + ".png"), read_image(view.mask));
    fs::remove_all(dense);
    fs::rename(unfinished, dense);
}

fs::path PanoramaCameras::data_set() {
    if (!is_installed("colmap"))
        throw Error(run_.photos.string(),
                    "holds panoramas without cameras, and colmap is not installed",
                    "Install it (apt install colmap), or find their cameras with COLMAP 4.1 or "
                    "later, whose EQUIRECTANGULAR cameras are read.");
    const int side = view_side();
    cut_views(side);
    ColmapRun views = run_;
    views.photos = cut_ / "photos";
    views.masks = run_.masks.empty() ? fs::path() : cut_ / "masks";
    views.workspace = inner_;
    views.count = sources_.size();
    views.pairs = cut_ / "pairs.txt";
    views.pinhole = side;
    views.enough = kEnoughViews;
    const fs::path model = run_colmap(views, reports_);
    write_data_set(read_colmap(model));
    return run_.workspace / "dense";
}

}  // namespace

fs::path find_panorama_cameras(const ColmapRun& run, const std::vector<std::string>& names,
                               const ColmapReports& reports) try {
    return PanoramaCameras(run, names, reports).data_set();
} catch (const fs::filesystem_error& error) {
    throw Error(error.path1().string(), error.code().message(),
                "Name an output folder where files can be written.");
}

}  // namespace darb
