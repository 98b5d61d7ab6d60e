#include "engine/data/camera_list.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/lens_model.h"
#include "engine/data/pose.h"

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
    return view;
}

}  // namespace

std::vector<View> parse_camera_list(std::string_view text, const std::string& where) {
    json list;
    try {
        list = json::parse(text);
    } catch (const json::exception& error) {
        throw Error(where, fmt::format("is no valid JSON: {}", error.what()),
                    "Correct or export the file again.");
    }
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
    }
    DatasetOptions without_photos = options;
    without_photos.require_photos = false;
    Dataset dataset = load_dataset(path, without_photos);
    if (notes) *notes = std::move(dataset.notes);
    return std::move(dataset.views);
}

}  // namespace darb
