// SPDX-License-Identifier: MIT
#include "engine/data/transforms.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/core/parse_number.h"
#include "engine/data/camera_list.h"
#include "engine/data/depths.h"
#include "engine/data/image_io.h"
#include "engine/data/lens_model.h"
#include "engine/data/masks.h"
#include "engine/data/point_cloud_ply.h"
#include "engine/data/source.h"

namespace darb {

using nlohmann::json;

namespace {

constexpr const char* kCorrectEntry = "Correct the entry, or export the file again.";

/// Reads a number, which some writers put into a string.
double to_number(const json& value, const char* key, const std::string& where) {
    if (value.is_number()) return value.get<double>();
    const std::string text = value.is_string() ? value.get<std::string>() : "";
    double number = 0;
    const auto [end, error] = parse_number(text.data(), text.data() + text.size(), number);
    if (error != std::errc{} || end != text.data() + text.size())
        throw Error(where, fmt::format("{} is not a number", key), kCorrectEntry);
    return number;
}

void read_number(const json& object, const char* key, const std::string& where,
                 std::optional<double>& to) {
    const auto at = object.find(key);
    if (at != object.end() && !at->is_null()) to = to_number(*at, key, where);
}

std::string read_string(const json& object, const char* key, const std::string& where) {
    const auto at = object.find(key);
    if (at == object.end() || at->is_null()) return {};
    if (!at->is_string()) throw Error(where, fmt::format("{} is not a string", key), kCorrectEntry);
    return at->get<std::string>();
}

/// Reads a truth value, for which some writers put 0 or 1.
bool read_bool(const json& object, const char* key, const std::string& where, bool absent) {
    const auto at = object.find(key);
    if (at == object.end() || at->is_null()) return absent;
    if (at->is_boolean()) return at->get<bool>();
    if (at->is_number()) return at->get<double>() != 0;
    throw Error(where, fmt::format("{} is neither true or false nor a number", key), kCorrectEntry);
}

/// instant-ngp's x_fov and y_fov, in degrees, which take precedence over its other keys.
void read_fields_of_view(const json& object, const std::string& where, TransformsIntrinsics& to) {
    constexpr double kRadian = 0.017453292519943295;
    std::optional<double> x, y;
    read_number(object, "x_fov", where, x);
    read_number(object, "y_fov", where, y);
    for (const std::optional<double>& fov : {x, y})
        if (fov && !(*fov > 0 && *fov < 180))
            throw Error(where, fmt::format("a field of view is {} degrees", *fov),
                        "Give x_fov and y_fov in degrees, or fl_x and fl_y in pixels.");
    if (x) {
        to.fl_x.reset();
        to.camera_angle_x = *x * kRadian;
    }
    if (y) {
        to.fl_y.reset();
        to.camera_angle_y = *y * kRadian;
    }
}

/// nerfstudio's list: k1, k2, k3, k4, p1, p2.
void read_distortion_list(const json& object, const std::string& where, TransformsIntrinsics& to) {
    const auto list = object.find("distortion_params");
    if (list == object.end() || list->is_null()) return;
    if (!list->is_array() || list->size() != 6)
        throw Error(where, "distortion_params does not hold k1, k2, k3, k4, p1 and p2",
                    "Give k1 to k4, p1 and p2 as keys of their own.");
    double values[6];
    for (std::size_t i = 0; i < 6; ++i)
        values[i] = to_number((*list)[i], "distortion_params", where);
    std::copy_n(values, 4, to.k.begin());
    to.p1 = values[4];
    to.p2 = values[5];
}

/// Absent keys leave values unchanged: those of the file are the defaults of the frames.
void read_intrinsics(const json& object, const std::string& where, TransformsIntrinsics& to) {
    // A frame's own focal length or angle takes precedence over the file's.
    const auto own = [&](const char* key) {
        const auto at = object.find(key);
        return at != object.end() && !at->is_null();
    };
    if (own("fl_x") || own("camera_angle_x") || own("x_fov")) {
        to.fl_x.reset();
        to.fl_y.reset();
        to.camera_angle_x.reset();
        to.camera_angle_y.reset();
    }
    read_number(object, "w", where, to.w);
    read_number(object, "h", where, to.h);
    read_number(object, "fl_x", where, to.fl_x);
    read_number(object, "fl_y", where, to.fl_y);
    read_number(object, "cx", where, to.cx);
    read_number(object, "cy", where, to.cy);
    read_number(object, "camera_angle_x", where, to.camera_angle_x);
    read_number(object, "camera_angle_y", where, to.camera_angle_y);
    read_fields_of_view(object, where, to);
    read_distortion_list(object, where, to);
    constexpr const char* kNames[6] = {"k1", "k2", "k3", "k4", "k5", "k6"};
    for (std::size_t i = 0; i < 6; ++i) {
        std::optional<double> value;
        read_number(object, kNames[i], where, value);
        to.k[i] = value.value_or(to.k[i]);
    }
    std::optional<double> p1, p2;
    read_number(object, "p1", where, p1);
    read_number(object, "p2", where, p2);
    to.p1 = p1.value_or(to.p1);
    to.p2 = p2.value_or(to.p2);
    if (std::string model = read_string(object, "camera_model", where); !model.empty())
        to.camera_model = std::move(model);
    if (own("is_fisheye")) to.is_fisheye = read_bool(object, "is_fisheye", where, false);
    std::optional<double> radius;
    read_number(object, "fisheye_crop_radius", where, radius);
    to.crop_radius = radius.value_or(to.crop_radius);
}

struct CameraToWorld {
    glm::dmat3 axes;
    glm::dvec3 centre;
};

CameraToWorld read_matrix(const json& object, const char* key, const std::string& where) {
    const auto matrix = object.find(key);
    if (matrix == object.end() || !matrix->is_array() || matrix->size() < 3)
        throw Error(where, fmt::format("has no {} of 4 x 4 or 3 x 4 numbers", key), kCorrectEntry);
    CameraToWorld pose;
    for (int r = 0; r < 3; ++r) {
        const json& row = (*matrix)[static_cast<std::size_t>(r)];
        if (!row.is_array() || row.size() != 4)
            throw Error(where, fmt::format("a row of {} does not hold 4 numbers", key),
                        kCorrectEntry);
        for (int c = 0; c < 4; ++c) {
            // JSON has no NaN; writers put null or a string in its place.
            const json& value = row[static_cast<std::size_t>(c)];
            const double number = value.is_number() ? value.get<double>() : std::nan("");
            if (c < 3)
                pose.axes[c][r] = number;
            else
                pose.centre[r] = number;
        }
    }
    return pose;
}

/// How the file says that rows are exposed one after the other.
struct Readout {
    double seconds = 0;  // from the first row to the last, for frames that have velocities
    // instant-ngp: the share of the way from transform_matrix_start to _end at which the middle row
    // is exposed, and that by which the last is later than the first.
    double middle = 0.5, rows = 0;
    bool blurs = false;  // pixels are exposed for a while, which is not drawn
};

/// What is noted once for all frames.
struct PoseTally {
    std::size_t scaled = 0, halfway = 0, moving = 0, rolling = 0;
    bool mitsuba = false;  // the file's camera axes: x to the left, y up, z forwards
    Readout readout;
};

/// Reads rolling_shutter_time and rolling_shutter; an absent key says that all rows are exposed at
/// once.
Readout read_readout(const json& root, const std::string& where) {
    Readout readout;
    std::optional<double> seconds;
    read_number(root, "rolling_shutter_time", where, seconds);
    readout.seconds = seconds.value_or(0);
    const auto ngp = root.find("rolling_shutter");
    if (ngp == root.end() || !ngp->is_array()) return readout;
    std::array<double, 4> v{};
    if (ngp->size() < 3 || ngp->size() > v.size())
        throw Error(where, fmt::format("rolling_shutter has {} numbers, not 3 or 4", ngp->size()),
                    "Write it as [t, by column, by row, blur].");
    for (std::size_t i = 0; i < ngp->size(); ++i) {
        if (!(*ngp)[i].is_number())
            throw Error(where, "rolling_shutter does not hold numbers",
                        "Write it as [t, by column, by row, blur].");
        v[i] = (*ngp)[i].get<double>();
    }
    if (v[1] != 0)
        throw Error(where,
                    fmt::format("rolling_shutter exposes columns one after the other ({:g})", v[1]),
                    "Turn photos and poses by 90 degrees, so that rows are.");
    if (v[2] == 0 && v[3] == 0) return readout;
    readout.middle = v[0] + 0.5 * (v[2] + v[3]);
    readout.rows = v[2];
    readout.blurs = v[3] != 0;
    return readout;
}

/// Three numbers of a key; nothing where it is absent.
std::optional<glm::dvec3> read_vector(const json& object, const char* key,
                                      const std::string& where) {
    const auto at = object.find(key);
    if (at == object.end() || at->is_null()) return std::nullopt;
    glm::dvec3 v;
    for (int c = 0; c < 3; ++c) {
        const auto k = static_cast<std::size_t>(c);
        if (!at->is_array() || at->size() != 3 || !(*at)[k].is_number())
            throw Error(where, fmt::format("{} does not hold 3 numbers", key), kCorrectEntry);
        v[c] = (*at)[k].get<double>();
    }
    return v;
}

/// A pose in the file's frame, with COLMAP's camera axes.
CameraToWorld read_camera_to_world(const json& object, const char* key, const std::string& where,
                                   PoseTally& tally) {
    CameraToWorld pose = read_matrix(object, key, where);
    pose.axes[1] = -pose.axes[1];
    pose.axes[tally.mitsuba ? 0 : 2] = -pose.axes[tally.mitsuba ? 0 : 2];
    tally.scaled += remove_scale(pose.axes) ? 1 : 0;
    pose.axes = checked_rotation(pose.axes, where);
    check_position(pose.centre, where);
    return pose;
}

/// Reads transform_matrix or, where only the poses at the start and the end of an exposure are
/// given, the pose halfway.
/// With a rolling shutter that of the middle row, and how it moves from the first to the last.
void read_pose(const json& object, const std::string& where, PoseTally& tally,
               TransformsFrame& frame) {
    constexpr const char *kStart = "transform_matrix_start", *kEnd = "transform_matrix_end";
    constexpr double kStill = 1e-9;
    const bool has_ends = object.contains(kStart) && object.contains(kEnd);
    const Readout& readout = tally.readout;
    CameraToWorld pose;
    if (object.contains("transform_matrix") || !has_ends) {
        pose = read_camera_to_world(object, "transform_matrix", where, tally);
        const auto move = read_vector(object, "camera_linear_velocity", where);
        const auto turn = read_vector(object, "camera_angular_velocity", where);
        // Along the axes of the file; world to camera turns the other way than camera to world.
        const glm::dvec3 axes(tally.mitsuba ? -1 : 1, -1, tally.mitsuba ? 1 : -1);
        frame.shutter.move = readout.seconds * axes * move.value_or(glm::dvec3(0.0));
        frame.shutter.turn = -readout.seconds * axes * turn.value_or(glm::dvec3(0.0));
    } else {
        pose = read_camera_to_world(object, kStart, where, tally);
        const CameraToWorld end = read_camera_to_world(object, kEnd, where, tally);
        double apart = glm::distance(pose.centre, end.centre);
        for (int c = 0; c < 3; ++c) apart += glm::distance(pose.axes[c], end.axes[c]);
        const glm::dquat a = glm::quat_cast(pose.axes), b = glm::quat_cast(end.axes);
        const glm::dvec3 way = end.centre - pose.centre;
        if (apart > kStill) pose.axes = glm::mat3_cast(glm::slerp(a, b, readout.middle));
        pose.centre += readout.middle * way;
        const glm::dquat turn = glm::normalize(b * glm::conjugate(a));
        const glm::dquat nearest = turn.w < 0 ? -turn : turn;
        frame.shutter.move = readout.rows * (way * pose.axes);
        frame.shutter.turn = -readout.rows * glm::angle(nearest) * (glm::axis(nearest) * pose.axes);
        ++tally.halfway;
        tally.moving += apart > kStill ? 1 : 0;
    }
    frame.rotation = glm::transpose(pose.axes);
    frame.translation = -(frame.rotation * pose.centre);
    check_position(frame.shutter.move, where);
    check_position(frame.shutter.turn, where);
    frame.shutter.active = glm::length(frame.shutter.move) + glm::length(frame.shutter.turn) > 0;
    tally.rolling += frame.shutter.active ? 1 : 0;
}

/// COLMAP's name for a nerfstudio or instant-ngp camera model.
std::string model_name(const TransformsIntrinsics& in, const std::string& where) {
    std::string name = in.camera_model;
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::toupper(c); });
    const bool fisheye = name.ends_with("FISHEYE");
    if (!name.empty() && in.is_fisheye && *in.is_fisheye != fisheye)
        throw Error(where,
                    fmt::format("camera_model is {}, but is_fisheye is {}", in.camera_model,
                                *in.is_fisheye),
                    "Remove the one that is wrong.");
    if (name == "OPENCV_FISHEYE" || name == "FISHEYE" || name == "RADIAL_FISHEYE" ||
        name == "SIMPLE_RADIAL_FISHEYE" || (name.empty() && in.is_fisheye.value_or(false)))
        return "OPENCV_FISHEYE";
    constexpr std::string_view kPerspective[] = {"",        "OPENCV",        "FULL_OPENCV",
                                                 "RADIAL",  "SIMPLE_RADIAL", "PERSPECTIVE",
                                                 "PINHOLE", "SIMPLE_PINHOLE"};
    for (const std::string_view known : kPerspective) {
        if (name != known) continue;
        // COLMAP's k4 to k6 are in the denominator; nerfstudio's k4 is the coefficient of r^8 in
        // the numerator.
        const bool rational = name == "FULL_OPENCV" || in.k[4] != 0 || in.k[5] != 0;
        if (in.k[3] != 0 && !rational) return std::string(kFourRadial);
        if (in.k[2] != 0 || in.k[3] != 0 || in.k[4] != 0 || in.k[5] != 0) return "FULL_OPENCV";
        const bool distorted = in.k[0] != 0 || in.k[1] != 0 || in.p1 != 0 || in.p2 != 0;
        return distorted ? "OPENCV" : "PINHOLE";
    }
    if (name == kPanorama) return std::string(kPanorama);
    throw Error(where, fmt::format("the camera_model {} cannot be read", in.camera_model),
                "Use perspective or fisheye photos (OPENCV, OPENCV_FISHEYE, PINHOLE), or whole "
                "panoramas (EQUIRECTANGULAR).");
}

