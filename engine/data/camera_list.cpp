// SPDX-License-Identifier: MIT
#include "engine/data/camera_list.h"

#include <fmt/format.h>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/core/text.h"
#include "engine/data/lens_model.h"

namespace darb {

using nlohmann::json;

namespace {

constexpr const char* kCorrectRecord = "Correct the record, or export cameras.json again.";

double number(const json& record, const char* key, const std::string& where) {
    const auto at = record.find(key);
    if (at == record.end() || !at->is_number())
        throw Error(where, fmt::format("{} is not a number", key), kCorrectRecord);
    return at->get<double>();
}

int size_px(const json& record, const char* key, const std::string& where) {
    const double size = number(record, key, where);
    if (!(size >= 1 && size <= 1e6))
        throw Error(where, fmt::format("{} {} is not valid", key, size), kCorrectRecord);
    return static_cast<int>(size);
}

glm::dvec3 vector3(const json& list, const char* key, const std::string& where) {
    if (!list.is_array() || list.size() != 3 || !list[0].is_number() || !list[1].is_number() ||
        !list[2].is_number())
        throw Error(where, fmt::format("{} does not hold 3 numbers", key), kCorrectRecord);
    return {list[0].get<double>(), list[1].get<double>(), list[2].get<double>()};
}

View parse_view(const json& record, std::string where) {
    View view;
    if (!record.is_object()) throw Error(where, "is not an object", kCorrectRecord);
    const auto name = record.find("img_name");
    if (name == record.end() || !name->is_string())
        throw Error(where, "img_name is not a string", kCorrectRecord);
    view.name = name->get<std::string>();
    where += fmt::format(" ({})", view.name);
    Camera& camera = view.camera;
    camera.width = size_px(record, "width", where);
    camera.height = size_px(record, "height", where);
    camera.fx = number(record, "fx", where);
    camera.fy = number(record, "fy", where);
    camera.cx = record.contains("cx") ? number(record, "cx", where) : 0.5 * camera.width;
    camera.cy = record.contains("cy") ? number(record, "cy", where) : 0.5 * camera.height;
    view.lens.model = "PINHOLE";
    view.lens.parameters = {camera.fx, camera.fy, camera.cx, camera.cy};
    view.lens.width = camera.width;
    view.lens.height = camera.height;
    check_lens(view.lens, where);

    const json rotation = record.value("rotation", json());
    if (!rotation.is_array() || rotation.size() != 3)
        throw Error(where, "rotation does not hold 3 rows", kCorrectRecord);
    glm::dmat3 world_to_camera;  // its columns are the rows of camera to world
    for (int r = 0; r < 3; ++r)
        world_to_camera[r] = vector3(rotation[static_cast<std::size_t>(r)], "rotation", where);
    camera.rotation = checked_rotation(world_to_camera, where);
    const glm::dvec3 centre = vector3(record.value("position", json()), "position", where);
    check_position(centre, where);
    camera.translation = -(camera.rotation * centre);
    if (const auto shutter = record.find("shutter"); shutter != record.end()) {
        if (!shutter->is_object()) throw Error(where, "shutter is not an object", kCorrectRecord);
        camera.shutter = {true, vector3(shutter->value("turn", json()), "turn", where),
                          vector3(shutter->value("move", json()), "move", where)};
        check_position(camera.shutter.turn, where);
        check_position(camera.shutter.move, where);
    }
    return view;
}

constexpr const char* kExportPath =
    "Export the path again from nerfstudio's viewer, with its perspective camera.";

/// Reads 16 or 12 numbers row by row, or 3 to 4 rows of 4.
void read_path_pose(const json& frame, const std::string& where, Camera& camera) {
    const auto matrix = frame.find("camera_to_world");
    if (matrix == frame.end() || !matrix->is_array())
        throw Error(where, "has no camera_to_world", kExportPath);
    std::vector<double> numbers;
    const auto take = [&](const json& value) {
        // JSON has no NaN; writers put null in its place.
        numbers.push_back(value.is_number() ? value.get<double>() : std::nan(""));
    };
    for (const json& row : *matrix)
        if (row.is_array())
            for (const json& value : row) take(value);
        else
            take(row);
    if (numbers.size() != 16 && numbers.size() != 12)
        throw Error(where,
                    fmt::format("camera_to_world has {} numbers, not 16 or 12", numbers.size()),
                    kExportPath);
    glm::dmat3 axes;  // y up and z backwards, as in OpenGL
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) {
            const int entry = 4 * r + c;
            axes[c][r] = (c == 0 ? 1 : -1) * numbers[static_cast<std::size_t>(entry)];
        }
    const glm::dvec3 centre(numbers[3], numbers[7], numbers[11]);
    remove_scale(axes);
    camera.rotation = glm::transpose(checked_rotation(axes, where));
    check_position(centre, where);
    camera.translation = -(camera.rotation * centre);
}

View parse_path_frame(const json& frame, int width, int height, const std::string& where) {
    if (!frame.is_object()) throw Error(where, "is not an object", kExportPath);
    const double fov = number(frame, "fov", where);
    if (!(fov > 0 && fov < 180))
        throw Error(where, fmt::format("its fov of {} is not between 0 and 180 degrees", fov),
                    kExportPath);
    View view;
    Camera& camera = view.camera;
    camera.width = width;
    camera.height = height;
    camera.fy = 0.5 * height / std::tan(0.5 * fov * glm::pi<double>() / 180);
    camera.fx = camera.fy;
    camera.cx = 0.5 * width;
    camera.cy = 0.5 * height;
    view.lens.model = "PINHOLE";
    view.lens.parameters = {camera.fx, camera.fy, camera.cx, camera.cy};
    view.lens.width = width;
    view.lens.height = height;
    check_lens(view.lens, where);
    read_path_pose(frame, where, camera);
    return view;
}

/// Frames per second: as the file states them, or from its duration.
double fps_of(const json& root, std::size_t frames, const std::string& where) {
    const auto given = [&](const char* key) { return root.contains(key) && !root[key].is_null(); };
    const double fps = given("fps") ? number(root, "fps", where)
                       : given("seconds")
                           ? static_cast<double>(frames) / number(root, "seconds", where)
                           : NerfstudioPath{}.fps;
    if (fps > 0 && fps <= 1000) return fps;
    throw Error(where, fmt::format("has {} frames a second", fps), kExportPath);
}

NerfstudioPath read_nerfstudio_path(const json& root, const std::string& where) {
    const std::string type = root.contains("camera_type") && root["camera_type"].is_string()
                                 ? lower(root["camera_type"].get<std::string>())
                                 : "perspective";
    if (type != "perspective")
        throw Error(where,
                    fmt::format("its camera_type is {}, and pictures are drawn in perspective",
                                printable(type)),
                    kExportPath);
    const json& frames = root["camera_path"];
    if (!frames.is_array() || frames.empty())
        throw Error(where, "its list camera_path is empty", kExportPath);
    NerfstudioPath path;
    const int width = size_px(root, "render_width", where),
              height = size_px(root, "render_height", where);
    path.fps = fps_of(root, frames.size(), where);
    std::size_t other_aspect = 0;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const std::string record = fmt::format("{}, frame {} of {}", where, i + 1, frames.size());
        path.views.push_back(parse_path_frame(frames[i], width, height, record));
        path.views.back().name = fmt::format("frame_{:05}", i);
        const json aspect = frames[i].value("aspect", json());
        other_aspect += aspect.is_number() && std::abs(aspect.get<double>() * height - width) > 1;
    }
    if (other_aspect > 0)
        path.notes.push_back(fmt::format(
            "{} of {} frames of {} have another aspect than its size, {}x{}, which is drawn.",
            other_aspect, frames.size(), where, width, height));
    if (root.contains("crop") && !root["crop"].is_null())
        path.notes.push_back(where + " has a crop, which is not applied.");
    return path;
}

}  // namespace

