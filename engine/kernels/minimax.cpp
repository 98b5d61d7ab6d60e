#include "engine/kernels/minimax.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/core/check.h"

namespace darb {
namespace {

constexpr int kIterations = 30;
using Matrix = std::vector<std::vector<long double>>;  // the normal equations square the condition

std::vector<double> solve(Matrix m, std::vector<long double> b) {
    const std::size_t n = b.size();
    for (std::size_t k = 0; k < n; ++k) {
        std::size_t pivot = k;
        for (std::size_t i = k + 1; i < n; ++i)
            if (std::abs(m[i][k]) > std::abs(m[pivot][k])) pivot = i;
        std::swap(m[k], m[pivot]);
        std::swap(b[k], b[pivot]);
        DARB_CHECK(m[k][k] != 0, "singular fit, column {} of {}", k, n);
        for (std::size_t i = k + 1; i < n; ++i) {
            const long double factor = m[i][k] / m[k][k];
            for (std::size_t j = k; j < n; ++j) m[i][j] -= factor * m[k][j];
            b[i] -= factor * b[k];
        }
    }
    std::vector<double> x(n);
    for (std::size_t k = n; k-- > 0;) {
        long double sum = b[k];
        for (std::size_t j = k + 1; j < n; ++j) sum -= m[k][j] * x[j];
        x[k] = static_cast<double>(sum / m[k][k]);
    }
    return x;
}

/// Least squares of the fitted rows with the exact rows as constraints (Lagrange multipliers).
std::vector<double> weighted_fit(const LinearRows& fitted, const std::vector<double>& weight,
                                 const LinearRows& exact) {
    const std::size_t unknowns = fitted.basis[0].size(), total = unknowns + exact.basis.size();
    Matrix m(total, std::vector<long double>(total, 0));
    std::vector<long double> b(total, 0);
    for (std::size_t i = 0; i < fitted.basis.size(); ++i)
        for (std::size_t j = 0; j < unknowns; ++j) {
            const long double scaled = static_cast<long double>(weight[i]) * fitted.basis[i][j];
            b[j] += scaled * fitted.target[i];
            for (std::size_t k = 0; k < unknowns; ++k) m[j][k] += scaled * fitted.basis[i][k];
        }
    for (std::size_t i = 0; i < exact.basis.size(); ++i) {
        for (std::size_t j = 0; j < unknowns; ++j)
            m[j][unknowns + i] = m[unknowns + i][j] = exact.basis[i][j];
        b[unknowns + i] = exact.target[i];
    }
    std::vector<double> x = solve(std::move(m), std::move(b));
    x.resize(unknowns);
    return x;
}

}  // namespace

std::vector<double> least_squares_fit(const LinearRows& fitted) {
    return weighted_fit(fitted, std::vector<double>(fitted.basis.size(), 1.0), {});
}

std::vector<double> minimax_fit(const LinearRows& fitted, const LinearRows& exact) {
    const std::size_t rows = fitted.basis.size();
    DARB_CHECK(rows > 0 && fitted.basis[0].size() > exact.basis.size(), "rows = {}", rows);
    std::vector<double> weight(rows, 1.0 / static_cast<double>(rows)), best, error(rows);
    double best_error = INFINITY;
    for (int iteration = 0; iteration < kIterations; ++iteration) {
        const std::vector<double> c = weighted_fit(fitted, weight, exact);
        double largest = 0, total = 0;
        for (std::size_t i = 0; i < rows; ++i) {
            double sum = -fitted.target[i];
            for (std::size_t j = 0; j < c.size(); ++j) sum += fitted.basis[i][j] * c[j];
            error[i] = std::abs(sum);
            largest = std::max(largest, error[i]);
            total += weight[i] * error[i];
        }
        if (largest < best_error) {
            best_error = largest;
            best = c;
        }
        if (total < 1e-15) break;  // exact already: weights would vanish
        for (std::size_t i = 0; i < rows; ++i) weight[i] *= error[i] / total;
    }
    return best;
}

}  // namespace darb