/// A panorama needs no focal lengths. Its middle looks ahead, so a principal point elsewhere would
/// turn it.
LensModel panorama_lens(const TransformsIntrinsics& in, double w, double h,
                        const std::string& where) {
    if (std::abs(in.cx.value_or(0.5 * w) - 0.5 * w) > 1 ||
        std::abs(in.cy.value_or(0.5 * h) - 0.5 * h) > 1)
        throw Error(where,
                    fmt::format("cx, cy = {:g}, {:g} is not the middle of the panorama of {:g} x "
                                "{:g} px",
                                in.cx.value_or(0.5 * w), in.cy.value_or(0.5 * h), w, h),
                    "Leave cx and cy out, and turn transform_matrix instead.");
    LensModel lens;
    lens.model = kPanorama;
    lens.width = static_cast<int>(std::lround(w));
    lens.height = static_cast<int>(std::lround(h));
    lens.parameters = {double(lens.width), double(lens.height)};
    check_lens(lens, where);
    return lens;
}

/// Keys that are read, and keys that change nothing here: bounding boxes and frames of other
/// programs, what the writer has applied already, names, times of day.
constexpr std::string_view kReadKeys[] = {"frames",
                                          "w",
                                          "h",
                                          "fl_x",
                                          "fl_y",
                                          "cx",
                                          "cy",
                                          "camera_angle_x",
                                          "camera_angle_y",
                                          "x_fov",
                                          "y_fov",
                                          "k1",
                                          "k2",
                                          "k3",
                                          "k4",
                                          "k5",
                                          "k6",
                                          "p1",
                                          "p2",
                                          "distortion_params",
                                          "camera_model",
                                          "is_fisheye",
                                          "fisheye_crop_radius",
                                          "ply_file_path",
                                          "depth_unit_scale_factor",
                                          "integer_depth_scale",
                                          "enable_depth_loading",
                                          "applied_scale",
                                          "train_filenames",
                                          "val_filenames",
                                          "test_filenames",
                                          "from_mitsuba",
                                          "file_path",
                                          "mask_path",
                                          "depth_file_path",
                                          "depth_path",
                                          "transform_matrix",
                                          "transform_matrix_start",
                                          "transform_matrix_end",
                                          "rolling_shutter_time",
                                          "camera_linear_velocity",
                                          "camera_angular_velocity",
                                          "time"};
