#include "viewer/camera_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/data/camera_list.h"

namespace darb {

namespace {

constexpr double kLongest_s = 24 * 60 * 60;  // a clock's time of day or since 1970 is longer

// Position, field of view and quaternion as one vector of eight numbers. The field of view is
// ln tan(fov / 2): whatever a curve does between two keys, it stays between 0 and 180 degrees.
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
        throw Error(file.string(), "is no camera path: it has neither key_frames nor camera_path",
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
                throw Error(where, "its time is not after that of the key before", hint);
            if (!(glm::length(key.orientation) > 1e-6))
                throw Error(where, "its orientation is no quaternion", hint);
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

}  // namespace darb
