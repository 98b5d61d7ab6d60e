#include "engine/data/transforms.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/data/lens_model.h"
#include "engine/data/pose.h"

namespace darb {

using nlohmann::json;

namespace {

constexpr const char* kCorrectEntry = "Correct the entry, or export the file again.";

/// Some writers put numbers into strings.
double to_number(const json& value, const char* key, const std::string& where) {
    if (value.is_number()) return value.get<double>();
    const std::string text = value.is_string() ? value.get<std::string>() : "";
    double number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
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

/// Writers put 0 and 1 for false and true.
bool read_bool(const json& object, const char* key, const std::string& where, bool absent) {
    const auto at = object.find(key);
    if (at == object.end() || at->is_null()) return absent;
    if (at->is_boolean()) return at->get<bool>();
    if (at->is_number()) return at->get<double>() != 0;
    throw Error(where, fmt::format("{} is neither true or false nor a number", key), kCorrectEntry);
}

/// Keys that are absent leave what is there: the file's values are the frames' defaults.
void read_intrinsics(const json& object, const std::string& where, TransformsIntrinsics& to) {
    // A frame's own focal length or angle outranks the file's.
    const auto own = [&](const char* key) {
        const auto at = object.find(key);
        return at != object.end() && !at->is_null();
    };
    if (own("fl_x") || own("camera_angle_x")) {
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
    to.is_fisheye = read_bool(object, "is_fisheye", where, to.is_fisheye);
}

/// Returns whether the rotation had a scale.
bool read_pose(const json& object, const std::string& where, TransformsFrame& frame) {
    const auto matrix = object.find("transform_matrix");
    if (matrix == object.end() || !matrix->is_array() || matrix->size() < 3)
        throw Error(where, "has no transform_matrix of 4 x 4 or 3 x 4 numbers", kCorrectEntry);
    glm::dmat3 camera_to_world;
    glm::dvec3 centre;
    for (int r = 0; r < 3; ++r) {
        const json& row = (*matrix)[static_cast<std::size_t>(r)];
        if (!row.is_array() || row.size() != 4)
            throw Error(where, "a row of transform_matrix does not hold 4 numbers", kCorrectEntry);
        for (int c = 0; c < 4; ++c) {
            // JSON has no NaN; writers put null or a string in its place.
            const json& value = row[static_cast<std::size_t>(c)];
            const double number = value.is_number() ? value.get<double>() : std::nan("");
            if (c < 3)
                camera_to_world[c][r] = number;
            else
                centre[r] = number;
        }
    }
    camera_to_world[1] = -camera_to_world[1];
    camera_to_world[2] = -camera_to_world[2];
    const bool scaled = remove_scale(camera_to_world);
    frame.rotation = glm::transpose(checked_rotation(camera_to_world, where));
    check_position(centre, where);
    frame.translation = -(frame.rotation * centre);
    return scaled;
}

json parse_json(std::string_view text, const std::string& where) {
    try {
        return json::parse(text);
    } catch (const json::exception& error) {
        throw Error(where, fmt::format("is no valid JSON: {}", error.what()),
                    "Correct or export the file again.");
    }
}

/// COLMAP's name of a nerfstudio or instant-ngp camera.
std::string model_name(const TransformsIntrinsics& in, const std::string& where) {
    std::string name = in.camera_model;
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::toupper(c); });
    if (name == "OPENCV_FISHEYE" || name == "FISHEYE" || (name.empty() && in.is_fisheye))
        return "OPENCV_FISHEYE";
    constexpr std::string_view kPerspective[] = {"",        "OPENCV",        "FULL_OPENCV",
                                                 "RADIAL",  "SIMPLE_RADIAL", "PERSPECTIVE",
                                                 "PINHOLE", "SIMPLE_PINHOLE"};
    for (const std::string_view known : kPerspective) {
        if (name != known) continue;
        // COLMAP's k4 to k6 stand in the denominator; nerfstudio's k4 is the numerator's r^8.
        const bool rational = name == "FULL_OPENCV" || in.k[4] != 0 || in.k[5] != 0;
        if (in.k[3] != 0 && !rational) return std::string(kFourRadial);
        if (in.k[2] != 0 || in.k[3] != 0 || in.k[4] != 0 || in.k[5] != 0) return "FULL_OPENCV";
        const bool distorted = in.k[0] != 0 || in.k[1] != 0 || in.p1 != 0 || in.p2 != 0;
        return distorted ? "OPENCV" : "PINHOLE";
    }
    throw Error(where, fmt::format("the camera_model {} cannot be read", in.camera_model),
                "Use perspective or fisheye photos (OPENCV, OPENCV_FISHEYE, PINHOLE).");
}

}  // namespace

TransformsFile parse_transforms(std::string_view text, const std::string& where) {
    const json root = parse_json(text, where);
    if (root.is_array() && !root.empty() && root[0].is_object() && root[0].contains("shots"))
        throw Error(where, "is a reconstruction of OpenSfM, which is not read",
                    "Export it for COLMAP (opensfm export_colmap) and name that folder.");
    if (!root.is_object() || !root.contains("frames") || !root["frames"].is_array())
        throw Error(where, "has no list named frames",
                    root.is_array()
                        ? "This looks like a cameras.json: use it with --cameras."
                        : "A transforms.json of NeRF, instant-ngp or nerfstudio is needed.");
    TransformsFile file;
    TransformsIntrinsics defaults;
    read_intrinsics(root, where, defaults);
    file.ply_file_path = read_string(root, "ply_file_path", where);
    std::optional<double> unit;
    read_number(root, "depth_unit_scale_factor", where, unit);
    file.depth_unit = unit.value_or(0);
    if (unit && !(*unit > 0 && *unit < 1e6))
        throw Error(where, fmt::format("depth_unit_scale_factor is {}", *unit),
                    "Give the metres of a step, as 0.001.");
    for (const char* key : {"test_filenames", "val_filenames"}) {
        const auto test = root.find(key);
        if (!file.test_filenames.empty() || test == root.end() || !test->is_array()) continue;
        for (const json& name : *test)
            if (name.is_string()) file.test_filenames.push_back(name.get<std::string>());
    }
    const json& frames = root["frames"];
    for (std::size_t i = 0; i < frames.size(); ++i) {
        TransformsFrame frame;
        std::string record = fmt::format("{}, frame {} of {}", where, i + 1, frames.size());
        if (!frames[i].is_object()) throw Error(record, "is not an object", kCorrectEntry);
        frame.file_path = read_string(frames[i], "file_path", record);
        if (frame.file_path.empty()) throw Error(record, "has no file_path", kCorrectEntry);
        record += fmt::format(" ({})", frame.file_path);
        frame.mask_path = read_string(frames[i], "mask_path", record);
        frame.depth_path = read_string(frames[i], "depth_file_path", record);
        frame.intrinsics = defaults;
        read_intrinsics(frames[i], record, frame.intrinsics);
        file.scaled_poses += read_pose(frames[i], record, frame) ? 1 : 0;
        file.frames.push_back(std::move(frame));
    }
    return file;
}

LensModel lens_from_transforms(const TransformsIntrinsics& in, int width, int height,
                               const std::string& where) {
    const double w = in.w.value_or(width), h = in.h.value_or(height);
    if (!(w >= 1 && w <= 1e6 && h >= 1 && h <= 1e6))
        throw Error(where, fmt::format("the photo size {} x {} is not valid", w, h),
                    "Correct w and h.");
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

}  // namespace darb