constexpr std::string_view kHarmlessKeys[] = {"aabb",
                                              "aabb_scale",
                                              "render_aabb",
                                              "scale",
                                              "offset",
                                              "up",
                                              "from_na",
                                              "rotation",
                                              "orientation_override",
                                              "auto_scale_poses_override",
                                              "applied_transform",
                                              "colmap_im_id",
                                              "sharpness",
                                              "timestamp",
                                              "id",
                                              "name",
                                              "names"};

struct MeaningfulKey {
    std::string_view key, instead;
};
/// Known keys that are not supported, and what happens in place of what they ask for.
constexpr MeaningfulKey kUnreadKeys[] = {
    {"rolling_shutter", "each photo is taken for exposed at one moment"},
    {"motionblur_amount", "each photo is taken for exposed at one moment"},
    {"white_transparent", "white pixels are trained as white"},
    {"black_transparent", "black pixels are trained as black"},
    {"mask_color", "pixels of that colour are trained as they are"},
    {"fix_premult", "colours are taken as not multiplied by alpha"},
    {"enable_ray_loading", "rays follow from the camera's lens alone"},
    {"light", "the light is taken for the same in all photos"},
    {"driver_parameters", "the light is taken for the same in all photos"},
    {"skew", "pixels are taken for upright"},
    {"s1", "the distortion is read without it"},
    {"s2", "the distortion is read without it"},
    {"s3", "the distortion is read without it"},
    {"s4", "the distortion is read without it"},
    {"p3", "the distortion is read without it"},
    {"p4", "the distortion is read without it"}};
