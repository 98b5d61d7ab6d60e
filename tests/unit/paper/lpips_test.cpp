// SPDX-License-Identifier: MIT
// LPIPS against PyTorch with random weights (skips where PyTorch is missing), against convolutions
// by definition, and what it says of files that do not fit.
#include "tools/paper/lpips.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/rng.h"
#include "engine/data/image_io.h"
#include "engine/data/metrics.h"
#include "tools/paper/compare_runs.h"

namespace darb {
namespace {

namespace fs = std::filesystem;

ImageF random_image(int width, int height, std::uint64_t seed) {
    Pcg32 rng(seed);
    ImageF image(width, height, 3);
    for (float& v : image.data) v = static_cast<float>(rng.uniform());
    return image;
}

Tensor random_tensor(std::vector<std::size_t> shape, Pcg32& rng, double low, double high) {
    Tensor tensor{std::move(shape), {}};
    std::size_t count = 1;
    for (const std::size_t n : tensor.shape) count *= n;
    for (std::size_t i = 0; i < count; ++i)
        tensor.data.push_back(static_cast<float>(rng.uniform(low, high)));
    return tensor;
}

/// AlexNet of two channels everywhere.
Tensors tiny_alexnet() {
    Pcg32 rng(5);
    Tensors t;
    std::size_t in = 3;
    int head = 0;
    for (const auto& [index, side] :
         {std::pair<int, std::size_t>{0, 11}, {3, 5}, {6, 3}, {8, 3}, {10, 3}}) {
        t[fmt::format("features.{}.weight", index)] =
            random_tensor({2, in, side, side}, rng, -0.1, 0.2);
        t[fmt::format("features.{}.bias", index)] = random_tensor({2}, rng, -0.1, 0.1);
        t[fmt::format("lin{}.model.1.weight", head++)] = random_tensor({1, 2, 1, 1}, rng, 0, 1);
        in = 2;
    }
    return t;
}

ImageF read_image_file(const fs::path& path, int width, int height) {
    ImageF image(width, height, 3);
    const auto bytes = read_file(path);
    EXPECT_EQ(bytes.size(), image.data.size() * 4);
    std::memcpy(image.data.data(), bytes.data(), bytes.size());
    return image;
}

void compare_with_torch(const std::string& net, int divisor) {
    const fs::path folder =
        fs::path(testing::TempDir()) / fmt::format("lpips_{}_{}", net, ::getpid());
    fs::create_directories(folder);
    int status = 0;
    for (const char* python : {"python3", "/usr/bin/python3"}) {  // the first may be another one
        const std::string command = fmt::format(
            "{} '{}/tests/support/lpips_torch.py' {} {} '{}' > '{}'", python, DARB_SOURCE_DIR, net,
            divisor, folder.string(), (folder / "out.txt").string());
        status = std::system(command.c_str());
        if (status == 0) break;
    }
    if (WIFEXITED(status) && WEXITSTATUS(status) == 77) {
        fs::remove_all(folder);
        GTEST_SKIP() << "python3 has no torch (Debian: python3-torch)";
    }
    ASSERT_EQ(status, 0) << folder;
    double expected = 0, expected_3dgs = 0;
    std::istringstream(read_text_file(folder / "out.txt")) >> expected >> expected_3dgs;
    ASSERT_GT(expected, 0);
    const ImageF a = read_image_file(folder / "a.bin", 83, 61);
    const ImageF b = read_image_file(folder / "b.bin", 83, 61);
    const Lpips lpips({folder / "weights.safetensors"});
    EXPECT_EQ(lpips.net(), net == "alexnet" ? LpipsNet::alexnet : LpipsNet::vgg16);
    // Both sum some thousand products in float32, in another order.
    EXPECT_NEAR(lpips.distance(a, b), expected, 2e-5 * expected);
    EXPECT_NEAR(Lpips({folder / "weights.safetensors"}, {true, 2}).distance(a, b), expected_3dgs,
                2e-5 * expected_3dgs);
    fs::remove_all(folder);
}

TEST(Lpips, AlexNet_agreesWithTorch) {
    compare_with_torch("alexnet", 1);
}

TEST(Lpips, Vgg16_agreesWithTorch) {
    compare_with_torch("vgg16", 4);
}

TEST(Lpips, FirstMap_isTheConvolutionByDefinition) {
    const Tensors t = tiny_alexnet();
    const ImageF image = random_image(47, 39, 1);
    const LpipsFeatures f = Lpips(t, "tiny").features(image);
    ASSERT_EQ(f.maps.size(), 5u);
    const int width = (47 + 4 - 11) / 4 + 1, height = (39 + 4 - 11) / 4 + 1;
    ASSERT_EQ(f.maps[0].pixels, static_cast<std::size_t>(width * height));
    constexpr double kShift[] = {-0.030, -0.088, -0.188}, kScale[] = {0.458, 0.448, 0.450};
    const Tensor &w = t.at("features.0.weight"), &bias = t.at("features.0.bias");
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            double out[2];
            for (std::size_t o = 0; o < 2; ++o) {
                out[o] = bias.data[o];
                for (int c = 0; c < 3; ++c)
                    for (int v = 0; v < 11; ++v)
                        for (int u = 0; u < 11; ++u) {
                            const int sx = 4 * x + u - 2, sy = 4 * y + v - 2;
                            if (sx < 0 || sy < 0 || sx >= 47 || sy >= 39) continue;
                            const double in = (2 * image.at(sx, sy, c) - 1 - kShift[c]) / kScale[c];
                            out[o] += in * w.data[((o * 3 + c) * 11 + v) * 11 + u];
                        }
                out[o] = std::max(out[o], 0.0);
            }
            const double length = std::hypot(out[0], out[1]) + 1e-10;
            for (std::size_t o = 0; o < 2; ++o)
                EXPECT_NEAR(f.maps[0].data[o * f.maps[0].pixels + y * width + x], out[o] / length,
                            2e-5)
                    << x << ", " << y;
        }
}

TEST(Lpips, Distance_isZeroForEqualPicturesAndSymmetric) {
    const Lpips lpips(tiny_alexnet(), "tiny");
    const ImageF a = random_image(64, 48, 2), b = random_image(64, 48, 3);
    EXPECT_EQ(lpips.distance(a, a), 0);
    EXPECT_GT(lpips.distance(a, b), 0);
    EXPECT_DOUBLE_EQ(lpips.distance(a, b), lpips.distance(b, a));
}

TEST(Lpips, NamesOfThePackage_areUnderstood) {
    Tensors t = tiny_alexnet(), renamed;
    const char* slices[] = {"1.0", "2.3", "3.6", "4.8", "5.10"};
    const int indices[] = {0, 3, 6, 8, 10};
    for (int k = 0; k < 5; ++k) {
        for (const char* what : {"weight", "bias"})
            renamed[fmt::format("net.slice{}.{}", slices[k], what)] =
                t[fmt::format("features.{}.{}", indices[k], what)];
        renamed[fmt::format("lins.{}.model.1.weight", k)] =
            t[fmt::format("lin{}.model.1.weight", k)];
    }
    const ImageF a = random_image(40, 40, 2), b = random_image(40, 40, 3);
    EXPECT_EQ(Lpips(t, "a").distance(a, b), Lpips(renamed, "b").distance(a, b));
}

TEST(Lpips, MissingOrMisshapenTensor_isNamed) {
    Tensors t = tiny_alexnet();
    t.erase("lin3.model.1.weight");
    try {
        Lpips(t, "w.safetensors");
        FAIL() << "no error";
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("lin3.model.1.weight"), std::string::npos) << e.what();
    }
    t = tiny_alexnet();
    t["features.6.weight"].shape = {2, 1, 3, 6};
    EXPECT_THROW(Lpips(t, "w"), Error);
}

