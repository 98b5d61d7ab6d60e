// SPDX-License-Identifier: MIT
// Every hard case on the device against double, image and gradients, in two kernels each.
// `darb check --every-kernel` runs all.
#include <gtest/gtest.h>

#include "engine/check/hard_cases.h"
#include "tests/support/every_kernel.h"
#include "tests/support/shared_device.h"

namespace darb::test {
namespace {

struct Param {
    size_t index = 0;
    std::string name;
    int kernel = KERNEL_GAUSSIAN;
    Footprint footprint = Footprint::psi;
};
void PrintTo(const Param& p, std::ostream* out) {
    *out << p.name;
}

// The Gaussian, and one other kernel and footprint that changes from case to case; and the one in
// which a pixel ends within rounding of the stop on lavapipe.
std::vector<Param> every_case() {
    std::vector<Param> all;
    const auto names = check::hard_cases(KERNEL_GAUSSIAN, Footprint::psi);
    for (size_t i = 0; i < names.size(); ++i) {
        all.push_back({i, names[i].name, KERNEL_GAUSSIAN, Footprint::psi});
        const int other = 1 + static_cast<int>(i % KERNEL_COUNT);
        all.push_back({i, names[i].name, other < KERNEL_COUNT ? other : KERNEL_BETA,
                       i % 3 == 0 ? Footprint::exact : Footprint::psi});
        if (i % 4 == 1)
            all.push_back({i, names[i].name, KERNEL_GENERALIZED_EXPONENTIAL, Footprint::psi});
        // Its double takes a quarter of a minute for a long list.
        if (i % 4 == 2 && names[i].name != "long_list")
            all.push_back({i, names[i].name, kSteepBlend, Footprint::psi});
        if (i % 4 == 3)
            all.push_back({i, names[i].name, i % 8 == 3 ? kSmoothBlend : KERNEL_GES_PUBLISHED,
                           i % 8 == 3 ? Footprint::exact : Footprint::psi});
        if (names[i].name == "discs")
            all.push_back({i, names[i].name, KERNEL_PARABOLIC, Footprint::exact});
    }
    for (Param& p : all) {
        p.name += " " + std::string(kernel_name(p.kernel)) + " " +
                  std::string(footprint_name(p.footprint));
        for (char& c : p.name) c = c == ' ' || c == ':' || c == ',' ? '_' : c;
    }
    return all;
}

class HardCase : public testing::TestWithParam<Param> {};

TEST_P(HardCase, matches_double) {
    const Param& p = GetParam();
    const check::HardCase c = check::hard_cases(p.kernel, p.footprint)[p.index];
    for (const check::Row& row : check::check_hard_case(shared_device(), c, p.name))
        EXPECT_TRUE(row.pass) << row.name << ": error " << row.error << ", allowed " << row.allowed
                              << row.detail;
}

INSTANTIATE_TEST_SUITE_P(every, HardCase, testing::ValuesIn(every_case()),
                         [](const auto& p) { return p.param.name; });

TEST(PoisonedSplats, harm_no_other) {
    for (const int kernel :
         {KERNEL_GAUSSIAN, KERNEL_BETA, KERNEL_GENERALIZED_EXPONENTIAL, kSteepBlend})
        for (const check::Row& row : check::check_poison(shared_device(), kernel, "poison"))
            EXPECT_TRUE(row.pass) << row.name << row.detail;
}

}  // namespace
}  // namespace darb::test