/// Lenses that a pinhole with distortion cannot replace.
constexpr std::string_view kOtherLenses[] = {"ftheta_p0", "latlong", "equirectangular",
                                             "is_equirectangular", "lens_latlong"};

/// Whether a value carries information: it is not false, 0, null or empty.
bool says_something(const json& value) {
    if (value.is_boolean()) return value.get<bool>();
    if (value.is_number()) return value.get<double>() != 0;
    if (value.is_array())
        return std::ranges::any_of(value, [](const json& v) { return says_something(v); });
    return !value.is_null() && !(value.is_string() && value.get<std::string>().empty());
}

/// The key in lower case, without the characters that join words.
std::string letters_of(std::string_view key) {
    std::string letters;
    for (const char c : key)
        if (std::isalnum(static_cast<unsigned char>(c)))
            letters += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return letters;
}

/// Levenshtein distance: letters to add, drop or change to turn one word into the other.
std::size_t edits_between(const std::string& a, const std::string& b) {
    std::vector<std::size_t> row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = std::exchange(row[0], i + 1);
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t change = diagonal + (a[i] == b[j] ? 0 : 1);
            diagonal = row[j + 1];
            row[j + 1] = std::min({change, row[j] + 1, diagonal + 1});
        }
    }
    return row[b.size()];
}

/// The supported key that this one may be a misspelling of; empty where there is none.
std::string_view near_miss_of(std::string_view key) {
    const std::string letters = letters_of(key);
    for (const std::string_view known : kReadKeys) {
        const std::string other = letters_of(known);
        const std::size_t allowed = other.size() < 5 ? 0 : other.size() < 9 ? 1 : 2;
        if (edits_between(letters, other) <= allowed) return known;
    }
    return {};
}

/// Whether an unknown key sounds as if it mattered to a data set.
bool sounds_meaningful(std::string_view key) {
    constexpr std::string_view kWords[] = {"mask", "depth",   "alpha", "distort",   "shutter",
                                           "fov",  "fisheye", "focal", "intrinsic", "extrinsic"};
    const std::string letters = letters_of(key);
    return std::ranges::any_of(
        kWords, [&](std::string_view word) { return letters.find(word) != std::string::npos; });
}

/// Collects keys of the file and its frames that are not read although they may matter.
class UnreadKeys {
  public:
    /// read: a key that is read in this object alone.
    void look_at(const json& object, const std::string& where, std::string_view read = {}) {
        for (const auto& [key, value] : object.items()) {
            const std::string_view name = key;
            if (name == read || std::ranges::find(kReadKeys, name) != std::end(kReadKeys) ||
                std::ranges::find(kHarmlessKeys, name) != std::end(kHarmlessKeys) ||
                !says_something(value))
                continue;
            if (std::ranges::find(kOtherLenses, name) != std::end(kOtherLenses))
                throw Error(where, fmt::format("{} declares a lens that is not read", key),
                            "Make perspective or fisheye photos of it (OPENCV, OPENCV_FISHEYE, "
                            "PINHOLE); a whole panorama has camera_model EQUIRECTANGULAR.");
            add(key);
        }
    }

    /// A sentence about them, or nothing.
    std::string note(const std::string& where) const {
        std::string list;
        for (const auto& [key, why] : found_)
            list += (list.empty() ? "" : ", ") + key + (why.empty() ? "" : " (" + why + ")");
        if (list.empty()) return {};
        return fmt::format("Warning: {} has keys that are not read but may matter: {}.", where,
                           list);
    }

  private:
    void add(const std::string& key) {
        for (const MeaningfulKey& known : kUnreadKeys)
            if (known.key == key) {
                found_[key] = known.instead;
                return;
            }
        if (const std::string_view meant = near_miss_of(key); !meant.empty())
            found_[key] = fmt::format("is {} meant?", meant);
        else if (sounds_meaningful(key))
            found_[key] = "";
    }

