// SPDX-License-Identifier: MIT
#include "engine/publish/page_notes.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/core/text.h"
#include "engine/data/camera_list.h"

namespace darb {

namespace {

using nlohmann::json;

constexpr std::size_t kMostNotes = 1000, kLongestText = 10'000;  // bytes
constexpr const char* kNoteForm =
    "Write {\"notes\": [{\"at\": [0, 0, 1], \"title\": \"...\", \"text\": \"...\"}]}.";

std::string text_of(const json& note, const char* key, const std::string& where) {
    const json value = note.value(key, json(""));
    if (!value.is_string()) throw Error(where, fmt::format("{} is not a string", key), kNoteForm);
    const std::string text = value.get<std::string>();
    if (text.size() > kLongestText)
        throw Error(where,
                    fmt::format("{} has {} bytes; {} are allowed", key, text.size(), kLongestText),
                    "Shorten it.");
    return printable(text, true);
}

/// The camera of a note in a project: eye, orientation (w x y z, camera to world) and
/// fov_y_degrees.
View view_of_project(const json& camera, const std::string& where) {
    constexpr int kWidth = 1280, kHeight = 720;  // px; only the angle counts
    const auto numbers = [&](const char* key, std::size_t count) {
        const json list = camera.value(key, json());
        std::vector<double> read;
        for (std::size_t i = 0; list.is_array() && list.size() == count && i < count; ++i)
            if (list[i].is_number()) read.push_back(list[i].get<double>());
        if (read.size() != count)
            throw Error(where, fmt::format("{} is not {} numbers", key, count), kNoteForm);
        return read;
    };
    const std::vector<double> eye = numbers("eye", 3), q = numbers("orientation", 4);
    const json fov = camera.value("fov_y_degrees", json());
    if (!fov.is_number() || !(fov.get<double>() > 0 && fov.get<double>() < 180))
        throw Error(where, "fov_y_degrees is not between 0 and 180", kNoteForm);
    View view;
    Camera& c = view.camera;
    c.width = kWidth;
    c.height = kHeight;
    c.fx = c.fy = 0.5 * kHeight / std::tan(0.5 * glm::radians(fov.get<double>()));
    c.cx = 0.5 * kWidth;
    c.cy = 0.5 * kHeight;
    c.rotation = glm::transpose(rotation_from_quaternion({q[0], q[1], q[2], q[3]}, where));
    const glm::dvec3 centre(eye[0], eye[1], eye[2]);
    check_position(centre, where);
    c.translation = -(c.rotation * centre);
    return view;
}

PageNote note_of(const json& note, const std::string& where) {
    if (!note.is_object()) throw Error(where, "is not an object", kNoteForm);
    PageNote read;
    const json at = note.value("at", json());
    if (!at.is_array() || at.size() != 3) throw Error(where, "at is not 3 numbers", kNoteForm);
    for (int axis = 0; axis < 3; ++axis) {
        const json& value = at[static_cast<std::size_t>(axis)];
        if (!value.is_number()) throw Error(where, "at is not 3 numbers", kNoteForm);
        read.at[axis] = value.get<double>();
        if (!(std::abs(read.at[axis]) < 1e30))
            throw Error(where, fmt::format("at holds {}", read.at[axis]), kNoteForm);
    }
    read.title = text_of(note, "title", where);
    read.text = text_of(note, "text", where);
    if (read.title.empty() && read.text.empty())
        throw Error(where, "has neither title nor text", kNoteForm);
    if (const auto camera = note.find("camera"); camera != note.end() && camera->is_object()) {
        if (camera->contains("eye")) {
            read.view = view_of_project(*camera, where + ", camera");
            return read;
        }
        json record = *camera;
        record["img_name"] = read.title;
        read.view = parse_camera_list(json::array({record}).dump(), where + ", camera").front();
        read.view->camera.lens = {};
    }
    return read;
}

}  // namespace

std::vector<PageNote> read_page_notes(const std::filesystem::path& path) {
    const json file = parse_json_text(read_text_file(path), path.string(), kNoteForm);
    const json list = file.is_object() ? file.value("notes", json()) : json();
    if (!list.is_array()) throw Error(path.string(), "holds no list `notes`", kNoteForm);
    if (list.size() > kMostNotes)
        throw Error(path.string(),
                    fmt::format("holds {} notes; {} are allowed", list.size(), kMostNotes),
                    "Leave some out.");
    std::vector<PageNote> notes;
    for (const json& note : list)
        notes.push_back(note_of(note, fmt::format("{}, note {}", path.string(), notes.size() + 1)));
    return notes;
}

}  // namespace darb
