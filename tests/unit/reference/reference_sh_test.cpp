// SPDX-License-Identifier: MIT
// Spherical harmonics: orthonormality pins the constants, axes pin order and signs.
#include "engine/reference/projection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/unit/reference/reference_scenes.h"

namespace darb::reference {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(ShBasis, Coefficients_AreOrthonormalOnTheSphere) {
    // Midpoint rule in z (exact enough at 4,000 points) and trapezoid in longitude (exact).
    constexpr int kZ = 4000, kLongitudes = 16;
    double gram[16][16] = {};
    for (int i = 0; i < kZ; ++i) {
        const double z = -1 + (i + 0.5) * 2 / kZ, r = std::sqrt(1 - z * z);
        for (int j = 0; j < kLongitudes; ++j) {
            const double longitude = 2 * kPi * j / kLongitudes;
            const auto b =
                sh_basis<double>(3, {r * std::cos(longitude), r * std::sin(longitude), z});
            for (int k = 0; k < 16; ++k) {
                for (int l = 0; l < 16; ++l) {
                    gram[k][l] += b[k] * b[l] * (2.0 / kZ) * (2 * kPi / kLongitudes);
                }
            }
        }
    }
    for (int k = 0; k < 16; ++k) {
        for (int l = 0; l < 16; ++l) {
            EXPECT_NEAR(gram[k][l], k == l ? 1 : 0, 1e-5) << "coefficients " << k << ", " << l;
        }
    }
}

TEST(ShBasis, Axes_PinOrderAndSigns) {
    const auto x = sh_basis<double>(3, {1, 0, 0});
    const auto y = sh_basis<double>(3, {0, 1, 0});
    const auto z = sh_basis<double>(3, {0, 0, 1});
    const double band1 = std::sqrt(3 / kPi) / 2;
    EXPECT_NEAR(x[0], std::sqrt(1 / kPi) / 2, 1e-15);
    EXPECT_NEAR(y[1], -band1, 1e-15);
    EXPECT_NEAR(z[2], band1, 1e-15);
    EXPECT_NEAR(x[3], -band1, 1e-15);
    EXPECT_EQ(x[1], 0);
    EXPECT_EQ(y[3], 0);
    EXPECT_NEAR(z[6], std::sqrt(5 / kPi) / 2, 1e-15);
    EXPECT_NEAR(x[8], std::sqrt(15 / kPi) / 4, 1e-15);
    EXPECT_NEAR(y[8], -std::sqrt(15 / kPi) / 4, 1e-15);
    EXPECT_NEAR(z[12], std::sqrt(7 / kPi) / 2, 1e-15);
    EXPECT_NEAR(x[15], -std::sqrt(35 / (2 * kPi)) / 4, 1e-15);
    EXPECT_NEAR(y[9], std::sqrt(35 / (2 * kPi)) / 4, 1e-15);
}

TEST(ShBasis, Diagonals_PinTheMixedTerms) {
    const double r = std::sqrt(0.5), s = std::sqrt(1.0 / 3);
    EXPECT_GT(sh_basis<double>(2, {r, r, 0})[4], 0);
    EXPECT_LT(sh_basis<double>(2, {0, r, r})[5], 0);
    EXPECT_LT(sh_basis<double>(2, {r, 0, r})[7], 0);
    EXPECT_GT(sh_basis<double>(3, {s, s, s})[10], 0);
    EXPECT_LT(sh_basis<double>(3, {0, r, r})[11], 0);
    EXPECT_LT(sh_basis<double>(3, {r, 0, r})[13], 0);
    EXPECT_GT(sh_basis<double>(3, {r, 0, r})[14], 0);
}

TEST(ShBasis, LowerDegree_IsZeroBeyond) {
    for (int degree = 0; degree <= 3; ++degree) {
        const auto b = sh_basis<double>(degree, {0.6, -0.48, 0.64});
        for (int k = (degree + 1) * (degree + 1); k < 16; ++k) {
            EXPECT_EQ(b[k], 0) << "degree " << degree << ", coefficient " << k;
        }
    }
}

TEST(ShBasisGradient, EveryCoefficient_MatchesDifferences) {
    Pcg32 rng(3);
    for (int trial = 0; trial < 20; ++trial) {
        const glm::dvec3 at = glm::normalize(glm::dvec3(rng.normal(), rng.normal(), rng.normal()));
        const auto gradient = sh_basis_gradient<double>(3, at);
        for (int c = 0; c < 3; ++c) {
            glm::dvec3 above = at, below = at;
            above[c] += 1e-5;
            below[c] -= 1e-5;
            const auto a = sh_basis<double>(3, above), b = sh_basis<double>(3, below);
            for (int k = 0; k < 16; ++k) {
                EXPECT_NEAR(gradient[k][c], (a[k] - b[k]) / 2e-5, 1e-9)
                    << "coefficient " << k << ", axis " << c;
            }
        }
    }
}

TEST(ShColour, DirectionIsFromTheCameraToTheSplat) {
    // A splat straight ahead is seen along +z: band 1's z coefficient adds to it.
    auto splats = test::splats_of({{.colour = glm::dvec3(0.5)}});
    splats.sh_degree = 1;
    splats.sh_rest.assign(9, 0.0);
    splats.sh_rest[1 * 3 + 0] = 0.2;  // coefficient 2, red
    const auto result = render(splats, test::small_camera(), {});
    EXPECT_NEAR(result.projected[0].colour.x, 0.5 + 0.2 * std::sqrt(3 / kPi) / 2, 1e-14);
    EXPECT_NEAR(result.projected[0].colour.y, 0.5, 1e-14);
}

}  // namespace
}  // namespace darb::reference