    std::map<std::string, std::string> found_;
};

/// Reads the depth unit, metres a step, as either program writes it.
void read_depth_unit(const json& root, const std::string& where, TransformsFile& file) {
    constexpr const char *kAll = "depth_unit_scale_factor", *kIntegers = "integer_depth_scale";
    std::optional<double> all, integers;
    read_number(root, kAll, where, all);
    read_number(root, kIntegers, where, integers);
    if (integers && !(*integers > 0)) integers.reset();  // instant-ngp writes 0 for none
    if (all && integers && *all != *integers)
        throw Error(where,
                    fmt::format("{} is {:g}, but {} is {:g}", kAll, *all, kIntegers, *integers),
                    "Remove the one that is wrong: both state the metres of one step.");
    if (all && !(*all > 0 && *all < 1e6))
        throw Error(where, fmt::format("{} is {}", kAll, *all),
                    "Give the metres of one step, such as 0.001.");
    if (integers && *integers >= 1)
        throw Error(
            where, fmt::format("{} is {:g} metres a step, which is too much", kIntegers, *integers),
            fmt::format("Give the metres of one step: {:g}, if that many steps make a metre.",
                        1 / *integers));
    file.unit_of_integers = integers && !all;
    file.depth_unit = all ? *all : integers.value_or(0);
    file.read_depths = read_bool(root, "enable_depth_loading", where, true);
    std::optional<double> scale;
    read_number(root, "applied_scale", where, scale);
    if (scale && !(*scale > 0 && std::isfinite(*scale)))
        throw Error(where, fmt::format("applied_scale is {}", *scale),
                    "Give the factor that poses were multiplied by, or remove it.");
    file.applied_scale = scale.value_or(1);
}

void read_split(const json& root, TransformsFile& file) {
    const auto read = [&](const char* key, std::vector<std::string>& to) {
        const auto list = root.find(key);
        if (!to.empty() || list == root.end() || !list->is_array()) return;
        for (const json& name : *list)
            if (name.is_string()) to.push_back(name.get<std::string>());
    };
    read("train_filenames", file.train_filenames);
    read("test_filenames", file.test_filenames);
    read("val_filenames", file.test_filenames);
}

/// The depth file of a frame, by either of its keys.
std::string read_depth_path(const json& frame, const std::string& where) {
    const std::string nerfstudio = read_string(frame, "depth_file_path", where);
    const std::string ngp = read_string(frame, "depth_path", where);
    if (!nerfstudio.empty() && !ngp.empty() && nerfstudio != ngp)
        throw Error(where,
                    fmt::format("depth_file_path is {}, but depth_path is {}", nerfstudio, ngp),
                    "Remove the one that is wrong.");
    return nerfstudio.empty() ? ngp : nerfstudio;
}

/// Whether focal length in pixels and angle differ by more than rounding.
bool angles_disagree(const TransformsIntrinsics& in) {
    constexpr double kMost = 0.02;
    const auto off = [](std::optional<double> focal, std::optional<double> angle,
                        std::optional<double> size) {
        if (!focal || !angle || !size || !(*angle > 0)) return false;
        return !(std::abs(0.5 * *size / std::tan(0.5 * *angle) / *focal - 1) <= kMost);
    };
    return off(in.fl_x, in.camera_angle_x, in.w) || off(in.fl_y, in.camera_angle_y, in.h);
}

/// What is noted once for all frames.
struct FrameTally {
    PoseTally poses;
    std::set<double> times;
    std::size_t odd_angles = 0;
};

TransformsFrame read_frame(const json& object, const TransformsIntrinsics& defaults,
                           std::string record, FrameTally& tally) {
    if (!object.is_object()) throw Error(record, "is not an object", kCorrectEntry);
    TransformsFrame frame;
    frame.file_path = read_string(object, "file_path", record);
    if (frame.file_path.empty()) throw Error(record, "has no file_path", kCorrectEntry);
    record += fmt::format(" ({})", frame.file_path);
    frame.mask_path = read_string(object, "mask_path", record);
    frame.depth_path = read_depth_path(object, record);
    frame.intrinsics = defaults;
    read_intrinsics(object, record, frame.intrinsics);
    read_pose(object, record, tally.poses, frame);
    if (const auto time = object.find("time"); time != object.end() && time->is_number())
        tally.times.insert(time->get<double>());
    tally.odd_angles += angles_disagree(frame.intrinsics) ? 1 : 0;
    return frame;
}

void note_frames(const FrameTally& tally, const std::string& where, TransformsFile& file) {
    const std::size_t count = file.frames.size();
    if (tally.times.size() > 1)
        file.notes.push_back(
            fmt::format("Warning: the frames of {} have {} different times: photos of a scene that "
                        "moves are taken for photos of one moment.",
                        where, tally.times.size()));
    if (tally.poses.halfway > 0)
        file.notes.push_back(fmt::format(
            "{} of {} frames have no transform_matrix, but a start and an end: the pose is the one "
            "halfway, and {} of them move.",
            tally.poses.halfway, count, tally.poses.moving));
    if (tally.poses.rolling > 0)
        file.notes.push_back(fmt::format(
            "{} of {} frames have a rolling shutter: their rows are exposed one after the other.",
            tally.poses.rolling, count));
    if (tally.poses.rolling == 0 && tally.poses.readout.seconds + tally.poses.readout.rows != 0)
        file.notes.push_back(fmt::format(
            "Warning: {} says how long the rows of a photo take, but no frame says how the camera "
            "moves meanwhile: each photo is taken for exposed at one moment.",
            where));
    if (tally.odd_angles > 0)
        file.notes.push_back(fmt::format(
            "Warning: in {} of {} frames of {} fl_x or fl_y is not what camera_angle_x or "
            "camera_angle_y says; the focal lengths in pixels were used.",
            tally.odd_angles, count, where));
}

}  // namespace

