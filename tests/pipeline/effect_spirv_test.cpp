// SPDX-License-Identifier: MIT
// An effect that is off costs nothing: the SPIR-V of a pass with the effects' constants frozen and
// optimised holds no instruction of it and reads none of its data.
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "engine/core/files.h"
#include "engine/gpu/pipeline.h"
#include "engine/gpu/shader_table.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;

struct Constants {
    int degree = 0, off_centre = 0, antialias = 0, smoothing = 0, lens = 0, near_care = 0;
    int projection = 0;
    /// As spirv-opt takes them: id:value.
    std::string values() const {
        return fmt::format("1:{0} 2:{0} 200:{1} 201:{2} 202:{3} 203:{4} 204:{5} 206:{6}", degree,
                           off_centre, antialias, smoothing, lens, near_care, projection);
    }
};

/// What an optimised shader still holds.
struct Left {
    std::size_t instructions = 0;
    std::size_t atan = 0;             // only lenses need it
    std::size_t length_or_cross = 0;  // the compensation has one more than the factor
    std::size_t shifts = 0;           // to the right by an amount: a photo's alpha is rgba >> 24
    std::size_t accesses = 0;         // to push constants and buffers
    bool alpha_mask = false;          // compares with 0x80000000, an alpha of 128
    std::set<int> bindings;
    std::set<int> camera_members;  // members of CameraData, by index
};

bool has_tools() {
    return std::system("spirv-opt --version > /dev/null 2>&1") == 0 &&
           std::system("spirv-dis --version > /dev/null 2>&1") == 0;
}

/// The disassembly of a shader of the table with its constants frozen at values.
std::string optimised(const std::string& shader, const std::string& values) {
    const fs::path folder = fs::temp_directory_path() / fmt::format("darb_spirv_{}", ::getpid());
    fs::create_directories(folder);
    const fs::path in = folder / "in.spv", text = folder / "out.txt";
    for (const ShaderBinary& binary : shader_table())
        if (binary.name == shader) write_file_atomic(in, std::as_bytes(binary.words));
    const std::string command = fmt::format(
        "spirv-opt --set-spec-const-default-value '{}' --freeze-spec-const "
        "--fold-spec-const-op-composite -O -O {} -o - | spirv-dis --no-indent --raw-id -o {} -",
        values, in.string(), text.string());
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    std::string result = read_text_file(text);
    fs::remove_all(folder);
    return result;
}

Left left_in(const std::string& shader, const std::string& values) {
    Left left;
    std::string camera_struct;
    std::set<std::string> cameras;  // ids of loaded cameras
    std::istringstream lines(optimised(shader, values));
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        std::vector<std::string> w;
        for (std::string word; words >> word;) w.push_back(word);
        if (w.empty() || w[0] == ";") continue;
        const auto op = [&](const char* name) { return w.size() > 2 && w[2] == name; };
        left.instructions += w[0].starts_with("OpName") || w[0].starts_with("OpMember") ||
                                     w[0].starts_with("OpDecorate")
                                 ? 0
                                 : 1;
        left.atan += line.find(" Atan ") != std::string::npos ? 1 : 0;
        left.length_or_cross +=
            line.find(" Length ") != std::string::npos || line.find(" Cross ") != std::string::npos
                ? 1
                : 0;
        left.shifts += op("OpShiftRightLogical") ? 1 : 0;
        left.accesses += op("OpAccessChain") ? 1 : 0;
        left.alpha_mask |= op("OpConstant") && w.back() == "2147483648";
        if (w[0] == "OpDecorate" && w.size() == 4 && w[2] == "Binding")
            left.bindings.insert(std::stoi(w[3]));
        if (w[0] == "OpName" && w.size() == 3 && w[2] == "\"CameraData\"")
            camera_struct += w[1] + " ";
        if (op("OpLoad") && camera_struct.find(w[3] + " ") != std::string::npos)
            cameras.insert(w[0]);
        if (op("OpCopyLogical") && cameras.count(w[4]) > 0) cameras.insert(w[0]);
        if (op("OpCompositeExtract") && w.size() > 5 && cameras.count(w[4]) > 0)
            left.camera_members.insert(std::stoi(w[5]));
    }
    return left;
}

constexpr int kPrincipal = 6, kRatioMin = 7, kRatioMax = 8, kFirstLens = 14;

