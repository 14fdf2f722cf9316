// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <vector>

namespace lensforge {

// Cubic B-splines over [0, cells] with a knot at every whole number, fourfold at both ends: cells
// + 3 coefficients; the ends' values are the first and last one.
inline constexpr int kSplineDegree = 3;

/// The four basis functions that are not zero at a point: numbers first … first + 3.
struct CubicBasis {
  int first = 0;
  std::array<double, 4> value{};
  std::array<double, 4> slope{};  ///< Derivatives by t.
  std::array<double, 4> bend{};   ///< Second derivatives.
};

/// @pre 0 ≤ t ≤ cells, cells ≥ 1.
CubicBasis cubic_basis(double t, int cells);

/// Greville point of coefficient `i`: with these as coefficients the spline is t itself.
double greville_point(int i, int cells);

/// One row per point with the values (or slopes) of all cells + 3 basis functions.
Eigen::SparseMatrix<double, Eigen::RowMajor> basis_matrix(const std::vector<double>& points,
                                                          int cells, bool slopes);

/// Matrix that maps coefficients from … to + 2 of a spline over [0, cells] to the coefficients over
/// [0, to − from] of the same spline between its knots `from` and `to` (Oslo algorithm).
/// @pre 0 ≤ from < to ≤ cells.
Eigen::MatrixXd restriction(int cells, int from, int to);

}  // namespace lensforge
