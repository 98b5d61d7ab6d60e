// SPDX-License-Identifier: MIT
#include "viewer/camera_path.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/core/quantile.h"
#include "engine/data/camera_list.h"
#include "engine/scene/subject.h"
#include "viewer/bounds.h"

namespace darb {

namespace {

constexpr double kLongest_s = 24 * 60 * 60;  // times of day and times since 1970 are longer

// Position, field of view and quaternion as one vector of eight numbers. The field of view is
// stored as ln tan(fov / 2), so that it stays between 0 and 180 degrees whatever a curve does
// between two keys.
using Row = std::array<double, 8>;

Row row_of(const KeyFrame& key, const glm::dquat& near_to) {
    const glm::dquat q =
        glm::dot(key.orientation, near_to) < 0 ? -key.orientation : key.orientation;
    return {key.eye.x, key.eye.y, key.eye.z, std::log(std::tan(key.fov_y / 2)), q.w, q.x, q.y, q.z};
}

KeyFrame key_of(const Row& row, double seconds) {
    KeyFrame key;
    key.seconds = seconds;
    key.eye = {row[0], row[1], row[2]};
    key.fov_y = 2 * std::atan(std::exp(row[3]));
    key.orientation = glm::normalize(glm::dquat(row[4], row[5], row[6], row[7]));
    return key;
}

double slope(double before, double t0, double after, double t1) {
    return t1 > t0 ? (after - before) / (t1 - t0) : 0;
}

}  // namespace

void CameraPath::add(const Navigation& view, double seconds) {
    KeyFrame key;
    key.seconds = keys.empty() ? 0 : duration() + seconds;
    key.eye = view.eye;
    key.orientation = glm::quat_cast(view.axes);
    key.fov_y = view.fov_y;
    keys.push_back(key);
}

KeyFrame CameraPath::sample(double seconds) const {
    DARB_CHECK(!keys.empty());
    if (!(seconds > keys.front().seconds)) return keys.front();
    if (seconds >= keys.back().seconds) return keys.back();
    const auto next = std::upper_bound(keys.begin(), keys.end(), seconds,
                                       [](double t, const KeyFrame& k) { return t < k.seconds; });
    const size_t b = static_cast<size_t>(next - keys.begin()), a = b - 1;
    const size_t before = a > 0 ? a - 1 : a, after = std::min(b + 1, keys.size() - 1);
    const glm::dquat reference = keys[a].orientation;
    const Row r0 = row_of(keys[before], reference), r1 = row_of(keys[a], reference);
    const glm::dquat end(row_of(keys[b], reference)[4], row_of(keys[b], reference)[5],
                         row_of(keys[b], reference)[6], row_of(keys[b], reference)[7]);
    const Row r2 = row_of(keys[b], reference), r3 = row_of(keys[after], end);
    const double span = keys[b].seconds - keys[a].seconds, t = (seconds - keys[a].seconds) / span;
    const double h0 = (1 + 2 * t) * (1 - t) * (1 - t), h1 = t * (1 - t) * (1 - t);
    const double h2 = t * t * (3 - 2 * t), h3 = t * t * (t - 1);
    Row out{};
    for (size_t i = 0; i < out.size(); ++i) {
        const double m1 = slope(r0[i], keys[before].seconds, r2[i], keys[b].seconds);
        const double m2 = slope(r1[i], keys[a].seconds, r3[i], keys[after].seconds);
        out[i] = h0 * r1[i] + h1 * span * m1 + h2 * r2[i] + h3 * span * m2;
    }
    return key_of(out, seconds);
}

void apply(const KeyFrame& key, Navigation& view) {
    view.eye = key.eye;
    view.axes = glm::mat3_cast(key.orientation);
    view.fov_y = key.fov_y;
}

void write_camera_path(const std::filesystem::path& file, const CameraPath& path) {
    nlohmann::json list = nlohmann::json::array();
    for (const KeyFrame& k : path.keys)
        list.push_back(
            {{"seconds", k.seconds},
             {"eye", {k.eye.x, k.eye.y, k.eye.z}},
             {"orientation", {k.orientation.w, k.orientation.x, k.orientation.y, k.orientation.z}},
             {"fov_y_degrees", glm::degrees(k.fov_y)}});
    write_file_atomic(file, nlohmann::json{{"key_frames", list}}.dump(1));
}

namespace {

CameraPath path_of(const NerfstudioPath& other) {
    CameraPath path;
    path.width = other.views[0].camera.width;
    path.height = other.views[0].camera.height;
    path.fps = other.fps;
    path.notes = other.notes;
    for (const View& view : other.views) {
        KeyFrame key;
        key.seconds = static_cast<double>(path.keys.size()) / other.fps;
        key.eye = view.camera.centre();
        key.orientation = glm::normalize(glm::quat_cast(glm::transpose(view.camera.rotation)));
        key.fov_y = 2 * std::atan(0.5 * view.camera.height / view.camera.fy);
        path.keys.push_back(key);
    }
    return path;
}

}  // namespace

CameraPath read_camera_path(const std::filesystem::path& file) {
    CameraPath path;
    const std::string hint =
        "A path is written by the viewer's panel \"Camera path\", or is a camera_path.json of "
        "nerfstudio.";
    const std::string text = read_text_file(file);
    const auto json = parse_json_text(text, file.string(), hint);
    if (const auto other = parse_nerfstudio_path(text, file.string())) path = path_of(*other);
    path.file = file;
    if (!path.keys.empty()) return path;
    if (!json.is_object() || !json.contains("key_frames") || !json["key_frames"].is_array())
        throw Error(file.string(),
                    "is not a camera path: it has neither key_frames nor camera_path",
                    json.is_array() || (json.is_object() && json.contains("frames"))
                        ? "It lists cameras: use it with --cameras."
                        : hint);
    try {
        for (const auto& k : json.at("key_frames")) {
            const auto eye = k.at("eye").get<std::array<double, 3>>();
            const auto q = k.at("orientation").get<std::array<double, 4>>();
            KeyFrame key;
            key.seconds = k.at("seconds").get<double>();
            key.eye = {eye[0], eye[1], eye[2]};
            key.orientation = glm::dquat(q[0], q[1], q[2], q[3]);
            key.fov_y = glm::radians(k.at("fov_y_degrees").get<double>());
            const std::string where = fmt::format("{}, key {}", file.string(), path.keys.size());
            if (!(key.seconds >= 0 && key.seconds <= kLongest_s))
                throw Error(
                    where, fmt::format("its time is {} s; 0 to {} can be", key.seconds, kLongest_s),
                    "Count the seconds from the start of the path.");
            if (!path.keys.empty() && key.seconds <= path.keys.back().seconds)
                throw Error(where, "its time is not after that of the previous key", hint);
            if (!(glm::length(key.orientation) > 1e-6))
                throw Error(where, "its orientation is not a quaternion", hint);
            if (!(key.fov_y > 0 && key.fov_y < glm::pi<double>()))
                throw Error(where, "its field of view is not between 0 and 180 degrees", hint);
            key.orientation = glm::normalize(key.orientation);
            path.keys.push_back(key);
        }
    } catch (const nlohmann::json::exception& e) {
        throw Error(file.string(), fmt::format("key {} {}", path.keys.size(), json_reason(e)),
                    hint);
    }
    if (path.keys.empty()) throw Error(file.string(), "has no key frames", hint);
    return path;
}

namespace {

constexpr double kAbove = glm::radians(15.0), kHighest = glm::radians(75.0);
constexpr double kFilledByTurn = 0.94;  // share of the picture that the subject fills
constexpr int kSides = 24;              // directions from which the distance is chosen
constexpr double kFartherThanPhotos = 1.25;
constexpr double kLeastGap = glm::radians(120.0);  // with a wider gap the cameras make no full turn
constexpr double kWholeTurn = 2 * glm::pi<double>();

/// The course of the turn, seen from the middle.
struct Course {
    double above = kAbove;             // rad
    double from = 0, to = kWholeTurn;  // rad, about up
    bool to_and_fro = false;
    double most_distance = HUGE_VAL;  // world
};

/// Where the cameras stand: angles about up from `ahead`, ascending; their heights; their
/// distances.
struct Stands {
    std::vector<double> turns, heights, distances;
};

Stands stands_of(const Subject& subject, const Navigation& view,
                 const std::vector<Camera>& cameras) {
    Stands stands;
    // Turning the view to the right moves its stand to the left by the same angle.
    const glm::dvec3 back = -view.forward(), left = -view.right();
    for (const Camera& camera : cameras) {
        const glm::dvec3 way =
            subject.around ? glm::transpose(camera.rotation)[2] : camera.centre() - subject.centre;
        const double far = glm::length(way), up = glm::dot(way, view.up);
        if (!(far > 0)) continue;
        stands.distances.push_back(far);
        stands.heights.push_back(std::asin(std::clamp(up / far, -1.0, 1.0)));
        stands.turns.push_back(std::atan2(glm::dot(way, left), glm::dot(way, back)));
    }
    std::sort(stands.turns.begin(), stands.turns.end());
    return stands;
}

/// The widest gap between neighbours, and the angle at which it ends.
std::pair<double, double> widest_gap(const std::vector<double>& turns) {
    double widest = 0, end = 0;
    for (std::size_t i = 0; i < turns.size(); ++i) {
        const bool last = i + 1 == turns.size();
        const double next = last ? turns.front() + kWholeTurn : turns[i + 1];
        if (next - turns[i] <= widest) continue;
        widest = next - turns[i];
        end = last ? turns.front() : next;
    }
    return {widest, end};
}

Course course_of(const Subject& subject, const Navigation& view,
                 const std::vector<Camera>& cameras) {
    Course course;
    const Stands stands = stands_of(subject, view, cameras);
    if (stands.turns.empty()) return course;
    course.above = std::clamp(median(stands.heights), -kHighest, kHighest);
    if (subject.around) {  // the turn moves the view, not the stand
        course.above = -course.above;
        return course;
    }
    course.most_distance = kFartherThanPhotos * median(stands.distances);
    const auto [gap, end] = widest_gap(stands.turns);
    course.to_and_fro = gap >= kLeastGap;
    if (course.to_and_fro) {
        course.from = end;
        course.to = end + kWholeTurn - gap;
    }
    return course;
}

}  // namespace

CameraPath turntable(const SplatModel& model, const TurntableOptions& options) {
    const Subject subject = subject_of(model, options.cameras);
    Navigation view;
    view.set_up(options.up);
    view.level();
    const Course course = course_of(subject, view, options.cameras);
    view.orbit(course.from, course.above);
    const double tan_y = kFilledByTurn * std::tan(view.fov_y / 2);
    const double tan_x = tan_y * options.width / options.height;
    const Navigation start = view;
    double distance = 0;
    for (int side = 0; side < kSides; ++side) {
        view = start;
        view.orbit((course.to - course.from) * side / kSides, 0);
        distance = std::max(distance, framing_distance(model, subject, view.axes, tan_x, tan_y));
    }
    if (!(distance > 0)) distance = subject.radius / std::sin(view.fov_y / 2);
    distance = std::min(distance, course.most_distance);
    const int frames = std::max(1, static_cast<int>(std::lround(options.seconds * options.fps)));
    CameraPath path;
    for (int frame = 0; frame < frames; ++frame) {
        const double share = static_cast<double>(frame) / frames;
        view = start;
        view.orbit((course.to - course.from) *
                       (course.to_and_fro ? (1 - std::cos(kWholeTurn * share)) / 2 : share),
                   0);
        view.look_from(subject.centre, distance);
        if (subject.around) view.eye = subject.centre;
        path.add(view, 1.0 / options.fps);
        // a sum of steps would add up roundings
        path.keys.back().seconds = static_cast<double>(frame) / options.fps;
    }
    return path;
}

}  // namespace darb