std::vector<std::byte> bytes_of(const std::string& header, std::size_t data) {
    std::vector<std::byte> file(8 + header.size() + data);
    const std::uint64_t length = header.size();
    std::memcpy(file.data(), &length, 8);
    std::memcpy(file.data() + 8, header.data(), header.size());
    return file;
}

TEST(Lpips, TensorInTwoFiles_isRefused) {
    const fs::path file = fs::path(testing::TempDir()) / fmt::format("twice_{}", ::getpid());
    write_file_atomic(file,
                      bytes_of(R"({"x":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}})", 4));
    try {
        Lpips({file, file});
        FAIL() << "no error";
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("has tensor x, as a file before it"),
                  std::string::npos)
            << e.what();
    }
    fs::remove(file);
}

TEST(ViewLpips, PhotosThatDoNotFit_areMeasuredAllTheSame) {
    const fs::path folder = fs::path(testing::TempDir()) / fmt::format("views_{}", ::getpid());
    const Lpips lpips(tiny_alexnet(), "tiny");
    ComparedRun run;
    run.at.emplace_back();
    for (const char* name : {"a", "b"}) {
        ImageU8 all(3 * 40, 40, 3);  // photo | render | error
        Pcg32 rng(static_cast<std::uint64_t>(name[0]));
        for (std::uint8_t& v : all.data) v = static_cast<std::uint8_t>(255 * rng.uniform());
        write_png(folder / name, all);
        run.at[0].views.push_back({name, 0, 0, std::nullopt, folder / name});
    }
    ComparedRun again = run;
    const std::size_t bytes = lpips.features(to_float(read_held_out(folder / "a").photo)).bytes();
    ViewLpips none(&lpips, bytes - 1), one(&lpips, bytes);
    none.measure(run);
    one.measure(again);
    EXPECT_EQ(none.photos_kept(), 0u);
    EXPECT_EQ(one.photos_kept(), 1u);
    one.measure(again);
    EXPECT_GT(*run.at[0].views[0].lpips, 0);
    EXPECT_NE(*run.at[0].views[0].lpips, *run.at[0].views[1].lpips);
    for (std::size_t v = 0; v < 2; ++v)
        EXPECT_EQ(*run.at[0].views[v].lpips, *again.at[0].views[v].lpips);
    fs::remove_all(folder);
}

