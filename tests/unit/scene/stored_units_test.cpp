// SPDX-License-Identifier: MIT
// Files whose values are stored in other units than those of a 3DGS scene: they are doubted, judged
// by all their values, and read correctly where the user says how they are stored. Ordinary scenes
// are not doubted.
#include "engine/scene/stored_units.h"

#include <fmt/format.h>

#include <cmath>
#include <random>

#include "engine/scene/edit_splats.h"
#include "engine/scene/ply.h"
#include "engine/scene/quantise.h"
#include "engine/scene/splat_file.h"
#include "tests/support/splat_files.h"
#include "tests/support/test_data.h"

namespace darb::test {
namespace {

constexpr std::size_t kSplats = 2000;

// Flat splats in the surface of half a ball that overlap slightly, like trained ones.
SplatModel ball(int degree = 0, double radius = 1) {
    SplatModel model;
    model.sh_degree = degree;
    model.resize(kSplats);
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    for (std::size_t i = 0; i < kSplats; ++i) {
        glm::dvec3 n(normal(random), normal(random), normal(random));
        n = glm::normalize(glm::dvec3(n.x, n.y, std::abs(n.z)));
        const double size = radius * 0.05 * std::exp(0.6 * normal(random));
        // From z to the normal.
        const glm::dvec3 axis = glm::cross(glm::dvec3(0, 0, 1), n);
        const double w = 1 + n.z, length = std::sqrt(w * w + glm::dot(axis, axis));
        const double q[4] = {w / length, axis.x / length, axis.y / length, axis.z / length};
        for (std::size_t k = 0; k < 4; ++k) model.rotation[4 * i + k] = static_cast<float>(q[k]);
        for (std::size_t k = 0; k < 3; ++k) {
            model.position[3 * i + k] = static_cast<float>(radius * n[static_cast<int>(k)]);
            model.log_scale[3 * i + k] =
                static_cast<float>(std::log(k == 2 ? 0.1 * size : size * (1 + 0.2 * double(k))));
            model.sh_dc[3 * i + k] = static_cast<float>(0.9 * normal(random));
        }
        model.opacity_logit[i] = static_cast<float>(1 + 2 * normal(random));
        const auto rest = static_cast<std::size_t>(model.rest_count());
        for (std::size_t c = 0; c < rest / 3; ++c) {
            const double grey = 0.1 * normal(random);
            for (std::size_t k = 0; k < 3; ++k)
                model.sh_rest[i * rest + 3 * c + k] =
                    static_cast<float>(grey + 0.03 * normal(random));
        }
    }
    return model;
}

std::vector<std::string> doubts_of(const SplatModel& model, SplatFormat format = SplatFormat::ply,
                                   const StoredUnits& units = {}) {
    SplatFile file;
    parse_splats(encode_splats(format, model), "test", &file, {}, {}, {}, units);
    return file.notes;
}

void expect_doubt(const std::vector<std::string>& notes, const std::string& part) {
    ASSERT_EQ(notes.size(), 1u) << part << fmt::format(", {} notes", notes.size());
    EXPECT_NE(notes[0].find(part), std::string::npos) << notes[0];
}

constexpr SplatFormat kUnitFormats[] = {SplatFormat::ply, SplatFormat::compressed_ply,
                                        SplatFormat::gltf};

TEST(StoredUnits, scenes_of_every_size_and_place_are_not_doubted) {
    for (const int degree : {0, 1, 3})
        for (const double radius : {1e-2, 1.0, 30.0, 1e4, 1e6}) {
            SplatModel model = ball(degree, radius);
            EXPECT_EQ(doubts_of(model), std::vector<std::string>{}) << radius;
            transform_splats({1, turn_of_up_axis("y"), glm::dvec3(0.0)}, model);  // about z
            EXPECT_EQ(doubts_of(model), std::vector<std::string>{}) << radius;
        }
}

TEST(StoredUnits, scenes_of_every_format_are_not_doubted) {
    for (const int degree : {0, 2})
        for (const SplatFormat format :
             {SplatFormat::compressed_ply, SplatFormat::gltf, SplatFormat::spz, SplatFormat::sog,
              SplatFormat::dot_splat})
            EXPECT_EQ(doubts_of(ball(degree), format), std::vector<std::string>{})
                << format_name(format);
}

TEST(StoredUnits, scenes_of_one_opacity_or_colour_are_not_doubted) {
    SplatModel model = ball();
    std::fill(model.opacity_logit.begin(), model.opacity_logit.end(), 0.0f);
    std::fill(model.sh_dc.begin(), model.sh_dc.end(), 0.00695f);  // points without colours: grey
    EXPECT_EQ(doubts_of(model), std::vector<std::string>{});
}

TEST(StoredUnits, lengths_in_the_place_of_scales_are_doubted_and_read) {
    for (const double radius : {1e-2, 1.0, 10.0, 100.0, 1e4}) {
        const SplatModel truth = ball(0, radius);
        SplatModel stored = truth;
        for (float& s : stored.log_scale) s = std::exp(s);
        for (const SplatFormat format : kUnitFormats) {
            if (radius > 1e3) continue;  // e to the stored value is no float32
            expect_doubt(doubts_of(stored, format), "--scales linear");
        }
        SplatModel read = parse_splats(encode_ply(stored), "test", nullptr, {}, {}, {},
                                       {.scales = StoredScales::linear});
        for (std::size_t i = 0; i < read.log_scale.size(); ++i)
            ASSERT_NEAR(read.log_scale[i], truth.log_scale[i], 1e-5) << radius;
        EXPECT_EQ(doubts_of(stored, SplatFormat::ply, {.scales = StoredScales::linear}),
                  std::vector<std::string>{});
    }
}

TEST(StoredUnits, opacities_in_the_place_of_logits_are_doubted_and_read) {
    const SplatModel truth = ball();
    SplatModel linear = truth, bytes = truth;
    for (std::size_t i = 0; i < kSplats; ++i) {
        linear.opacity_logit[i] = static_cast<float>(sigmoid(truth.opacity_logit[i]));
        bytes.opacity_logit[i] = std::round(255 * linear.opacity_logit[i]);
    }
    for (const SplatFormat format : {SplatFormat::ply, SplatFormat::compressed_ply,
                                     SplatFormat::gltf, SplatFormat::spz, SplatFormat::sog})
        expect_doubt(doubts_of(linear, format), "--opacities linear");
    expect_doubt(doubts_of(bytes), "--opacities bytes");
    const auto expect_read = [&](const SplatModel& stored, StoredOpacities opacities,
                                 double tolerance) {
        const SplatModel read =
            parse_splats(encode_ply(stored), "test", nullptr, {}, {}, {}, {.opacities = opacities});
        for (std::size_t i = 0; i < kSplats; ++i)
            ASSERT_NEAR(sigmoid(read.opacity_logit[i]), sigmoid(truth.opacity_logit[i]), tolerance);
    };
    expect_read(linear, StoredOpacities::linear, 1e-6);
    expect_read(bytes, StoredOpacities::bytes, 0.5 / 255 + 1e-6);
    SplatModel opaque = truth;  // every one, and no training of logits ends at 1
    std::fill(opaque.opacity_logit.begin(), opaque.opacity_logit.end(), 1.0f);
    expect_doubt(doubts_of(opaque), "--opacities linear");
}

TEST(StoredUnits, colours_in_the_place_of_harmonics_are_doubted_and_read) {
    const SplatModel truth = ball();
    SplatModel rgb = truth, bytes = truth;
    for (std::size_t i = 0; i < truth.sh_dc.size(); ++i) {
        rgb.sh_dc[i] = static_cast<float>(std::clamp(colour_of_dc(truth.sh_dc[i]), 0.0, 1.0));
        bytes.sh_dc[i] = std::round(255 * rgb.sh_dc[i]);
    }
    expect_doubt(doubts_of(rgb), "--colours rgb");
    expect_doubt(doubts_of(bytes), "--colours bytes");
    for (const auto& [stored, colours] :
         {std::pair{&rgb, StoredColours::rgb}, std::pair{&bytes, StoredColours::bytes}}) {
        const SplatModel read =
            parse_splats(encode_ply(*stored), "test", nullptr, {}, {}, {}, {.colours = colours});
        for (std::size_t i = 0; i < read.sh_dc.size(); ++i)
            ASSERT_NEAR(colour_of_dc(read.sh_dc[i]), rgb.sh_dc[i], 0.5 / 255 + 1e-5);
    }
}

TEST(StoredUnits, rotations_that_begin_with_x_are_doubted_and_read) {
    const SplatModel truth = ball();
    SplatModel stored = truth;
    for (std::size_t i = 0; i < kSplats; ++i)
        std::rotate(&stored.rotation[4 * i], &stored.rotation[4 * i] + 1,
                    &stored.rotation[4 * i] + 4);
    expect_doubt(doubts_of(stored), "--rotations xyzw");
    const StoredUnits units{.rotations = StoredRotations::xyzw};
    EXPECT_EQ(parse_splats(encode_ply(stored), "test", nullptr, {}, {}, {}, units).rotation,
              truth.rotation);
}

TEST(StoredUnits, harmonics_in_the_other_order_are_doubted_and_read) {
    for (const int degree : {1, 2, 3}) {
        const SplatModel truth = ball(degree);
        const auto rest = static_cast<std::size_t>(truth.rest_count()), count = rest / 3;
        SplatModel by_coefficient = truth;  // as a PLY has it whose writer forgot to transpose
        for (std::size_t i = 0; i < kSplats; ++i)
            for (std::size_t column = 0; column < rest; ++column)
                by_coefficient.sh_rest[i * rest + column % count * 3 + column / count] =
                    truth.sh_rest[i * rest + column];
        expect_doubt(doubts_of(by_coefficient), "--harmonics swapped");
        const StoredUnits units{.harmonics = StoredOrder::swapped};
        EXPECT_EQ(
            parse_splats(encode_ply(by_coefficient), "test", nullptr, {}, {}, {}, units).sh_rest,
            truth.sh_rest);
        SplatModel by_channel = truth;  // in a format that has them side by side
        for (std::size_t i = 0; i < kSplats; ++i)
            for (std::size_t column = 0; column < rest; ++column)
                by_channel.sh_rest[i * rest + column] =
                    truth.sh_rest[i * rest + column % count * 3 + column / count];
        expect_doubt(doubts_of(by_channel, SplatFormat::gltf), "--harmonics swapped");
    }
}

TEST(StoredUnits, what_cannot_be_as_it_is_said_is_refused) {
    const SplatModel model = ball();
    const auto error = [&](const StoredUnits& units) {
        return error_of(
            [&] { parse_splats(encode_ply(model), "a.ply", nullptr, {}, {}, {}, units); });
    };
    EXPECT_NE(error({.scales = StoredScales::linear}).find("scales below 0"), std::string::npos);
    EXPECT_NE(error({.opacities = StoredOpacities::linear}).find("a.ply"), std::string::npos);
    EXPECT_NE(error({.opacities = StoredOpacities::bytes}).find("--opacities bytes"),
              std::string::npos);
}

TEST(StoredUnits, a_dot_splat_of_logarithms_is_doubted_and_read) {
    const SplatModel truth = ball();
    FileBytes file = encode_splats(SplatFormat::dot_splat, truth);
    for (std::size_t i = 0; i < kSplats; ++i)
        std::memcpy(&file[32 * i + 12], &truth.log_scale[3 * i], 12);
    SplatFile facts;
    EXPECT_LT(parse_splats(file, "a.splat", &facts).size(), kSplats);
    expect_doubt(facts.notes, "--scales logarithms");
    EXPECT_EQ(
        parse_splats(file, "a.splat", &facts, {}, {}, {}, {.scales = StoredScales::logarithms})
            .log_scale,
        truth.log_scale);
}

TEST(StoredUnits, positions_that_float32_cannot_hold_are_doubted) {
    SplatModel model = ball();
    for (std::size_t i = 0; i < kSplats; ++i) {  // as a program of float32 writes map coordinates
        model.position[3 * i] += 498'000.0f;
        model.position[3 * i + 1] += 4'649'000.0f;
    }
    for (const SplatFormat format : {SplatFormat::ply, SplatFormat::dot_splat, SplatFormat::gltf})
        expect_doubt(doubts_of(model, format), "steps of 0.5, as float32");
    std::vector<double> text;  // positions rounded to six digits, as text gives float32
    for (const float p : model.position) text.push_back(std::stod(fmt::format("{}", p)));
    SplatModel read = model;
    set_positions(text, read);
    EXPECT_NE(position_doubt(read, 0).find("steps of 0.5, as float32"), std::string::npos);
    SplatModel shifted = ball();
    shifted.origin = {498'000, 4'649'000.25, 120};
    EXPECT_EQ(doubts_of(shifted), std::vector<std::string>{});  // doubles
    SplatModel large = ball(0, 1000);  // where splats are larger than the steps by far
    for (std::size_t i = 0; i < kSplats; ++i) large.position[3 * i] += 498'000.0f;
    EXPECT_EQ(doubts_of(large), std::vector<std::string>{});
}

TEST(StoredUnits, positions_in_coarse_steps_of_their_format_are_doubted) {
    SplatModel model = ball();
    for (std::size_t k = 0; k < 3; ++k) model.position[k] = 1e5f;  // SOG: a range for all
    model.log_scale[0] = model.log_scale[1] = 0;
    SplatModel tiny = ball(0, 1e-3);  // SPZ: steps of 1/4096 or so whatever the size
    EXPECT_EQ(doubts_of(model, SplatFormat::ply), std::vector<std::string>{});
    SplatFile file;
    parse_splats(encode_splats(SplatFormat::spz, ball()), "test", &file);
    EXPECT_GT(file.position_step, 0);
    EXPECT_NE(position_doubt(tiny, 1.0 / 4096).find("steps of 0.000244"), std::string::npos);
    EXPECT_EQ(position_doubt(ball(), file.position_step), "");
    parse_splats(encode_splats(SplatFormat::sog, model), "test", &file);
    EXPECT_GT(file.position_step, 1e-4);
}

TEST(StoredUnits, real_scenes_are_not_doubted) {
    const auto folder = test_data_folder();
    if (!folder) GTEST_SKIP() << kNoTestData;
    for (const char* name :
         {"splats/biker.compressed.ply", "splats/biker.decoded.ply", "splats/biker.spz",
          "splats/grimlock.compressed.ply", "splats/guitar.compressed.ply",
          "splats/gs_Skull_redux.splat", "splats/toy-cat.decoded.ply",
          "splats/Unicorn_Stuffy_cleaned.sog", "splats/playbot_sog",
          "fixtures/minimal_formats/playcanvas_test_64_sh3.compressed.ply"}) {
        SplatFile file;
        load_splats(*folder / name, &file);
        EXPECT_EQ(file.notes, std::vector<std::string>{}) << name;
    }
}

}  // namespace
}  // namespace darb::test
