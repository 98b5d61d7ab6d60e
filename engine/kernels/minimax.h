// Linear fits with the least largest error, for the polynomials of the shaders.
#pragma once

#include <vector>

namespace darb {

/// Rows of a linear model: row i says sum_k basis[i][k] c[k] = target[i].
struct LinearRows {
    std::vector<std::vector<double>> basis;  // [rows][unknowns]
    std::vector<double> target;              // [rows]
    void add(std::vector<double> row, double value) {
        basis.push_back(std::move(row));
        target.push_back(value);
    }
};

/// The c [unknowns] of least sum of squares; for a well-conditioned basis.
std::vector<double> least_squares_fit(const LinearRows& fitted);

/// The c [unknowns] of least max_i |error of fitted row i|, the exact rows holding exactly.
/// Lawson's iteratively reweighted least squares. Needs fitted rows, and more unknowns than exact
/// rows. Sized for polynomials: some 10 unknowns, some 100 rows.
std::vector<double> minimax_fit(const LinearRows& fitted, const LinearRows& exact);

}  // namespace darb