TransformsFile parse_transforms(std::string_view text, const std::string& where) {
    const json root = parse_json_text(text, where, "Correct or export the file again.");
    if (root.is_array() && !root.empty() && root[0].is_object() && root[0].contains("shots"))
        throw Error(where, "is a reconstruction of OpenSfM, which is not read",
                    "Export it for COLMAP (opensfm export_colmap) and name that folder.");
    for (const char* key : {"camera_path", "key_frames"})
        if (root.is_object() && root.contains(key) && !root.contains("frames"))
            throw Error(where, "is a camera path, not a data set",
                        key == std::string_view("camera_path")
                            ? "Render along it: darb render SCENE --path or --cameras FILE."
                            : "Render along it: darb render SCENE --path FILE.");
    if (!root.is_object() || !root.contains("frames") || !root["frames"].is_array())
        throw Error(where, "has no list named frames",
                    root.is_array()
                        ? "This looks like a cameras.json: use it with --cameras."
                        : "A transforms.json of NeRF, instant-ngp or nerfstudio is needed.");
    TransformsFile file;
    TransformsIntrinsics defaults;
    read_intrinsics(root, where, defaults);
    file.ply_file_path = read_string(root, "ply_file_path", where);
    read_depth_unit(root, where, file);
    read_split(root, file);
    FrameTally tally;
    tally.poses.readout = read_readout(root, where);
    tally.poses.mitsuba = read_bool(root, "from_mitsuba", where, false);
    UnreadKeys unread;
    const Readout& readout = tally.poses.readout;
    unread.look_at(root, where, readout.rows != 0 && !readout.blurs ? "rolling_shutter" : "");
    const json& frames = root["frames"];
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const std::string record = fmt::format("{}, frame {} of {}", where, i + 1, frames.size());
        file.frames.push_back(read_frame(frames[i], defaults, record, tally));
        unread.look_at(frames[i], record);
    }
    file.scaled_poses = tally.poses.scaled;
    if (std::string note = unread.note(where); !note.empty()) file.notes.push_back(std::move(note));
    note_frames(tally, where, file);
    return file;
}

LensModel lens_from_transforms(const TransformsIntrinsics& in, int width, int height,
                               const std::string& where) {
    const double w = in.w.value_or(width), h = in.h.value_or(height);
    if (!(w >= 1 && w <= 1e6 && h >= 1 && h <= 1e6))
        throw Error(where, fmt::format("the photo size {} x {} is not valid", w, h),
                    "Correct w and h.");
    if (model_name(in, where) == kPanorama) return panorama_lens(in, w, h, where);
    const auto from_angle = [](double size, double angle) {
        return 0.5 * size / std::tan(0.5 * angle);
    };
    double fx = 0;
    if (in.fl_x)
        fx = *in.fl_x;
    else if (in.camera_angle_x)
        fx = from_angle(w, *in.camera_angle_x);
    else if (in.fl_y)
        fx = *in.fl_y;
    else
        throw Error(where, "declares neither fl_x nor camera_angle_x",
                    "Add the focal length in pixels as fl_x.");
    double fy = fx;
    if (in.fl_y)
        fy = *in.fl_y;
    else if (!in.fl_x && in.camera_angle_y)
        fy = from_angle(h, *in.camera_angle_y);

    LensModel lens;
    lens.model = model_name(in, where);
    lens.width = static_cast<int>(std::lround(w));
    lens.height = static_cast<int>(std::lround(h));
    lens.parameters = {fx, fy, in.cx.value_or(0.5 * w), in.cy.value_or(0.5 * h)};
    std::vector<double> distortion;
    if (lens.model == "OPENCV_FISHEYE")
        distortion = {in.k[0], in.k[1], in.k[2], in.k[3]};
    else if (lens.model != "PINHOLE")
        distortion = {in.k[0], in.k[1], in.p1, in.p2};
    if (lens.model == "FULL_OPENCV")
        distortion.insert(distortion.end(), in.k.begin() + 2, in.k.end());
    if (lens.model == kFourRadial) distortion.insert(distortion.end(), {in.k[2], in.k[3]});
    lens.parameters.insert(lens.parameters.end(), distortion.begin(), distortion.end());
    check_lens(lens, where);
    return lens;
}

// transforms.json as a data set: photos, masks, the point cloud and the test files.

namespace fs = std::filesystem;

