// SPDX-License-Identifier: MIT
#include "engine/publish/page_notes.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "engine/core/error.h"
#include "engine/core/files.h"

namespace darb {
namespace {

std::vector<PageNote> notes_of(const std::string& json) {
    const auto file = std::filesystem::path(testing::TempDir()) /
                      ("notes_" + std::to_string(::getpid()) + ".json");
    write_file_atomic(file, json);
    const auto remove = [&] { std::filesystem::remove(file); };
    try {
        std::vector<PageNote> notes = read_page_notes(file);
        remove();
        return notes;
    } catch (...) {
        remove();
        throw;
    }
}

std::string refusal(const std::string& json) {
    try {
        notes_of(json);
    } catch (const Error& error) {
        return error.what();
    }
    return "none";
}

TEST(PageNotes, other_members_of_the_file_are_ignored) {
    const auto notes = notes_of(
        R"({"version": 3, "views": [1], "notes": [{"at": [1, 2.5, -3], "title": "Door",
            "text": "first\nsecond", "colour": "red", "camera": null}, {"at": [0, 0, 0], "text": "x",
            "camera": {"position": [0, 0, -4], "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
                       "fx": 300, "fy": 300, "width": 640, "height": 480}}]})");
    ASSERT_EQ(notes.size(), 2u);
    EXPECT_EQ(notes[0].at, glm::dvec3(1, 2.5, -3));
    EXPECT_EQ(notes[0].title, "Door");
    EXPECT_EQ(notes[0].text, "first\nsecond");
    EXPECT_FALSE(notes[0].view);
    ASSERT_TRUE(notes[1].view);
    EXPECT_EQ(notes[1].view->camera.centre(), glm::dvec3(0, 0, -4));
    EXPECT_TRUE(notes_of(R"({"notes": []})").empty());
}

// Half a turn about y looks along -z; 90 degrees see as far up as ahead.
TEST(PageNotes, those_of_a_project_are_read) {
    const auto notes = notes_of(R"({"darb_project": 1, "notes": [{"at": [1, 2, 3], "title": "Door",
        "camera": {"eye": [1, 2, 7], "orientation": [0, 0, 1, 0], "fov_y_degrees": 90}}]})");
    ASSERT_EQ(notes.size(), 1u);
    ASSERT_TRUE(notes[0].view);
    const Camera& c = notes[0].view->camera;
    EXPECT_NEAR(glm::length(c.centre() - glm::dvec3(1, 2, 7)), 0, 1e-12);
    const glm::dvec3 p = c.rotation * notes[0].at + c.translation;
    EXPECT_NEAR(glm::length(p - glm::dvec3(0, 0, 4)), 0, 1e-12);
    EXPECT_NEAR(c.fy, 0.5 * c.height, 1e-9);
    EXPECT_NE(refusal(R"({"notes": [{"at": [1, 2, 3], "title": "a", "camera": {"eye": [1, 2, 7],
        "orientation": [1, 0, 0], "fov_y_degrees": 90}}]})")
                  .find("orientation"),
              std::string::npos);
}

TEST(PageNotes, bad_ones_are_named) {
    const auto contains = [](const std::string& json, const char* part) {
        EXPECT_NE(refusal(json).find(part), std::string::npos) << json << "\n" << refusal(json);
    };
    contains("[]", "no list `notes`");
    contains(R"({"notes": 4})", "no list `notes`");
    contains(R"({"notes": [{"at": [0, 0, 0], "title": "a"}, 5]})", "note 2");
    contains(R"({"notes": [{"title": "a"}]})", "at is not 3 numbers");
    contains(R"({"notes": [{"at": [1, 2], "title": "a"}]})", "at is not 3 numbers");
    contains(R"({"notes": [{"at": [1, 2, null], "title": "a"}]})", "at is not 3 numbers");
    contains(R"({"notes": [{"at": [1, 2, 1e40], "title": "a"}]})", "1e+40");
    contains(R"({"notes": [{"at": [1, 2, 3]}]})", "neither title nor text");
    contains(R"({"notes": [{"at": [1, 2, 3], "title": 5}]})", "title is not a string");
    contains(R"({"notes": [{"at": [1, 2, 3], "title": "a", "camera": {"fx": 3}}]})", "camera");
    contains(R"({"notes": [{)", "JSON");
}

}  // namespace
}  // namespace darb
