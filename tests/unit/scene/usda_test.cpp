// SPDX-License-Identifier: MIT
// USD text: what is written is the schema's, read by a parser of its own, and comes back; files of
// others by hand; damage.
#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <string>

#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_file.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

SplatModel read_usda(const std::string& text, SplatFile* facts = nullptr) {
    FileBytes bytes;
    append_text(text, bytes);
    return parse_splats(bytes, "test.usda", facts);
}

std::string text_of(const SplatModel& model) {
    const FileBytes bytes = encode_splats(SplatFormat::usda, model);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// The numbers behind "NAME = [", by nothing but the standard library.
std::vector<double> numbers_of(const std::string& text, const std::string& name) {
    const std::size_t begin = text.find(name + " = [");
    if (begin == std::string::npos) return {};
    std::string part = text.substr(begin + name.size() + 4);
    part = part.substr(0, part.find(']'));
    std::ranges::replace_if(
        part, [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
    std::istringstream words(part);
    std::vector<double> numbers;
    for (std::string word; words >> word;) numbers.push_back(std::strtod(word.c_str(), nullptr));
    return numbers;
}

TEST(Usda, holds_the_attributes_of_the_schema) {
    SplatModel model = sample_model(2, 20);
    model.metres_per_unit = 0.25;
    const std::string text = text_of(model);
    EXPECT_TRUE(text.starts_with("#usda 1.0\n"));
    EXPECT_NE(text.find("def ParticleField3DGaussianSplat \"Splats\""), std::string::npos);
    EXPECT_NE(text.find("upAxis = \"Y\""), std::string::npos);
    EXPECT_NE(text.find("metersPerUnit = 0.25"), std::string::npos);
    EXPECT_NE(text.find("uniform int radiance:sphericalHarmonicsDegree = 2"), std::string::npos);
    const auto positions = numbers_of(text, "point3f[] positions"),
               rotations = numbers_of(text, "quatf[] orientations"),
               scales = numbers_of(text, "float3[] scales"),
               opacities = numbers_of(text, "float[] opacities"),
               harmonics = numbers_of(text, "float3[] radiance:sphericalHarmonicsCoefficients"),
               extent = numbers_of(text, "float3[] extent");
    ASSERT_EQ(positions.size(), 60u);
    ASSERT_EQ(rotations.size(), 80u);
    ASSERT_EQ(scales.size(), 60u);
    ASSERT_EQ(opacities.size(), 20u);
    ASSERT_EQ(harmonics.size(), 20u * 9 * 3);
    ASSERT_EQ(extent.size(), 6u);
    for (std::size_t i = 0; i < 20; ++i) {
        EXPECT_NEAR(opacities[i], opacity_of(model.opacity_logit[i]), 1e-6);
        for (std::size_t k = 0; k < 3; ++k) {
            const double turned = (k == 0 ? 1 : -1) * double{model.position[3 * i + k]};
            EXPECT_NEAR(positions[3 * i + k], turned, 1e-6) << "y is up";
            EXPECT_NEAR(scales[3 * i + k], std::exp(double{model.log_scale[3 * i + k]}),
                        1e-6 * scales[3 * i + k]);
            EXPECT_LE(extent[k], positions[3 * i + k]);
            EXPECT_GE(extent[3 + k], positions[3 * i + k]);
            EXPECT_NEAR(harmonics[27 * i + k], model.sh_dc[3 * i + k], 1e-6);
        }
        double square = 0;
        for (std::size_t k = 0; k < 4; ++k) square += rotations[4 * i + k] * rotations[4 * i + k];
        EXPECT_NEAR(square, 1, 1e-5);
    }
}

TEST(Usda, comes_back) {
    for (const int degree : {0, 1, 3}) {
        SplatModel model = sample_model(degree, 30);
        model.metres_per_unit = 2;
        const SplatModel got = read_usda(text_of(model));
        ASSERT_EQ(got.size(), model.size());
        EXPECT_EQ(got.sh_degree, degree);
        EXPECT_EQ(got.position, model.position);
        EXPECT_EQ(got.metres_per_unit, 2);
        for (std::size_t i = 0; i < got.size(); ++i) {
            EXPECT_NEAR(same_rotation(got, i, model, i), 1, 1e-6);
            EXPECT_NEAR(opacity_of(got.opacity_logit[i]), opacity_of(model.opacity_logit[i]), 1e-6);
            for (std::size_t k = 3 * i; k < 3 * i + 3; ++k)
                EXPECT_NEAR(got.log_scale[k], model.log_scale[k], 1e-5);
        }
        for (std::size_t k = 0; k < got.sh_rest.size(); ++k)
            ASSERT_NEAR(got.sh_rest[k], model.sh_rest[k], 1e-5) << k;
    }
}

constexpr const char* kOther = R"(#usda 1.0
( """A stage's own words, with } and "quotes"."""
    upAxis = "Z"
    customLayerData = { string creator = "x" dictionary d = { int a = 1 } }
)
# a comment with [ brackets
def Xform "World" ( kind = "component" )
{
    def Material "M" { token outputs:surface.connect = </World/M/S.outputs:surface> }
    def ParticleField3DGaussianSplat "Splat" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {
        rel material:binding = </World/M>
        float3[] extent = [(0, 0, 0), (1, 1, 1)]
        point3f[] positions = [(1, 2, 3), (4e0, -5, .5)] ( interpolation = "vertex" )
        half3[] scalesh = [(1, 2, 4), (0, 1, 1), ]
        uniform token projectionModeHint = "perspective"
        int radiance:sphericalHarmonicsDegree = 0
        float[] primvars:none
        float3[] radiance:sphericalHarmonicsCoefficients = [(1, 0, -1), (0, 0, 0)]
    }
}
)";

TEST(Usda, files_of_others_are_read) {
    SplatFile facts;
    const SplatModel m = read_usda(kOther, &facts);
    ASSERT_EQ(m.size(), 2u);
    EXPECT_EQ(facts.format, SplatFormat::usda);
    EXPECT_EQ(facts.up, "z");
    EXPECT_EQ(m.metres_per_unit, 0) << "nothing is said, so nothing is known";
    EXPECT_EQ(m.position, (std::vector<float>{1, 2, 3, 4, -5, 0.5f}));
    EXPECT_NEAR(m.log_scale[2], std::log(4), 1e-6);
    EXPECT_LT(m.log_scale[3], -19) << "no extent";
    EXPECT_EQ(m.rotation[0], 1) << "none is given";
    EXPECT_GT(opacity_of(m.opacity_logit[0]), 0.999999) << "none is given";
    EXPECT_EQ(m.sh_dc[2], -1);
}

std::string without(std::string text, const std::string& part, const std::string& in_its_place) {
    const std::size_t at = text.find(part);
    EXPECT_NE(at, std::string::npos) << part;
    return text.replace(at, part.size(), in_its_place);
}

TEST(Usda, what_cannot_be_read_is_refused_by_name) {
    const auto error = [](const std::string& text) {
        const std::string what = error_of([&] { read_usda(text); });
        EXPECT_EQ(what.find("test.usda"), 0u) << what;
        EXPECT_NE(what.find("\n  "), std::string::npos) << what;
        return what;
    };
    EXPECT_NE(error("#usda 1.0\n").find("0 prims"), std::string::npos);
    EXPECT_NE(error(without(kOther, "rel material:binding",
                            "uniform token[] xformOpOrder = [\"xformOp:scale\"]\nrel m"))
                  .find("xformOps"),
              std::string::npos);
    EXPECT_NE(error(without(kOther, "Degree = 0", "Degree = 4")).find("degree 4"),
              std::string::npos);
    EXPECT_NE(error(without(kOther, "point3f[] positions", "point3f[] places")).find("positions"),
              std::string::npos);
    EXPECT_NE(error(without(kOther, "4e0", "four")).find("line 16"), std::string::npos);
    EXPECT_NE(error(without(kOther, "\"Z\"", "\"X\"")).find("upAxis"), std::string::npos);
}

TEST(Usda, files_cut_off_or_damaged_are_survived) {
    FileBytes whole;
    append_text(without(kOther, "}\n}\n", "}\n}"), whole);
    const auto read = [](std::span<const std::byte> file) {
        return parse_splats(file, "test.usda");
    };
    expect_truncation_is_refused(whole, read);
    expect_damage_is_survived(whole, read, 2000);
}

}  // namespace
}  // namespace darb::test
