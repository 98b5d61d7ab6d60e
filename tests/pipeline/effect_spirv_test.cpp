// An effect that is off costs nothing: the SPIR-V of the projection passes with the effects'
// constants frozen and optimised holds no instruction of it and reads none of its data.
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "engine/core/files.h"
#include "engine/gpu/shader_table.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;

struct Constants {
    int degree = 0, off_centre = 0, antialias = 0, smoothing = 0, lens = 0;
};

/// What an optimised shader still holds.
struct Left {
    std::size_t instructions = 0;
    std::size_t atan = 0;             // only lenses need it
    std::size_t length_or_cross = 0;  // the compensation has one more than the factor
    std::set<int> bindings;
    std::set<int> camera_members;  // of CameraData, by index
};

bool has_tools() {
    return std::system("spirv-opt --version > /dev/null 2>&1") == 0 &&
           std::system("spirv-dis --version > /dev/null 2>&1") == 0;
}

/// The disassembly of a shader of the table with its constants frozen.
std::string optimised(const std::string& shader, const Constants& c) {
    const fs::path folder = fs::temp_directory_path() / fmt::format("darb_spirv_{}", ::getpid());
    fs::create_directories(folder);
    const fs::path in = folder / "in.spv", text = folder / "out.txt";
    for (const ShaderBinary& binary : shader_table())
        if (binary.name == shader) write_file_atomic(in, std::as_bytes(binary.words));
    const std::string command = fmt::format(
        "spirv-opt --set-spec-const-default-value '1:{0} 2:{0} 200:{1} 201:{2} 202:{3} 203:{4}' "
        "--freeze-spec-const --fold-spec-const-op-composite -O -O {5} -o - | spirv-dis "
        "--no-indent --raw-id -o {6} -",
        c.degree, c.off_centre, c.antialias, c.smoothing, c.lens, in.string(), text.string());
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    std::string result = read_text_file(text);
    fs::remove_all(folder);
    return result;
}

Left left_in(const std::string& shader, const Constants& c) {
    Left left;
    std::string camera_struct;
    std::set<std::string> cameras;  // ids of loaded cameras
    std::istringstream lines(optimised(shader, c));
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

constexpr int kPrincipal = 6, kRatioMin = 7, kFirstLens = 14;

class EffectSpirv : public testing::TestWithParam<const char*> {
  protected:
    void SetUp() override {
        if (!has_tools()) GTEST_SKIP() << "spirv-opt and spirv-dis (spirv-tools) are missing";
        none = left_in(GetParam(), {});
        backward = std::string(GetParam()) == "project_backward";
    }
    Left with(const Constants& c) const { return left_in(GetParam(), c); }
    bool reads_lens(const Left& left) const {
        return left.camera_members.lower_bound(kFirstLens) != left.camera_members.end();
    }
    Left none;
    bool backward = false;
};

TEST_P(EffectSpirv, what_is_off_leaves_no_instruction_and_no_read) {
    const int rest = 6, smoothing = backward ? 19 : 14;
    EXPECT_EQ(none.atan, 0u);
    EXPECT_FALSE(reads_lens(none));
    EXPECT_FALSE(none.bindings.count(smoothing));
    EXPECT_FALSE(none.bindings.count(rest));
    EXPECT_FALSE(none.camera_members.count(kPrincipal));
    EXPECT_FALSE(none.camera_members.count(kRatioMin));
    EXPECT_GT(none.camera_members.size(), 5u) << "the test no longer finds the camera's loads";

    // The same signs are there where the effect is on: the test can fail.
    const Left lens = with({.off_centre = 1, .lens = 1});
    EXPECT_GT(lens.atan, 0u);
    EXPECT_TRUE(reads_lens(lens));
    EXPECT_TRUE(with({.smoothing = 1}).bindings.count(smoothing));
    EXPECT_TRUE(with({.degree = 3}).bindings.count(rest));
    const Left centre = with({.off_centre = 1});
    EXPECT_TRUE(centre.camera_members.count(backward ? kRatioMin : kPrincipal));
    EXPECT_GT(with({.antialias = 1}).length_or_cross, none.length_or_cross);
}

TEST_P(EffectSpirv, every_effect_that_computes_adds_instructions) {
    EXPECT_GT(with({.degree = 1}).instructions, none.instructions);
    EXPECT_GT(with({.antialias = 1}).instructions, none.instructions);
    EXPECT_GT(with({.smoothing = 1}).instructions, none.instructions);
    EXPECT_GT(with({.off_centre = 1, .lens = 1}).instructions, none.instructions);
    const Left all = with({3, 1, 1, 1, 1});
    EXPECT_GT(all.instructions, none.instructions * 5 / 4);
}

INSTANTIATE_TEST_SUITE_P(Passes, EffectSpirv, testing::Values("project", "project_backward"),
                         [](const auto& i) { return std::string(i.param); });

}  // namespace
}  // namespace darb::test