namespace {

constexpr int kSyntheticSize = 800;  // px, as in NeRF synthetic; only where no photo tells

// Names of the sparse points where ply_file_path is absent, from 3DGS, BlenderNeRF and nerfstudio.
constexpr const char* kPointFiles[] = {"points3d.ply", "points3D.ply", "sparse_pc.ply",
                                       "pointcloud.ply"};

/// "./train/r_2" and ".\train\r_2" to "train/r_2".
std::string plain_name(const std::string& file_path) {
    return fs::path(with_slashes(file_path)).lexically_normal().generic_string();
}

/// The name with images/ replaced by the folder that the options ask for.
std::string asked_name(const std::string& name, const DatasetOptions& options) {
    if (options.images_folder != "images" && name.starts_with(kImages))
        return options.images_folder + "/" + name.substr(kImages.size());
    return name;
}

bool in_pixels(const TransformsIntrinsics& in) {
    return in.fl_x || in.fl_y || in.cx || in.cy;
}

/// Sets the lens; where the file states no size, that of the photo is taken, as turned.
void set_lens(const TransformsFrame& frame, const fs::path& listing, const DatasetOptions& options,
              View& view) {
    const std::string where = fmt::format("{} ({})", listing.string(), frame.file_path);
    int width = kSyntheticSize, height = kSyntheticSize;
    if ((!frame.intrinsics.w || !frame.intrinsics.h) && fs::is_regular_file(view.photo)) {
        fs::path own = view.photo;
        if (asked_name(view.name, options) != view.name && in_pixels(frame.intrinsics))
            own = find_photo(listing.parent_path(), view.name);
        if (own.empty())
            throw Error(where,
                        fmt::format("its camera is in pixels of {}, which is missing, and declares "
                                    "no size",
                                    view.name),
                        "Add w and h to the file, or put those photos back.");
        const ImageInfo info = read_image_info(own);
        view.orientation = read_image_info(view.photo).orientation;
        width = info.orientation >= 5 ? info.height : info.width;
        height = info.orientation >= 5 ? info.width : info.height;
    }
    view.lens = lens_from_transforms(frame.intrinsics, width, height, where);
}

void set_depth(const TransformsFrame& frame, const TransformsFile& declared, const fs::path& file,
               const DatasetOptions& options, View& view) {
    view.depth_unit = declared.depth_unit;
    view.depth_unit_of_integers = declared.unit_of_integers;
    if (frame.depth_path.empty() || !declared.read_depths) return;
    view.depth = file.parent_path() / frame.depth_path;
    if (!fs::is_regular_file(view.depth))
        view.depth = file.parent_path() / with_slashes(frame.depth_path);
    if (options.require_photos && !fs::is_regular_file(view.depth))
        throw Error(fmt::format("{} ({})", file.string(), frame.file_path),
                    fmt::format("its depth {} is missing", view.depth.string()),
                    "Put the depth back, or remove its name from the frame.");
}

struct Skipped {
    std::size_t count = 0;
    std::string first;
    std::size_t in_images = 0;  // over all frames: those in images/
};

/// What the files declare besides frames.
struct Declared {
    std::string ply;
    bool masks = false;  // some frame has a mask
    bool depths = false;
    bool no_depths = false;  // depths are declared, but must not be read
    std::size_t scaled_poses = 0;
    std::map<fs::path, std::string> by_end;  // photos that were found by the ends of these names
    std::size_t of_no_split = 0;             // frames that are in neither part of the split
    std::size_t unknown_names = 0;           // names in the split that no frame has
};

/// Finds a photo by the end of its name, beside the file or in its images folder.
fs::path find_frame_by_end(const fs::path& root, const std::string& name, Declared& declared) {
    fs::path photo = find_by_end(root, name);
    if (photo.empty()) photo = find_by_end(root / kImages, "/" + name);
    if (photo.empty()) return {};
    if (!declared.by_end.emplace(photo, name).second)
        throw Error(fmt::format("{} ({})", root.string(), name),
                    fmt::format("is not there, and by the end of its name it is {}, the photo of "
                                "{} as well",
                                photo.string(), declared.by_end.at(photo)),
                    "Put the photos where file_path says, relative to the file.");
    return photo;
}

std::set<std::string> names_of_split(const std::vector<std::string>& listed,
                                     const TransformsFile& file, Declared& declared) {
    std::set<std::string> frames, names;
    for (const TransformsFrame& frame : file.frames) frames.insert(plain_name(frame.file_path));
    for (const std::string& name : listed) {
        names.insert(plain_name(name));
        declared.unknown_names += frames.contains(plain_name(name)) ? 0 : 1;
    }
    return names;
}

/// Notes what was found about the split and the poses of the files.
void note_declared(const Declared& declared, Dataset& dataset) {
    if (declared.scaled_poses > 0)
        dataset.notes.push_back(fmt::format("The scale of the rotation was removed: {}.",
                                            counted(declared.scaled_poses, "pose")));
    if (!declared.by_end.empty())
        dataset.notes.push_back(fmt::format("Found by the end of their names: {}, as {} for {}.",
                                            counted(declared.by_end.size(), "photo"),
                                            declared.by_end.begin()->first.string(),
                                            declared.by_end.begin()->second));
    if (declared.of_no_split > 0)
        dataset.notes.push_back(
            fmt::format("Left out: {} that train_filenames does not list, nor the test set.",
                        counted(declared.of_no_split, "frame")));
    if (declared.unknown_names > 0)
        dataset.notes.push_back(
            fmt::format("Warning: the split lists {} that are no frame's file_path.",
                        counted(declared.unknown_names, "name")));
    if (declared.no_depths)
        dataset.notes.push_back(
            "Depths were not read, as enable_depth_loading is false in the file.");
    const auto cropped =
        std::ranges::find_if(dataset.views, [](const View& view) { return view.crop_radius > 0; });
    if (cropped != dataset.views.end())
        dataset.notes.push_back(
            fmt::format("Pixels more than {:g} px from the middle of a photo are left out, as "
                        "fisheye_crop_radius says.",
                        cropped->crop_radius));
}

void add_frames(const fs::path& listing, bool is_test, const DatasetOptions& options,
                Dataset& dataset, Skipped& skipped, Declared& declared) {
    const TransformsFile file = parse_transforms(read_text_file(listing), listing.string());
    if (declared.ply.empty()) declared.ply = file.ply_file_path;
    declared.scaled_poses += file.scaled_poses;
    const fs::path root = listing.parent_path();
    const std::set<std::string> test_names = names_of_split(file.test_filenames, file, declared),
                                train_names = names_of_split(file.train_filenames, file, declared);
    dataset.depth_scale = file.applied_scale;
    declared.no_depths |= !file.read_depths;
    dataset.notes.insert(dataset.notes.end(), file.notes.begin(), file.notes.end());
    for (const TransformsFrame& frame : file.frames) {
        View view;
        view.name = plain_name(frame.file_path);
        declared.masks |= !frame.mask_path.empty();
        declared.depths |= !frame.depth_path.empty();
        skipped.in_images += view.name.starts_with(kImages) ? 1 : 0;
        const std::string name = asked_name(view.name, options);
        const fs::path wanted = root / name;
        view.photo = find_photo(root, name);
        if (view.photo.empty() && name == view.name)  // the backslashes are part of the name
            view.photo = find_photo(root, frame.file_path);
        if (view.photo.empty()) view.photo = find_frame_by_end(root, name, declared);
        if (view.photo.empty()) {
            if (options.require_photos) {
                check_is_file(wanted);  // throws where something else than a file is there
                if (skipped.count++ == 0) skipped.first = wanted.string();
                continue;
            }
            view.photo = wanted;
        }
        if (!frame.mask_path.empty()) view.mask = root / frame.mask_path;
        if (!view.mask.empty() && !fs::is_regular_file(view.mask))
            view.mask = root / with_slashes(frame.mask_path);
        if (options.require_photos && !view.mask.empty() && !fs::is_regular_file(view.mask))
            throw Error(fmt::format("{} ({})", listing.string(), frame.file_path),
                        fmt::format("its mask {} is missing", view.mask.string()),
                        "Put the mask back or remove mask_path.");
        set_depth(frame, file, listing, options, view);
        set_lens(frame, listing, options, view);
        view.crop_radius = frame.intrinsics.crop_radius;
        view.camera.rotation = frame.rotation;
        view.camera.translation = frame.translation;
        view.camera.shutter = frame.shutter;
        view.is_test = is_test || test_names.contains(view.name);
        if (!train_names.empty() && !view.is_test && !train_names.contains(view.name)) {
            ++declared.of_no_split;
            continue;
        }
        if (declared.by_end.contains(view.photo))
            view.name = view.photo.lexically_relative(root).generic_string();
        dataset.views.push_back(std::move(view));
    }
}

void add_points(const fs::path& root, const std::string& ply, const DatasetOptions& options,
                Dataset& dataset) {
    fs::path path = root / (ply.empty() ? kPointFiles[0] : ply);
    for (const char* name : kPointFiles)
        if (ply.empty() && !fs::is_regular_file(path)) path = root / name;
    if (!fs::is_regular_file(path)) {
        if (options.require_photos && !ply.empty())  // otherwise only cameras are wanted
            dataset.notes.push_back(fmt::format("The point cloud {} is missing.", path.string()));
        return;
    }
    std::size_t dropped = 0;
    dataset.points = read_point_cloud(path, dropped, &dataset.notes);
    if (ply.empty())
        dataset.notes.push_back(fmt::format("{} with the sparse points was read: {}.",
                                            path.filename().string(),
                                            counted(dataset.points.size(), "point")));
    if (dropped > 0)
        dataset.notes.push_back(
            fmt::format("{} with NaN or infinity were dropped.", counted(dropped, "point")));
}

}  // namespace

