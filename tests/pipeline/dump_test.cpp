// SPDX-License-Identifier: MIT
// darb check --dump: the arrays of a view, from the shaders and from the reference, against central
// differences by the values that a PLY file stores.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>

#include "engine/check/dump.h"
#include "engine/check/run_checks.h"
#include "engine/core/files.h"
#include "engine/core/rng.h"
#include "engine/reference/reference_render.h"
#include "engine/scene/ply.h"
#include "tests/support/compare_arrays.h"
#include "tests/support/shared_device.h"
#include "tests/support/test_scene.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;

/// Reads what NumPy would: the header's text, then the values.
template <class T>
std::vector<T> read_npy(const fs::path& path, const std::string& type, const std::string& shape) {
    const auto file = read_file(path);
    const auto* text = reinterpret_cast<const char*>(file.data());
    EXPECT_EQ(std::string(text, 8), std::string("\x93NUMPY\x01\x00", 8));
    const size_t length = static_cast<unsigned char>(text[8]) +
                          256 * static_cast<size_t>(static_cast<unsigned char>(text[9]));
    EXPECT_EQ((10 + length) % 64, 0U);
    const std::string head(text + 10, length);
    EXPECT_EQ(head.back(), '\n');
    EXPECT_NE(head.find("'descr': '" + type + "', 'fortran_order': False, 'shape': " + shape),
              std::string::npos)
        << head;
    std::vector<T> values((file.size() - 10 - length) / sizeof(T));
    std::memcpy(values.data(), file.data() + 10 + length, values.size() * sizeof(T));
    return values;
}

/// The arrays of a folder as one row of gradients a splat, in the order of the PLY's properties.
template <class T>
std::vector<std::vector<double>> ply_rows(const fs::path& folder, const std::string& type, size_t n,
                                          size_t rest) {
    std::vector<std::vector<double>> rows(n);
    const auto append = [&](const char* name, const std::string& shape, size_t stride) {
        const auto values = read_npy<T>(folder / (std::string(name) + ".npy"), type, shape);
        ASSERT_EQ(values.size(), n * stride) << name;
        for (size_t i = 0; i < values.size(); ++i) rows[i / stride].push_back(values[i]);
    };
    append("d_xyz", fmt::format("({},3,)", n), 3);
    for (auto& row : rows) row.insert(row.end(), 3, 0.0);  // nx ny nz
    append("d_f_dc", fmt::format("({},3,)", n), 3);
    append("d_f_rest", fmt::format("({},{},)", n, rest), rest);
    append("d_opacity", fmt::format("({},)", n), 1);
    append("d_scale", fmt::format("({},3,)", n), 3);
    append("d_rot", fmt::format("({},4,)", n), 4);
    return rows;
}

double loss_of(const SplatModel& model, const Camera& camera) {
    const auto image = reference::render(model, camera, {}).images.colour;
    double sum = 0;
    for (size_t i = 0; i < image.data.size(); ++i)
        sum += image.data[i] * static_cast<double>(i) / static_cast<double>(image.data.size() - 1);
    return sum;
}

TEST(Dump, arrays_are_the_slopes_by_the_values_of_the_ply) {
    const TestScene s =
        random_scene({.count = 12, .width = 40, .height = 30, .kernel = KERNEL_RAISED_COSINE});
    const fs::path folder = fs::path(testing::TempDir()) / fmt::format("darb_dump_{}", ::getpid());
    check::dump_from_device(shared_device(), s.model, s.camera, folder / "device");
    check::dump_from_reference(s.model, s.camera, folder / "double");
    const size_t n = s.model.size(), rest = 45;
    const auto truth = ply_rows<double>(folder / "double", "<f8", n, rest);
    const auto device = ply_rows<float>(folder / "device", "<f4", n, rest);
    const auto image = read_npy<float>(folder / "device/image.npy", "<f4", "(30,40,3,)");
    EXPECT_TRUE(compare("image", read_npy<double>(folder / "double/image.npy", "<f8", "(30,40,3,)"),
                        image, tolerance("image_float32")));
    fs::remove_all(folder);

    const std::vector<std::byte> file = encode_ply(s.model);
    const size_t properties = truth[0].size(), head = file.size() - n * properties * 4;
    Pcg32 rng(9);
    size_t compared = 0, missed = 0;
    for (size_t column = 0; column < properties; ++column) {
        const size_t splat = rng.below(static_cast<std::uint32_t>(n));
        const size_t at = head + (splat * properties + column) * 4;
        double loss[2], value[2];
        for (const int side : {0, 1}) {
            std::vector<std::byte> moved = file;
            float v;
            std::memcpy(&v, &moved[at], 4);
            v += side == 0 ? -0x1p-14f : 0x1p-14f;
            std::memcpy(&moved[at], &v, 4);
            value[side] = v;
            loss[side] = loss_of(parse_ply(moved, "moved"), s.camera);
        }
        const double slope = (loss[1] - loss[0]) / (value[1] - value[0]);
        const double expected = truth[splat][column];
        // A pixel that crosses the cut-off of 1/255 between the two moves the slope.
        missed += std::abs(slope - expected) > 2e-3 + 2e-3 * std::abs(expected) ? 1 : 0;
        compared += expected != 0 ? 1 : 0;
        EXPECT_NEAR(device[splat][column], expected, 1e-4 + 2e-3 * std::abs(expected)) << column;
    }
    EXPECT_GT(compared, 40U);
    EXPECT_LE(missed, 2U);
}

TEST(CheckRow, says_what_is_wrong) {
    const std::vector<double> truth{1, 2, 3}, bad{1, 2, 3.5};
    EXPECT_TRUE(check::compare_row("g", "n", truth, truth, "exact").pass);
    const check::Row row = check::compare_row("g", "n", truth, bad, "image_float32");
    EXPECT_FALSE(row.pass);
    EXPECT_EQ(row.outside, 1U);
    EXPECT_NEAR(row.error, 0.5, 1e-12);
    EXPECT_NE(row.detail.find("1 of 3 values outside"), std::string::npos) << row.detail;
    EXPECT_FALSE(check::compare_row("g", "n", truth, std::vector<double>{1, 2}, "exact").pass);
    EXPECT_FALSE(
        check::compare_row("g", "n", std::vector<double>{}, std::vector<double>{}, "exact").pass);
    EXPECT_FALSE(check::fact_row("g", "n", false, "why").pass);
}

}  // namespace
}  // namespace darb::test