class EffectSpirv : public testing::TestWithParam<const char*> {
  protected:
    void SetUp() override {
        if (!has_tools()) GTEST_SKIP() << "spirv-opt and spirv-dis (spirv-tools) are missing";
        none = left_in(GetParam(), Constants{}.values());
        backward = std::string(GetParam()) == "project_backward";
    }
    Left with(const Constants& c) const { return left_in(GetParam(), c.values()); }
    bool reads_lens(const Left& left) const {
        return left.camera_members.lower_bound(kFirstLens) != left.camera_members.end();
    }
    Left none;
    bool backward = false;
};

TEST_P(EffectSpirv, what_is_off_leaves_no_instruction_and_no_read) {
    const int rest = 6, smoothing = backward ? 25 : 15;
    EXPECT_EQ(none.atan, 0u);
    EXPECT_FALSE(reads_lens(none));
    EXPECT_FALSE(none.bindings.count(smoothing));
    EXPECT_FALSE(none.bindings.count(rest));
    EXPECT_FALSE(none.camera_members.count(kPrincipal));
    EXPECT_FALSE(none.camera_members.count(kRatioMin));
    EXPECT_FALSE(none.camera_members.count(kRatioMax));
    EXPECT_GT(none.camera_members.size(), 5u) << "the test no longer finds the camera's loads";

    // The same signs are there where the effect is on: the test can fail.
    const Left lens = with({.off_centre = 1, .lens = 1});
    EXPECT_GT(lens.atan, 0u);
    EXPECT_TRUE(reads_lens(lens));
    EXPECT_TRUE(with({.smoothing = 1}).bindings.count(smoothing));
    EXPECT_TRUE(with({.degree = 3}).bindings.count(rest));
    if (!backward) {
        EXPECT_TRUE(with({.off_centre = 1}).camera_members.count(kPrincipal));
    }
    EXPECT_TRUE(with({.off_centre = 1, .near_care = 1}).camera_members.count(kRatioMin));
    EXPECT_TRUE(with({.near_care = 1}).camera_members.count(kRatioMax));
    EXPECT_GT(with({.antialias = 1}).length_or_cross, none.length_or_cross);
}

TEST_P(EffectSpirv, every_effect_that_computes_adds_instructions) {
    EXPECT_GT(with({.degree = 1}).instructions, none.instructions);
    EXPECT_GT(with({.antialias = 1}).instructions, none.instructions);
    EXPECT_GT(with({.smoothing = 1}).instructions, none.instructions);
    EXPECT_GT(with({.off_centre = 1, .lens = 1}).instructions, none.instructions);
    EXPECT_GT(with({.near_care = 1}).instructions, none.instructions);
    const Left points = with({.projection = 1}), by_flag = with({.projection = 2});
    EXPECT_GT(points.instructions, none.instructions);
    EXPECT_GT(by_flag.instructions, points.instructions);
    const Left all = with({3, 1, 1, 1, 1, 1});
    EXPECT_GT(all.instructions, none.instructions * 5 / 4);
}

INSTANTIATE_TEST_SUITE_P(Passes, EffectSpirv, testing::Values("project", "project_backward"),
                         [](const auto& i) { return std::string(i.param); });

class PassSpirv : public testing::Test {
  protected:
    void SetUp() override {
        if (!has_tools()) GTEST_SKIP() << "spirv-opt and spirv-dis (spirv-tools) are missing";
    }
};

// Constant 3 of the loss is USE_MASK, 4 is USE_ALPHA; args has the background's three members.
TEST_F(PassSpirv, loss_without_alpha_reads_neither_alpha_nor_background) {
    const Left none = left_in("loss", "3:0 4:0"), masked_none = left_in("loss", "3:1 4:0");
    const Left blended = left_in("loss", "3:0 4:1"), masked = left_in("loss", "3:1 4:1");
    EXPECT_EQ(none.shifts, 0u);
    EXPECT_FALSE(none.alpha_mask);
    EXPECT_EQ(masked_none.instructions, none.instructions);
    EXPECT_GT(blended.shifts, 0u);
    EXPECT_GE(blended.accesses, none.accesses + 3) << "the background's";
    EXPECT_GT(blended.instructions, none.instructions);
    EXPECT_TRUE(masked.alpha_mask);
    EXPECT_GT(masked.instructions, none.instructions);
}