Dataset load_transforms(const fs::path& path, const DatasetOptions& options) {
    Dataset dataset;
    Skipped skipped;
    Declared declared;
    dataset.root = fs::is_directory(path) ? path : path.parent_path();
    fs::path listing = path;
    if (fs::is_directory(path))
        for (const char* name : kTransformsFiles)
            if (listing == path && fs::exists(path / name)) listing = path / name;
    dataset.source = listing.filename().string();
    const bool test = dataset.source == "transforms_test.json";
    add_frames(listing, test, options, dataset, skipped, declared);
    if (fs::is_directory(path) && listing.filename() == "transforms_train.json") {
        const bool has_test = fs::exists(path / "transforms_test.json");
        const bool has_val = fs::exists(path / "transforms_val.json");
        if (has_test || has_val)
            add_frames(path / (has_test ? "transforms_test.json" : "transforms_val.json"), true,
                       options, dataset, skipped, declared);
        if (has_test && has_val)
            dataset.notes.push_back(
                "transforms_val.json was not read: transforms_test.json is the "
                "test set.");
    }
    if (dataset.views.empty()) {
        const std::string scaled = scaled_images(dataset.root);
        throw Error(listing.string(),
                    skipped.count == 0
                        ? "lists no frames"
                        : fmt::format("none of its {} photos is there, the first being {}",
                                      skipped.count, skipped.first),
                    "Put the photos where file_path says, relative to the file" +
                        (scaled.empty() ? "."
                                        : fmt::format(", or take those of another size with "
                                                      "--images {}.",
                                                      scaled)));
    }
    if (skipped.count > 0)
        dataset.notes.push_back(
            fmt::format("Skipped: {} whose photo is missing, the first being {}.",
                        counted(skipped.count, "frame"), skipped.first));
    if (options.images_folder != "images" && skipped.in_images == 0)
        dataset.notes.push_back(
            fmt::format("--images {} has no effect: no file_path in {} begins with images/. Use "
                        "-r to scale.",
                        options.images_folder, listing.filename().string()));
    note_declared(declared, dataset);
    if (!declared.masks) add_masks(dataset.root, options, dataset);
    if (!declared.depths && !declared.no_depths) {
        const fs::path& photo = dataset.views[0].photo;  // in images/, or a folder in its place
        add_depths(dataset.root, photo.parent_path(), options, dataset);
    }
    add_points(dataset.root, declared.ply, options, dataset);
    return dataset;
}

}  // namespace darb
