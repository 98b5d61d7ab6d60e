// SPDX-License-Identifier: MIT
// Checkpoint files: what is written can be read back, and a file that is damaged, cut off or from
// another run gives an Error that names the file and the reason.
#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <set>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "tests/support/test_scene.h"
#include "trainer/step/checkpoint.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::byte>;

class CheckpointFile : public testing::Test {
  protected:
    void SetUp() override { fs::create_directories(folder_); }
    void TearDown() override { fs::remove_all(folder_); }

    /// Those of the run that leaves checkpoint().
    static TrainOptions options_of_run() {
        TrainOptions options;
        options.kernel = KERNEL_SINC;
        options.footprint = Footprint::exact;
        return options;
    }
    static Checkpoint checkpoint(size_t splats = 7) {
        Checkpoint c;
        c.state.iteration = 1234;
        c.state.model =
            random_scene({.count = splats, .kernel = KERNEL_SINC, .sh_degree = 2}).model;
        c.state.model.origin = {1e6, -2e6, 3.25};
        c.state.model.footprint = Footprint::exact;
        for (int a = 0; a < kAttributeCount; ++a) {
            std::vector<float> moments = attribute_values(c.state.model, a);
            moments.resize(moments.size() * 2, 0.125f);
            c.state.moments.push_back(moments);
        }
        c.state.gradient_sum.assign(splats * 2, 0.5f);
        for (int a = 0; a < kAttributeCount; ++a)
            c.state.mean.emplace_back(attribute_values(c.state.model, a).size(), 0.25f);
        c.state.averaged = 6;
        c.state.counters = {1, 8, 9, 10, 11, 2, 3, 4, 12, {5, 6, 7}};
        c.settings = settings_text(options_of_run());
        c.dataset = "0123456789abcdef";
        c.seconds = 98.5;
        return c;
    }
    Bytes written(const Checkpoint& c) const {
        write_checkpoint(path_, c);
        return read_file(path_);
    }
    /// The message of the Error, or nothing.
    static std::string error_of(const Bytes& file) {
        try {
            parse_checkpoint(file, "some/checkpoint.darb");
        } catch (const Error& error) {
            return error.what();
        }
        return "";
    }
    static void expect_refused(const Bytes& file, const std::string& what,
                               const std::string& reason = "") {
        const std::string message = error_of(file);
        EXPECT_NE(message.find("some/checkpoint.darb"), std::string::npos)
            << what << ": " << (message.empty() ? "accepted" : message);
        EXPECT_NE(message.find(reason), std::string::npos) << what << ": " << message;
    }

    const fs::path folder_ =
        fs::path(testing::TempDir()) / fmt::format("darb_checkpoint_{}", ::getpid());
    const fs::path path_ = folder_ / "checkpoint.darb";
};

TEST_F(CheckpointFile, what_is_written_comes_back) {
    for (const size_t splats : {size_t{0}, size_t{1}, size_t{7}}) {
        Checkpoint c = checkpoint(splats);
        c.state.profile.assign(kProfileFloats, 0.375f);
        c.gain = {{{100, 25.1}, {200, 25.0 + 1 / 3.}}, 300};
        written(c);
        const Checkpoint back = read_checkpoint(path_);
        EXPECT_EQ(back.state.iteration, 1234);
        for (int a = 0; a < kAttributeCount; ++a)
            EXPECT_EQ(attribute_values(back.state.model, a), attribute_values(c.state.model, a));
        EXPECT_EQ(back.state.moments, c.state.moments);
        EXPECT_EQ(back.state.mean, c.state.mean);
        EXPECT_EQ(back.state.averaged, 6U);
        EXPECT_EQ(back.state.gradient_sum, c.state.gradient_sum);
        EXPECT_EQ(back.state.profile, c.state.profile);
        EXPECT_EQ(back.state.model.origin, c.state.model.origin);
        EXPECT_EQ(back.state.model.kernel, KERNEL_SINC);
        EXPECT_EQ(back.state.model.footprint, Footprint::exact);
        EXPECT_EQ(back.state.counters.culled, c.state.counters.culled);
        EXPECT_EQ(back.state.counters.pruned, 4U);
        EXPECT_EQ(back.state.counters.most_intersections, 11U);
        EXPECT_EQ(back.state.counters.undrawn, 12U);
        ASSERT_EQ(back.gain.looks.size(), 2U);
        EXPECT_EQ(back.gain.looks[1].iteration, 200);
        EXPECT_EQ(back.gain.looks[1].psnr_db, 25.0 + 1 / 3.) << "to the bit";
        EXPECT_EQ(back.gain.end, 300);
        EXPECT_EQ(back.settings, c.settings);
        EXPECT_EQ(back.dataset, c.dataset);
        EXPECT_EQ(back.seconds, 98.5);
    }
}