// Constant 32 is DEPTH_SUM, 35 DEPTH_SPREAD, 36 FLATNESS; 3 of depth_loss is MEASURED, 2 of
// adam_update STEP.
TEST_F(PassSpirv, what_lays_splats_on_surfaces_is_not_there_where_it_is_off) {
    for (const char* pass :
         {"blend", "blend_records", "blend_backward", "blend_backward_team", "bucket_behind",
          "blend_backward_pixels", "blend_backward_buckets", "depth_loss"}) {
        SCOPED_TRACE(pass);
        const Left none = left_in(pass, "32:0 35:0"), sum = left_in(pass, "32:1 35:0"),
                   spread = left_in(pass, "32:1 35:1");
        EXPECT_GT(spread.instructions, sum.instructions);
        EXPECT_GT(spread.accesses, sum.accesses);
        if (pass != std::string("depth_loss")) {
            EXPECT_GT(sum.instructions, none.instructions);
        }
    }
    EXPECT_GT(left_in("depth_loss", "3:1 35:1").instructions,
              left_in("depth_loss", "3:0 35:1").instructions);
    for (const char* values : {"3:0 36:", "2:1 36:"}) {  // UPDATE_ADAM, and STEP_SCALE
        const char* pass = values[0] == '3' ? "project_backward" : "adam_update";
        const Left rounder = left_in(pass, values + std::string("0")),
                   flatter = left_in(pass, values + std::string("1"));
        EXPECT_GT(flatter.instructions, rounder.instructions) << pass;
        EXPECT_GT(flatter.accesses, rounder.accesses) << pass;
    }
}

// Constant 1 of emit is COOPERATE, 4 of blend is SEGMENT.
TEST_F(PassSpirv, frames_without_huge_splats_know_no_list_of_huge_splats_and_no_segments) {
    const Left alone = left_in("emit", "1:0"), cooperating = left_in("emit", "1:1");
    EXPECT_FALSE(alone.bindings.count(9));
    EXPECT_TRUE(cooperating.bindings.count(9));
    EXPECT_GT(cooperating.instructions, alone.instructions);
    const Left whole = left_in("blend", "4:0"), parts = left_in("blend", "4:8192");
    EXPECT_FALSE(whole.bindings.count(7)) << "the pixels' transmittance between dispatches";
    EXPECT_TRUE(parts.bindings.count(7));
    EXPECT_GT(parts.instructions, whole.instructions);
}

// Constant 103 is KERNEL_FORM: 0 compact, 1 Gaussian, 4 that of the kernel beta.
TEST_F(PassSpirv, kernels_without_shapes_read_and_write_no_exponent) {
    struct Pass {
        const char* shader;
        std::set<int> bindings;  // those of shapes, exponents and their sums
    };
    for (const Pass& pass :
         {Pass{"project", {7, 16}}, Pass{"blend", {10}}, Pass{"blend_records", {10}},
          Pass{"blend_backward", {16, 17}}, Pass{"blend_backward_team", {16, 17}},
          Pass{"blend_backward_pixels", {16, 17}}, Pass{"blend_backward_buckets", {14}},
          Pass{"project_backward", {7, 14, 27}}, Pass{"densify_split", {5}},
          Pass{"relocate", {5}}}) {
        SCOPED_TRACE(pass.shader);
        const std::set<std::string> counted{"densify_split", "relocate"};  // constant 2: SHAPES
        const bool split = counted.contains(pass.shader);
        const Left shaped = left_in(pass.shader, split ? "2:16" : "103:4");
        for (const char* without : {"103:0", "103:1"}) {
            const Left plain = left_in(pass.shader, split ? "2:1" : without);
            for (const int binding : pass.bindings) {
                EXPECT_FALSE(plain.bindings.count(binding)) << binding;
                EXPECT_TRUE(shaped.bindings.count(binding)) << binding;
            }
        }
    }
}

// Constant 9 of these is WINDOW_INTERSECTIONS.
TEST_F(PassSpirv, sums_that_one_binding_holds_know_no_windows) {
    for (const auto& [shader, first] : {std::pair{"blend_backward", 9}, {"project_backward", 17}}) {
        const Left whole = left_in(shader, "9:0"), windows = left_in(shader, "9:640");
        EXPECT_TRUE(whole.bindings.count(first)) << shader;
        EXPECT_FALSE(whole.bindings.count(first + 1)) << shader;
        EXPECT_TRUE(windows.bindings.count(first + 4)) << shader;
    }
}

}  // namespace
}  // namespace darb::test
