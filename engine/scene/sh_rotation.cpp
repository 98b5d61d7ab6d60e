// The basis is orthonormal, so the matrix is the integral over the sphere of
//   Y_j(d) Y_k(turn^T d),
// a polynomial of degree 6 at most: four Gauss-Legendre nodes in z (exact to degree 7) times eight
// equal steps in longitude integrate it exactly.
#include "engine/scene/sh_rotation.h"

#include <cmath>
#include <numbers>

namespace darb {

namespace {

constexpr double kNode[2] = {0.33998104358485626, 0.86113631159405258};
constexpr double kWeight[2] = {0.65214515486254614, 0.34785484513745386};
constexpr int kLongitudes = 8;
constexpr double kNoise = 1e-14;

using Basis = std::array<double, kMaxShCoefficients>;

void add_direction(const glm::dmat3& turn, const glm::dvec3& d, double weight, ShRotation& sum) {
    const glm::dvec3 before = glm::transpose(turn) * d;
    const Basis to = sh_basis(kMaxShDegree, d.x, d.y, d.z);
    const Basis from = sh_basis(kMaxShDegree, before.x, before.y, before.z);
    for (std::size_t l = 1; l <= kMaxShDegree; ++l)
        for (std::size_t j = 0; j < 2 * l + 1; ++j)
            for (std::size_t k = 0; k < 2 * l + 1; ++k)
                sum[l][j][k] += weight * to[l * l + j] * from[l * l + k];
}

}  // namespace

ShRotation sh_rotation(const glm::dmat3& turn) {
    ShRotation sum{};
    for (int ring = 0; ring < 4; ++ring) {
        const double z = (ring < 2 ? 1 : -1) * kNode[ring % 2], r = std::sqrt(1 - z * z);
        for (int step = 0; step < kLongitudes; ++step) {
            const double angle = 2 * std::numbers::pi * step / kLongitudes;
            add_direction(turn, {r * std::cos(angle), r * std::sin(angle), z},
                          kWeight[ring % 2] * 2 * std::numbers::pi / kLongitudes, sum);
        }
    }
    for (auto& band : sum)
        for (auto& row : band)
            for (double& entry : row)
                if (std::abs(entry) < kNoise)
                    entry = 0;  // flips of axes then keep zeros as they are
    return sum;
}

void rotate_sh(const ShRotation& rotation, int degree, std::vector<float>& sh_rest) {
    const std::size_t row = static_cast<std::size_t>((degree + 1) * (degree + 1) - 1) * 3;
    for (std::size_t at = 0; row > 0 && at < sh_rest.size(); at += row)
        for (std::size_t l = 1; l <= static_cast<std::size_t>(degree); ++l)
            for (std::size_t channel = 0; channel < 3; ++channel) {
                float* band = &sh_rest[at + (l * l - 1) * 3 + channel];
                double turned[7] = {};
                for (std::size_t j = 0; j < 2 * l + 1; ++j)
                    for (std::size_t k = 0; k < 2 * l + 1; ++k)
                        turned[j] += rotation[l][j][k] * band[k * 3];
                for (std::size_t j = 0; j < 2 * l + 1; ++j)
                    band[j * 3] = static_cast<float>(turned[j]);
            }
}

}  // namespace darb
