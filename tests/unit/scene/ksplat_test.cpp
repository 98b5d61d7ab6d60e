// SPDX-License-Identifier: MIT
// .ksplat: files built by hand at each compression level.
#include <fmt/format.h>

#include <array>

#include "engine/scene/quantise.h"
#include "engine/scene/splat_file.h"
#include "tests/support/ksplat_file.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

const Reader kReadKsplat = [](std::span<const std::byte> file) {
    return parse_splats(file, "test.ksplat");
};

TEST(Ksplat, every_level_and_degree_is_read) {
    for (const int level : {0, 1, 2})
        for (const int degree : {0, 1, 2}) {
            const FileBytes file = ksplat_file(level, degree);
            SplatFile facts;
            const SplatModel model = parse_splats(file, "no name", &facts);
            EXPECT_EQ(facts.format, SplatFormat::ksplat);
            ASSERT_EQ(model.size(), 3u);
            EXPECT_EQ(model.sh_degree, degree);
            for (size_t i = 0; i < 3; ++i) {
                const KsplatSplat& splat = kKsplatSplats[i];
                for (size_t k = 0; k < 3; ++k) {
                    EXPECT_NEAR(model.position[3 * i + k], splat.position[k], level ? 1e-3 : 1e-6);
                    EXPECT_NEAR(model.log_scale[3 * i + k], std::log(splat.scale[k]), 1e-3);
                    EXPECT_NEAR(colour_of_dc(model.sh_dc[3 * i + k]), splat.rgba[k] / 255.0, 1e-6);
                }
                for (size_t k = 0; k < 4; ++k)
                    EXPECT_NEAR(model.rotation[4 * i + k], splat.rotation[k], 1e-3);
                EXPECT_NEAR(opacity_of(model.opacity_logit[i]), splat.rgba[3] / 255.0, 1e-5);
                const auto rest = static_cast<size_t>(model.rest_count());
                for (size_t c = 0; c < rest; ++c)
                    EXPECT_NEAR(model.sh_rest[i * rest + c], ksplat_harmonic(i, c),
                                level == 2 ? 0.01 : 1e-3)
                        << "level " << level << " degree " << degree << " splat " << i << " c "
                        << c;
            }
        }
}

TEST(Ksplat, halves_are_read) {
    EXPECT_EQ(half_to_float(0x3c00), 1);
    EXPECT_EQ(half_to_float(0xc000), -2);
    EXPECT_EQ(half_to_float(0x0001), std::ldexp(1.0f, -24));
    EXPECT_TRUE(std::isinf(half_to_float(0x7c00)));
    EXPECT_TRUE(std::isnan(half_to_float(0x7e00)));
}

TEST(Ksplat, hostile_headers_are_refused_by_name) {
    struct Case {
        size_t at;
        std::uint32_t word;
        const char* said;
    };
    for (const Case& c : std::vector<Case>{{0, 0x00000001, "version 1.0"},
                                           {4, 0xffffffffu, "sections"},
                                           {16, 7, "declares 7 splats"},
                                           {20, 3, "compression level 3"},
                                           {4096, 0xffffffffu, "in room for"},
                                           {4100, 0xffffffffu, "ends at byte"},
                                           {4108, 0xffffffffu, "ends at byte"},
                                           {4096 + 36, 0xffffffffu, "ends at byte"},
                                           {4096 + 8, 0, "in no bucket"},
                                           {4096 + 40, 3, "SH degree 3"},
                                           {4096 + 20, 8, "buckets of 8 bytes"}}) {
        FileBytes file = ksplat_file(1, 1);
        set_value(c.word, c.at, file);
        const std::string error = error_of([&] { kReadKsplat(file); });
        EXPECT_EQ(error.find("test.ksplat"), 0u) << error;
        EXPECT_NE(error.find(c.said), std::string::npos) << c.said << " in: " << error;
    }
}

TEST(Ksplat, it_is_not_written) {
    EXPECT_FALSE(format_to_write("a.ksplat"));
    EXPECT_NE(error_of([] {
                  encode_splats(SplatFormat::ksplat, sample_model(0, 1));
              }).find("can be read, but not written"),
              std::string::npos);
}

TEST(Ksplat, files_cut_off_at_every_byte_are_refused) {
    for (const int level : {0, 2}) expect_truncation_is_refused(ksplat_file(level, 1), kReadKsplat);
}

TEST(Ksplat, damaged_files_are_survived) {
    for (const int level : {0, 1, 2})
        expect_damage_is_survived(ksplat_file(level, 2), kReadKsplat, 300);
}

}  // namespace
}  // namespace darb::test
