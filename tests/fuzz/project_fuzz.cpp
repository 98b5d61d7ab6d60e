// SPDX-License-Identifier: MIT
// Any bytes as a project and as a script of edits. What is accepted reads back to the same text,
// and its edits are done on a few splats, forth and back.
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "engine/core/error.h"
#include "engine/scene/edit.h"
#include "engine/scene/edit_script.h"
#include "engine/scene/project_file.h"

namespace {

constexpr std::size_t kMostSplats = 1000;  // copies of copies grow fast

darb::SplatModel few_splats(const std::filesystem::path&) {
    darb::SplatModel model;
    model.sh_degree = 1;
    model.resize(3);
    for (std::size_t i = 0; i < model.size(); ++i) {
        model.rotation[4 * i] = 1;
        model.position[3 * i] = static_cast<float>(i);
    }
    return model;
}

void perform_all(const std::vector<darb::EditOperation>& operations) {
    darb::SplatModel model = few_splats({});
    darb::Edit edit(model, "first", "first.ply");
    for (const darb::EditOperation& one : operations) try {
            if (model.size() < kMostSplats) edit.perform(one, model, few_splats);
        } catch (const darb::Error&) {
        }
    edit.apply(model);
    while (edit.can_undo()) edit.undo(model);
    DARB_CHECK(model.size() == few_splats({}).size(), "{}", model.size());
    while (edit.can_redo()) edit.redo(model);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    try {
        const std::vector<darb::EditOperation> edits = darb::parse_edit_script(text, "fuzz", "");
        const std::string again = darb::format_edit_script(edits, "");
        DARB_CHECK(darb::format_edit_script(darb::parse_edit_script(again, "again", ""), "") ==
                   again);
        perform_all(edits);
    } catch (const darb::Error&) {
    }
    try {
        const darb::Project project = darb::parse_project(text, "fuzz", "");
        darb::parse_project(darb::format_project(project, ""), "again", "");
        perform_all(project.edits);
    } catch (const darb::Error&) {
    }
    return 0;
}