TEST_F(CheckpointFile, every_bit_of_the_numbers_comes_back) {
    Checkpoint c = checkpoint();
    c.state.model.position = {std::numeric_limits<float>::denorm_min(),
                              -0.0f,
                              std::numeric_limits<float>::infinity(),
                              std::nanf("7"),
                              1e-45f,
                              3.4e38f};
    c.state.model.position.resize(21, 0.1f);
    written(c);
    const std::vector<float> back = read_checkpoint(path_).state.model.position;
    EXPECT_EQ(std::memcmp(back.data(), c.state.model.position.data(), 21 * sizeof(float)), 0);
}

TEST_F(CheckpointFile, a_file_cut_at_any_byte_of_the_head_is_refused) {
    const Bytes file = written(checkpoint());
    const size_t payload = 7 * (38 * 3 + 2) * sizeof(float);
    ASSERT_GT(file.size(), payload + 500);
    for (size_t size = 0; size <= file.size() - payload; ++size)
        expect_refused(Bytes(file.begin(), file.begin() + std::ptrdiff_t(size)),
                       fmt::format("cut to {} bytes", size));
}

TEST_F(CheckpointFile, a_file_cut_or_grown_in_the_data_is_refused_as_truncated) {
    const Bytes file = written(checkpoint());
    for (size_t less = 1; less < 3000; ++less)
        expect_refused(Bytes(file.begin(), file.end() - std::ptrdiff_t(less)),
                       fmt::format("{} bytes less", less), "truncated");
    Bytes longer = file;
    longer.resize(file.size() + 4);
    expect_refused(longer, "4 bytes more", "expected");
}

TEST_F(CheckpointFile, a_flipped_bit_anywhere_is_refused) {
    const Bytes file = written(checkpoint());
    for (size_t at = 0; at < file.size(); at += at < 2000 ? 1 : 53) {
        Bytes damaged = file;
        damaged[at] ^= std::byte{1};
        expect_refused(damaged, fmt::format("bit 0 of byte {} of {}", at, file.size()));
    }
    Bytes damaged = file;
    damaged.back() ^= std::byte{0x80};
    expect_refused(damaged, "the last bit", "checksum");
}

TEST_F(CheckpointFile, another_version_and_other_files_are_refused) {
    Bytes file = written(checkpoint());
    file[8] = std::byte{200};
    expect_refused(file, "version 200", "version 200");
    Bytes ply(1000, std::byte{'p'});
    expect_refused(ply, "another file", "no darb checkpoint");
    expect_refused({}, "an empty file", "no darb checkpoint");
    EXPECT_THROW(read_checkpoint(folder_ / "missing"), Error);
    EXPECT_THROW(read_checkpoint(folder_), Error);
}

TEST_F(CheckpointFile, a_header_that_promises_too_much_allocates_nothing) {
    Bytes file = written(checkpoint());
    const std::uint64_t huge = ~std::uint64_t{0};
    std::memcpy(file.data() + 16, &huge, 8);
    expect_refused(file, "a header of 2^64 bytes", "truncated");
    for (const char* splats : {"2147483648", "9223372036854775808", "500000000", "8", "0", "-1"}) {
        const Bytes whole = written(checkpoint());
        std::uint64_t size = 0;
        std::memcpy(&size, whole.data() + 16, 8);
        std::string header(reinterpret_cast<const char*>(whole.data()) + 24, size);
        const std::string count = "\"splats\":7";
        ASSERT_NE(header.find(count), std::string::npos) << header;
        header.replace(header.find(count), count.size(), std::string("\"splats\":") + splats);
        Bytes changed(whole.begin(), whole.begin() + 24);
        for (const char c : header) changed.push_back(static_cast<std::byte>(c));
        changed.insert(changed.end(), whole.begin() + 24 + std::ptrdiff_t(size), whole.end());
        size = header.size();
        std::memcpy(changed.data() + 16, &size, 8);
        const std::string message = error_of(changed);
        EXPECT_TRUE(message.find("expected: truncated") != std::string::npos ||
                    message.find("make no sense") != std::string::npos ||
                    message.find("the header's 'splats' is") != std::string::npos)
            << splats << " splats: " << message;
    }
}