std::optional<NerfstudioPath> parse_nerfstudio_path(std::string_view text,
                                                    const std::string& where) {
    const json root = json::parse(text, nullptr, false);
    if (!root.is_object() || !root.contains("camera_path")) return std::nullopt;
    return read_nerfstudio_path(root, where);
}

std::vector<View> parse_camera_list(std::string_view text, const std::string& where) {
    const json list = parse_json_text(text, where, "Correct or export the file again.");
    if (!list.is_array() || list.empty())
        throw Error(where, "holds no list of cameras", "A cameras.json of 3DGS is needed.");
    std::vector<View> views;
    for (std::size_t i = 0; i < list.size(); ++i)
        views.push_back(
            parse_view(list[i], fmt::format("{}, camera {} of {}", where, i + 1, list.size())));
    return views;
}

std::string format_camera_list(const std::vector<View>& views) {
    json list = json::array();
    for (std::size_t i = 0; i < views.size(); ++i) {
        const Camera& camera = views[i].camera;
        const glm::dvec3 centre = camera.centre();
        json rotation = json::array();
        for (int r = 0; r < 3; ++r)
            rotation.push_back(
                {camera.rotation[r][0], camera.rotation[r][1], camera.rotation[r][2]});
        json record = {{"id", i},
                       {"img_name", views[i].name},
                       {"width", camera.width},
                       {"height", camera.height},
                       {"position", {centre.x, centre.y, centre.z}},
                       {"rotation", rotation},
                       {"fy", camera.fy},
                       {"fx", camera.fx}};
        if (camera.cx != 0.5 * camera.width) record["cx"] = camera.cx;
        if (camera.cy != 0.5 * camera.height) record["cy"] = camera.cy;
        if (const auto& [rolls, turn, move] = camera.shutter; rolls)
            record["shutter"] = {{"turn", {turn.x, turn.y, turn.z}},
                                 {"move", {move.x, move.y, move.z}}};
        list.push_back(std::move(record));
    }
    // Names may hold any bytes.
    return list.dump(-1, ' ', false, json::error_handler_t::replace);
}

