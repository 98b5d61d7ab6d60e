// SPDX-License-Identifier: MIT
#include "engine/publish/page_document.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>
#include <regex>
#include <vector>

#include "engine/core/files.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/scene/camera.h"
#include "engine/scene/subject.h"
#include "shaders/shared/limits.h"
#include "tests/support/splat_files.h"

namespace darb {
namespace {

constexpr const char* kHostile =
    "</script><img src=x onerror=hacked=1>\"'&{{scene}}\n\xe2\x80\xae ab\xe2\x80\xa8<!--\xff";

PageDocument document_of(const SplatModel& model) {
    PageDocument document;
    document.title = "A scene";
    for (const Camera& camera : orbit_cameras(model, 3, 64, 48))
        document.views.emplace_back().camera = camera;
    return document;
}

std::string page_of(const PageDocument& document, const SplatModel& model, int level = 0) {
    return page_document(document, model,
                         pack_page_splats(model, page_precision(level, model.kernel)));
}

nlohmann::json scene_of(const std::string& page) {
    const std::string mark = "id=\"scene\">";
    const std::size_t from = page.find(mark) + mark.size();
    return nlohmann::json::parse(page.substr(from, page.find("</script>", from) - from));
}

std::size_t count_of(const std::string& text, const std::string& part) {
    std::size_t count = 0;
    for (std::size_t at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++count;
    return count;
}

TEST(PageDocument, names_from_files_stay_text) {
    const SplatModel model = test::sample_model(0, 50);
    const PageDocument plain = document_of(model);
    PageDocument hostile = plain;
    hostile.title = hostile.facts = kHostile;
    for (View& view : hostile.views) view.name = kHostile;
    const std::string page = page_of(hostile, model), before = page_of(plain, model);
    for (const char* part : {"<script", "</script", "<img", "<!--", "onerror=hacked=1>"})
        EXPECT_EQ(count_of(page, part), count_of(before, part)) << part;
    for (const char* mark : {"\xe2\x80\xae", "\xe2\x80\xa8", "\xff"})
        EXPECT_EQ(count_of(page, mark), 0u);
    const std::string name = scene_of(page)["cameras"][0]["name"];
    EXPECT_TRUE(name.starts_with("</script><img src=x onerror=hacked=1>\"'&{{scene}}")) << name;
    EXPECT_EQ(count_of(page, "&lt;/script&gt;&lt;img"), 3u) << "title, label and heading";
}

TEST(PageDocument, fetches_nothing_and_forbids_it) {
    const SplatModel model = test::sample_model(1, 50);
    const std::string page = page_of(document_of(model), model);
    EXPECT_NE(page.find("default-src 'none'"), page.npos);
    for (const char* part : {"http://", "https://", "src=\"//", "import(", "fetch("})
        EXPECT_EQ(count_of(page, part), 0u) << part;
}

TEST(PageDocument, numbers_are_those_of_the_tree) {
    const SplatModel model = test::sample_model(3, 50);
    const nlohmann::json scene = scene_of(page_of(document_of(model), model));
    EXPECT_EQ(scene["near"], NEAR_DEFAULT);
    EXPECT_EQ(scene["lowPass"], LOW_PASS_DEFAULT);
    EXPECT_EQ(scene["jacobianMargin"], JACOBIAN_MARGIN);
    EXPECT_EQ(scene["count"], 50);
    EXPECT_EQ(scene["degree"], 3);
    EXPECT_EQ(scene["cameras"].size(), 3u);
    const std::string blend = scene["shaders"]["splat.frag"];
    EXPECT_NE(blend.find("#define ALPHA_MAX 0.99"), blend.npos);
}

TEST(PageDocument, script_is_at_most_60_kilobytes) {
    EXPECT_LT(page_script_bytes(), 90'000u) << "with the shaders of a plain page";
    EXPECT_LE(most_page_script_bytes(), 60'000u) << "with all that a page may have";
}

TEST(PageDocument, streamed_page_fetches_from_its_own_folder_alone) {
    const SplatModel model = test::sample_model(2, 50);
    const std::string page = streamed_page_document(document_of(model), model);
    EXPECT_NE(page.find("default-src 'none'"), page.npos);
    EXPECT_NE(page.find("connect-src 'self'\""), page.npos);
    for (const char* part : {"http://", "https://", "src=\"//", "import("})
        EXPECT_EQ(count_of(page, part), 0u) << part;
    EXPECT_EQ(count_of(page, "fetch("), 1u);
    EXPECT_EQ(count_of(page, kFirstPart.data()), 0u) << "it holds no splats";
    EXPECT_EQ(scene_of(page)["degree"], 2);
}

TEST(PageDocument, notes_and_ground_are_there_only_where_asked_for) {
    const SplatModel model = test::sample_model(0, 50);
    PageDocument document = document_of(model);
    const std::string plain = page_of(document, model);
    EXPECT_EQ(count_of(plain, "class Notes"), 0u);
    EXPECT_EQ(count_of(plain, "class Ground"), 0u);
    EXPECT_EQ(count_of(plain, "class Around"), 0u);
    document.notes = {{{1, 2, 3}, kHostile, std::string("two\nlines") + kHostile, {}}};
    document.collider = PageCollider{{{0, 0, 0}, {4, 0, 0}, {0, 0, 2}}, {{0, 2, 1}}, 0.5};
    const std::string page = page_of(document, model);
    for (const char* part : {"<script", "</script", "<img", "<!--", "onerror=hacked=1>"})
        EXPECT_EQ(count_of(page, part), count_of(plain, part)) << part;
    const nlohmann::json scene = scene_of(page);
    EXPECT_EQ(scene["notes"][0]["at"], nlohmann::json({1.0, 2.0, 3.0}));
    EXPECT_TRUE(scene["notes"][0]["text"].get<std::string>().starts_with("two\nlines"));
    EXPECT_EQ(scene["collider"]["vertices"], 3);
    EXPECT_EQ(scene["collider"]["faces"], 1);
    EXPECT_EQ(scene["collider"]["metres"], 0.5);
    EXPECT_EQ(scene["collider"]["step"][0], 4 / 65535.0);
}

// ES as glslang knows it; the browser's own compiler has the last word in tools/page_check.py.
TEST(PageDocument, shaders_of_every_kernel_are_glsl_es) {
    const std::filesystem::path folder =
        std::filesystem::path(testing::TempDir()) / fmt::format("page_{}", ::getpid());
    std::string files;
    std::vector<int> kernels(KERNEL_ROWS);
    std::iota(kernels.begin(), kernels.end(), 0);
    kernels.push_back(*blend_from_name("blend:gaussian,raised_cosine"));
    for (const int kernel : kernels)
        for (const Footprint footprint : {Footprint::psi, Footprint::exact}) {
            if (footprint == Footprint::exact && !has_exact_footprint(kernel)) continue;
            SplatModel model = test::sample_model(kernel % 4, 20);
            set_kernel(model, kernel);
            model.footprint = footprint;
            model.antialias = kernel % 2 == 1;
            const nlohmann::json held = scene_of(page_of(document_of(model), model)),
                                 streamed =
                                     scene_of(streamed_page_document(document_of(model), model));
            for (const nlohmann::json* scene : {&held, &streamed})
                for (const auto& [name, source] : (*scene)["shaders"].items()) {
                    const auto file = folder / fmt::format("{}_{}_{}_{}", kernel, int(footprint),
                                                           int(scene == &streamed), name);
                    write_file_atomic(file, source.get<std::string>());
                    files += " '" + file.string() + "'";
                }
        }
    EXPECT_EQ(
        std::system(("glslangValidator" + files + " > '" + folder.string() + "/said'").c_str()), 0)
        << read_text_file(folder / "said");
    std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace darb