TEST_F(CheckpointFile, a_failed_write_leaves_the_older_file) {
    const Bytes before = written(checkpoint(3));
    // A folder stands where the temporary file or the result would go.
    const fs::path blocked = folder_ / "blocked";
    fs::create_directories(blocked / "inside");
    EXPECT_THROW(write_checkpoint(blocked, checkpoint(5)), Error);
    EXPECT_THROW(write_checkpoint(path_ / "below_a_file", checkpoint(5)), Error);
    EXPECT_EQ(read_file(path_), before);
    std::set<fs::path> left;
    for (const auto& entry : fs::directory_iterator(folder_)) left.insert(entry.path().filename());
    EXPECT_EQ(left, (std::set<fs::path>{"checkpoint.darb", "blocked"})) << "no temporary files";
}

// A child process, so that its limit stays its own: beside the state there is room for a fifth of
// it.
TEST_F(CheckpointFile, is_written_without_a_copy_of_the_state) {
    const Checkpoint c = checkpoint(60'000);
    const std::uint64_t bytes = written(c).size();
    ASSERT_GT(bytes, 30'000'000U);
    const auto write_in_little_memory = [&] {
        ::malloc_trim(0);  // what was freed would do for a copy
        std::uint64_t pages = 0;
        std::ifstream("/proc/self/statm") >> pages;
        const rlim_t most = pages * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE)) + bytes / 5;
        const rlimit limit{most, most};
        if (::setrlimit(RLIMIT_AS, &limit) != 0) std::exit(3);
        try {
            write_checkpoint(path_, c);
        } catch (const Error& error) {
            std::fprintf(stderr, "%s\n", error.what());
            std::exit(2);
        }
        std::exit(0);
    };
    fs::remove(path_);
    EXPECT_EXIT(write_in_little_memory(), testing::ExitedWithCode(0), "");
    EXPECT_TRUE(read_file(path_) == checkpoint_bytes(c));
}

TEST_F(CheckpointFile, other_settings_are_named) {
    Dataset dataset;
    Checkpoint c = checkpoint();
    c.dataset = dataset_fingerprint(dataset, {});
    TrainOptions options = options_of_run();
    check_resumable(c, path_, options, dataset, c.dataset);
    options.seed = 99;
    options.kernel = KERNEL_GAUSSIAN;
    try {
        check_resumable(c, path_, options, dataset, c.dataset);
        FAIL() << "accepted";
    } catch (const Error& error) {
        const std::string message = error.what();
        for (const char* part : {"checkpoint.darb", "seed", "99", "kernel", "sinc"})
            EXPECT_NE(message.find(part), std::string::npos) << part << " in " << message;
        EXPECT_EQ(message.find("iterations"), std::string::npos) << message;
    }
}

TEST_F(CheckpointFile, another_data_set_is_refused) {
    Dataset dataset;
    dataset.root = "/photos/of/a/garden";
    dataset.views.resize(2);
    dataset.views[0].name = "one";
    dataset.views[0].camera.width = 10;
    const std::vector<ImageU8> photos(2, ImageU8(10, 4, 4));
    Checkpoint c = checkpoint();
    c.dataset = dataset_fingerprint(dataset, photos);
    check_resumable(c, path_, options_of_run(), dataset, dataset_fingerprint(dataset, photos));
    const auto refused = [&](const char* what, const auto& change,
                             const std::vector<ImageU8>& now) {
        Dataset other = dataset;
        change(other);
        try {
            check_resumable(c, path_, options_of_run(), other, dataset_fingerprint(other, now));
            FAIL() << what << " is accepted";
        } catch (const Error& error) {
            EXPECT_NE(std::string(error.what()).find("garden"), std::string::npos) << error.what();
        }
    };
    refused(
        "another name", [](Dataset& d) { d.views[1].name = "two"; }, photos);
    refused(
        "another size", [](Dataset& d) { d.views[0].camera.width = 11; }, photos);
    refused(
        "another pose", [](Dataset& d) { d.views[1].camera.rotation[2][1] = 1e-9; }, photos);
    refused(
        "another focal length", [](Dataset& d) { d.views[1].camera.fx = 1e-9; }, photos);
    refused(
        "another split", [](Dataset& d) { d.views[1].is_test = true; }, photos);
    refused(
        "one view less", [](Dataset& d) { d.views.pop_back(); }, photos);
    refused(
        "a point",
        [](Dataset& d) {
            d.points.position = {1, 2, 3};
        },
        photos);
    std::vector<ImageU8> painted = photos;
    painted[1].data[5] = 1;
    refused(
        "one pixel of a photo", [](Dataset&) {}, painted);
}

}  // namespace
}  // namespace darb::test