void write_camera_list(const std::filesystem::path& path, const std::vector<View>& views) {
    write_file_atomic(path, format_camera_list(views));
}

std::vector<View> load_cameras(const std::filesystem::path& path, const DatasetOptions& options,
                               std::vector<std::string>* notes) {
    std::filesystem::path list = path;
    if (std::filesystem::is_directory(path)) list = path / "cameras.json";
    if (std::filesystem::is_regular_file(list) && has_extension(list, ".json")) {
        const std::string text = read_text_file(list);
        const std::size_t first = text.find_first_not_of(" \t\r\n\xef\xbb\xbf");
        if (first != std::string::npos && text[first] == '[')
            return parse_camera_list(text, list.string());
        if (std::optional<NerfstudioPath> nerfstudio = parse_nerfstudio_path(text, list.string())) {
            if (notes) *notes = std::move(nerfstudio->notes);
            return std::move(nerfstudio->views);
        }
    }
    DatasetOptions without_photos = options;
    without_photos.require_photos = false;
    Dataset dataset = load_dataset(path, without_photos);
    if (notes) *notes = std::move(dataset.notes);
    return std::move(dataset.views);
}

std::vector<Camera> cameras_of(const std::vector<View>& views) {
    std::vector<Camera> cameras;
    for (const View& view : views) cameras.push_back(view.camera);
    return cameras;
}

namespace {

constexpr double kPoseTolerance = 1e-3;  // files with four decimals pass
constexpr const char* kFixPose = "Remove this photo from the file or calibrate it again.";

bool finite(const glm::dmat3& matrix) {
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            if (!std::isfinite(matrix[c][r])) return false;
    return true;
}

}  // namespace

glm::dmat3 rotation_from_quaternion(glm::dvec4 wxyz, const std::string& where) {
    const double norm = glm::length(wxyz);
    if (!std::isfinite(norm)) throw Error(where, "the rotation quaternion is not finite", kFixPose);
    if (!(norm > 1e-6)) throw Error(where, "the rotation quaternion is zero", kFixPose);
    wxyz /= norm;
    return glm::mat3_cast(glm::dquat(wxyz[0], wxyz[1], wxyz[2], wxyz[3]));
}

bool remove_scale(glm::dmat3& matrix) {
    const double scale =
        (glm::length(matrix[0]) + glm::length(matrix[1]) + glm::length(matrix[2])) / 3;
    if (!(scale > 0) || !(std::abs(scale - 1) > kPoseTolerance)) return false;
    matrix /= scale;
    return true;
}

glm::dmat3 checked_rotation(const glm::dmat3& matrix, const std::string& where) {
    if (!finite(matrix)) throw Error(where, "the pose holds NaN or infinity", kFixPose);
    const glm::dmat3 product = glm::transpose(matrix) * matrix;
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            if (!(std::abs(product[c][r] - (c == r ? 1.0 : 0.0)) <= kPoseTolerance))
                throw Error(where, "the rotation part of the pose is not orthonormal", kFixPose);
    if (!(glm::determinant(matrix) > 0))
        throw Error(where, "the rotation part of the pose mirrors (determinant -1)", kFixPose);
    glm::dmat3 rotation = matrix;  // Newton iteration of the polar decomposition
    for (int i = 0; i < 4; ++i)
        rotation = 0.5 * (rotation + glm::transpose(glm::inverse(rotation)));
    return rotation;
}

glm::dvec4 quaternion_from_rotation(const glm::dmat3& rotation) {
    const glm::dquat q = glm::normalize(glm::quat_cast(rotation));
    const glm::dvec4 wxyz(q.w, q.x, q.y, q.z);
    return q.w < 0 ? -wxyz : wxyz;
}

void check_position(glm::dvec3 position, const std::string& where) {
    if (!std::isfinite(position.x + position.y + position.z))
        throw Error(where, "the position of the camera is not finite", kFixPose);
}

}  // namespace darb