TEST(Safetensors, Types_becomeFloats) {
    auto file = bytes_of(R"({"h":{"dtype":"F16","shape":[3],"data_offsets":[0,6]},)"
                         R"("b":{"dtype":"BF16","shape":[1],"data_offsets":[6,8]},)"
                         R"("i":{"dtype":"I64","shape":[1],"data_offsets":[8,16]}})",
                         16);
    const std::uint16_t values[] = {0x3c00, 0xc100, 0x0001, 0x4040};
    std::memcpy(file.data() + file.size() - 16, values, 8);
    const Tensors t = parse_safetensors(file, "f");
    EXPECT_EQ(t.at("h").data, (std::vector<float>{1.0f, -2.5f, 0x1p-24f}));
    EXPECT_EQ(t.at("b").data, std::vector<float>{3.0f});
    EXPECT_EQ(t.count("i"), 0u);
}

TEST(Safetensors, EveryTruncation_isAnErrorAndNoCrash) {
    const auto file = bytes_of(R"({"x":{"dtype":"F32","shape":[2,2],"data_offsets":[0,16]}})", 16);
    EXPECT_EQ(parse_safetensors(file, "f").at("x").data.size(), 4u);
    for (std::size_t n = 0; n < file.size(); ++n)
        EXPECT_THROW(parse_safetensors(std::span(file).first(n), "f"), Error) << n;
    for (const char* bad :
         {R"({"x":{"dtype":"F32","shape":[5],"data_offsets":[0,16]}})",
          R"({"x":{"dtype":"F32","shape":[4294967296,4294967296],"data_offsets":[0,16]}})",
          R"({"x":{"dtype":"F32","shape":[4],"data_offsets":[8,4]}})", R"({"x":3})", "[1]"})
        EXPECT_THROW(parse_safetensors(bytes_of(bad, 16), "f"), Error) << bad;
}

// The format has no checksum, so a number may become another, but it stays a number.
TEST(Safetensors, EveryFlippedBit_isAnErrorOrFillsTheShapes) {
    auto file = bytes_of(R"({"x":{"dtype":"F32","shape":[2,2],"data_offsets":[0,16]},)"
                         R"("h":{"dtype":"F16","shape":[3],"data_offsets":[16,22]}})",
                         22);
    const float values[] = {1, -2, 1e-3f, 1e30f};
    std::memcpy(file.data() + file.size() - 22, values, sizeof values);
    std::size_t refused = 0;
    for (std::size_t bit = 0; bit < 8 * file.size(); ++bit) {
        file[bit / 8] ^= std::byte(1 << bit % 8);
        try {
            for (const auto& [name, tensor] : parse_safetensors(file, "f")) {
                std::size_t count = 1;
                for (const std::size_t n : tensor.shape) count *= n;
                EXPECT_EQ(tensor.data.size(), count) << bit;
                for (const float value : tensor.data) EXPECT_TRUE(std::isfinite(value)) << bit;
            }
        } catch (const Error& e) {
            ++refused;
            EXPECT_EQ(std::string(e.what()).find("f"), 0u) << e.what();
        }
        file[bit / 8] ^= std::byte(1 << bit % 8);
    }
    EXPECT_GT(refused, 100u);
    EXPECT_EQ(parse_safetensors(file, "f").size(), 2u);
}

}  // namespace
}  // namespace darb
