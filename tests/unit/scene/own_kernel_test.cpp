// SPDX-License-Identifier: MIT
// Scenes with a user's own kernel: the file keeps the kernel, and hostile headers are errors.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "engine/core/error.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/scene/dot_splat.h"
#include "engine/scene/ply.h"
#include "engine/scene/splat_file.h"
#include "tests/support/test_scene.h"

namespace darb {
namespace {

int bump() {
    static const int kernel = register_kernel(
        "bump_of_files", 7, [](double q) { return std::pow(std::cos(q / 5), 2) * (1 - q / 7); });
    return kernel;
}

SplatModel scene_of(int kernel, Footprint footprint = Footprint::psi) {
    SplatModel model = test::random_scene({.count = 3, .sh_degree = 0}).model;
    model.kernel = kernel;
    model.footprint = footprint;
    return model;
}

std::string text_of(const std::vector<std::byte>& bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

SplatModel parse_scene(const std::string& text, std::vector<std::string>* notes = nullptr) {
    PlyFacts facts;
    SplatModel model = parse_ply(std::as_bytes(std::span(text)), "own.ply", &facts);
    if (notes != nullptr) *notes = facts.notes;
    return model;
}

std::string error_of(const std::string& text) {
    try {
        parse_scene(text);
    } catch (const Error& e) {
        EXPECT_EQ(e.where, "own.ply");
        return e.reason;
    }
    return "taken";
}

/// An ASCII file of one splat with these comments.
std::string file_with(const std::string& comments) {
    std::string text = "ply\nformat ascii 1.0\n" + comments + "element vertex 1\n";
    for (const char* name : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0",
                             "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"})
        text += fmt::format("property float {}\n", name);
    return text + "end_header\n0 0 1 0 0 0 0 0 0 0 1 0 0 0\n";
}

TEST(OwnKernelFile, The_header_makes_the_same_kernel) {
    for (const Footprint footprint : {Footprint::psi, Footprint::exact}) {
        const SplatModel model = scene_of(bump(), footprint);
        const std::string text = text_of(encode_ply(model));
        EXPECT_NE(text.find("comment SplatKernel: bump_of_files\n"), std::string::npos);
        EXPECT_NE(text.find("comment SplatKernelPolynomial: w = (1 - x)^"), std::string::npos);
        const SplatModel again = parse_scene(text);
        EXPECT_EQ(again.kernel, bump());
        EXPECT_EQ(again.footprint, footprint);
        EXPECT_EQ(text_of(encode_ply(again)), text);
        const SplatModel packed =
            parse_splats(encode_splats(SplatFormat::compressed_ply, model), "own.compressed.ply");
        EXPECT_EQ(packed.kernel, bump());
    }
    EXPECT_EQ(text_of(encode_ply(scene_of(KERNEL_SINC))).find("SplatKernelFunction"),
              std::string::npos);
}

// Reads the file like a program that has never heard of the kernel: only the header tells.
TEST(OwnKernelFile, A_kernel_that_this_program_has_not_seen_is_made_from_the_header) {
    const std::string comments =
        "comment SplatKernel: of_elsewhere\n"
        "comment SplatKernelFunction: {\"edge_order\":2,\"series\":[1.0],\"support\":5.0}\n";
    EXPECT_FALSE(kernel_from_name("of_elsewhere"));
    const SplatModel model = parse_scene(file_with(comments));
    EXPECT_EQ(kernel_name(model.kernel), "of_elsewhere");
    EXPECT_NEAR(kernel_value(model.kernel, Footprint::psi, 2), std::pow(1 - 2 / 5.0, 2), 1e-14);
}

TEST(OwnKernelFile, Another_kernel_of_a_known_name_is_renamed_with_a_note) {
    bump();
    std::vector<std::string> notes;
    const SplatModel model =
        parse_scene(file_with("comment SplatKernel: bump_of_files\ncomment SplatKernelFunction: "
                              "{\"edge_order\":1,\"series\":[1],\"support\":4}\n"),
                    &notes);
    EXPECT_EQ(kernel_name(model.kernel), "bump_of_files_2");
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("bump_of_files_2"), std::string::npos) << notes[0];
}

// A file may be older than a kernel of the family with the same name.
TEST(OwnKernelFile, Names_of_the_family_get_a_number) {
    for (const std::string name : {"beta", "sinc"}) {
        std::vector<std::string> notes;
        const SplatModel model =
            parse_scene(file_with("comment SplatKernel: " + name +
                                  "\ncomment SplatKernelFunction: "
                                  "{\"edge_order\":1,\"series\":[1],\"support\":4}\n"),
                        &notes);
        EXPECT_EQ(kernel_name(model.kernel), name + "_2");
        ASSERT_EQ(notes.size(), 1u);
        EXPECT_NE(notes[0].find(name + "_2"), std::string::npos) << notes[0];
        EXPECT_EQ(kernel_name(parse_scene(text_of(encode_ply(model))).kernel), name + "_2");
    }
}

TEST(OwnKernelFile, Hostile_headers_are_errors) {
    const auto with = [](const std::string& name, const std::string& function) {
        return error_of(file_with("comment SplatKernel: " + name +
                                  "\ncomment SplatKernelFunction: " + function + "\n"));
    };
    EXPECT_NE(error_of(file_with("comment SplatKernel: nobodys\n")).find("unknown SplatKernel"),
              std::string::npos);
    EXPECT_EQ(with("a", "{"), "its comment SplatKernelFunction is no JSON object");
    EXPECT_EQ(with("a", "[1]"), "its comment SplatKernelFunction is no JSON object");
    EXPECT_EQ(with("a", "{}"), "a support of inf");
    EXPECT_EQ(with("a", "{\"support\": \"9\"}"), "'support' is no number: \"9\"");
    EXPECT_EQ(with("a", "{\"support\": 9}"), "a series of 0 terms");
    EXPECT_EQ(with("a", "{\"support\": 9, \"series\": [null]}"),
              "a term of 'series' is no number: null");
    EXPECT_EQ(with("a", "{\"support\": 1e9, \"series\": [1]}"), "a support of 1000000000");
    EXPECT_EQ(with("A b", "{\"support\": 9, \"series\": [1]}").substr(0, 25),
              "'A b' is no name of a ker");
    EXPECT_EQ(with("a", "{\"like\": \"sinc\", \"support\": 9}"),
              "its profile is that of no kernel that has such a form");
    std::string many = "1";
    for (int i = 0; i < 100'000; ++i) many += ",0";
    EXPECT_EQ(with("a", "{\"support\": 9, \"series\": [" + many + "]}"),
              "'series' is no list of 64 numbers at most");
    EXPECT_EQ(with("a", std::string(300'000, '[')),
              "its comment SplatKernelFunction is no JSON object");
    EXPECT_EQ(error_of(file_with("comment SplatKernel: " + std::string(9000, 'a') +
                                 "\ncomment SplatKernelFunction: {\"support\":9,\"series\":[1]}\n"))
                  .substr(0, 9),
              "'aaaaaaaa");
}

TEST(OwnKernelFile, A_header_cut_or_changed_at_every_byte_is_a_scene_or_an_error) {
    const std::string whole = text_of(encode_ply(scene_of(bump())));
    const std::size_t header = whole.find("end_header");
    ASSERT_NE(header, std::string::npos);
    for (std::size_t length = 0; length < whole.size(); length += length < header ? 1 : 29)
        EXPECT_NE(error_of(whole.substr(0, length)), "taken") << length;
    const std::size_t begin = whole.find("comment SplatKernel:");
    const std::size_t end = whole.find('\n', whole.find("SplatKernelFunction"));
    for (std::size_t at = begin; at < end; at += 13)  // each kernel that is taken costs 20 ms
        for (const char byte : {'9', '"', '\n'}) try {
                std::string changed = whole;
                changed[at] = byte;
                const SplatModel model = parse_scene(changed);
                EXPECT_TRUE(std::isfinite(kernel_psi(model.kernel)));
            } catch (const Error&) {
            }
}

/// `from` and `to` must have equal lengths, so that the chunks of a .glb keep their places.
std::vector<std::byte> changed(std::vector<std::byte> file, std::string_view from,
                               std::string_view to) {
    EXPECT_EQ(from.size(), to.size());
    const std::string text = text_of(file);
    std::size_t found = 0;
    for (std::size_t at = text.find(from); at != text.npos; at = text.find(from, at + 1), ++found)
        std::ranges::copy(std::as_bytes(std::span(to)),
                          file.begin() + static_cast<std::ptrdiff_t>(at));
    EXPECT_GT(found, 0u) << from;
    return file;
}

TEST(OwnKernelFile, glTF_keeps_the_kernel_too) {
    for (const Footprint footprint : {Footprint::psi, Footprint::exact}) {
        const SplatModel model = scene_of(bump(), footprint);
        const auto file = encode_splats(SplatFormat::gltf, model);
        const SplatModel again = parse_splats(file, "own.glb");
        EXPECT_EQ(again.kernel, bump());
        EXPECT_EQ(again.footprint, footprint);
        EXPECT_EQ(again.log_scale, model.log_scale);
    }
}

TEST(OwnKernelFile, glTF_makes_a_kernel_that_this_program_has_not_seen) {
    const auto file = encode_splats(SplatFormat::gltf, scene_of(bump()));
    const SplatModel unseen =
        parse_splats(changed(file, "\"bump_of_files\"", "\"bump_in_a_glb\""), "a");
    EXPECT_EQ(kernel_name(unseen.kernel), "bump_in_a_glb");
    for (const double q : {0.5, 3.0, 6.5})
        EXPECT_EQ(kernel_value(unseen.kernel, Footprint::psi, q),
                  kernel_value(bump(), Footprint::psi, q));
    SplatFile facts;
    const auto renamed = changed(file, "\"bump_of_files\"", "\"bump_in_a_glb\"");
    const auto other = changed(renamed, "\"support\":7", "\"support\":6");
    EXPECT_EQ(kernel_name(parse_splats(other, "a", &facts).kernel), "bump_in_a_glb_2");
    EXPECT_EQ(facts.notes.size(), 1u);
    for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
             {"\"support\":7", "\"support\":0"},
             {"\"series\":", "\"serie_\":"},
             {"\"bump_of_files\"", "\"Bump_of_files\""}})
        EXPECT_THROW(parse_splats(changed(file, from, to), "a"), Error) << to;
}

TEST(OwnKernelFile, Other_formats_say_that_they_have_no_place_for_it) {
    for (const SplatFormat format : {SplatFormat::spz, SplatFormat::dot_splat}) {
        const std::vector<std::string> losses = losses_of(format, scene_of(bump()), "x");
        EXPECT_NE(fmt::format("{}", fmt::join(losses, " ")).find("the kernel bump_of_files (psi)"),
                  std::string::npos);
    }
    EXPECT_TRUE(losses_of(SplatFormat::compressed_ply, scene_of(bump()), "x").empty());
}

// The best Gaussian for the profile: a slightly wider, narrower or fainter one is no closer.
TEST(OwnKernelFile, It_becomes_its_nearest_Gaussians) {
    GaussianEquivalent fit{};
    const SplatModel gaussians = as_gaussians(scene_of(bump()), true, &fit);
    EXPECT_EQ(gaussians.kernel, KERNEL_GAUSSIAN);
    EXPECT_GT(fit.error, 0.001);
    EXPECT_LT(fit.error, 0.3);
    const auto distance = [](double c) {
        double sum = 0;
        for (double q = 0.001; q < 40; q += 0.002)
            sum += std::pow(kernel_value(bump(), Footprint::psi, q) - std::exp(-q / (2 * c)), 2);
        return sum;
    };
    const double c = fit.covariance / covariance_scale(bump(), Footprint::psi);
    EXPECT_LT(distance(c), distance(1.01 * c));
    EXPECT_LT(distance(c), distance(0.99 * c));
}

}  // namespace
}  // namespace darb
