// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/spline/cubic_spline.h"

#include <algorithm>
#include <cmath>

namespace lensforge {
namespace {

/// Knot i of the fourfold-ended knot vector over [0, cells].
double knot(int i, int cells) { return std::clamp(i - kSplineDegree, 0, cells); }

int cell_of(double t, int cells) {
  return std::clamp(static_cast<int>(std::floor(t)), 0, cells - 1);
}

/// Values of the basis functions of one degree that are not zero in a cell (Cox–de Boor).
std::array<double, 4> functions(double t, int cell, int cells, int degree) {
  std::array<double, 4> n{1.0};
  const int span = cell + kSplineDegree;
  for (int p = 1; p <= degree; ++p) {
    double saved = 0.0;
    for (int r = 0; r < p; ++r) {
      const double right = knot(span + r + 1, cells);
      const double left = knot(span + r + 1 - p, cells);
      const auto i = static_cast<std::size_t>(r);
      const double share = n[i] / (right - left);
      n[i] = saved + (right - t) * share;
      saved = (t - left) * share;
    }
    n[static_cast<std::size_t>(p)] = saved;
  }
  return n;
}

/// Derivatives of the functions of this degree from those of one degree less, or from their
/// derivatives: B' = p (B₋ / width₋ − B₊ / width₊).
std::array<double, 4> differences(const std::array<double, 4>& lower, int cell, int cells,
                                  int degree) {
  std::array<double, 4> result{};
  const int first = cell + kSplineDegree - degree;
  for (int j = 0; j < degree; ++j) {
    const double width = knot(first + j + 1 + degree, cells) - knot(first + j + 1, cells);
    const auto i = static_cast<std::size_t>(j);
    const double slope = degree * lower[i] / width;
    result[i] -= slope;
    result[i + 1] += slope;
  }
  return result;
}

/// Coefficient of a part of the spline: the blossom of the piece over `cell` at three of its knots.
double blossom(const Eigen::VectorXd& coefficients, int cell, const std::array<double, 3>& at) {
  const auto cells = static_cast<int>(coefficients.size()) - kSplineDegree;
  std::array<double, 4> d{};
  for (int j = 0; j < 4; ++j) d[static_cast<std::size_t>(j)] = coefficients[cell + j];
  for (int r = 1; r <= kSplineDegree; ++r) {
    for (int j = kSplineDegree; j >= r; --j) {
      const double left = knot(cell + j, cells);
      const double right = knot(cell + j + kSplineDegree + 1 - r, cells);
      const double share = (at[static_cast<std::size_t>(r - 1)] - left) / (right - left);
      const auto i = static_cast<std::size_t>(j);
      d[i] = (1.0 - share) * d[i - 1] + share * d[i];
    }
  }
  return d[3];
}

/// The basis far enough from the ends, where all knots are single.
CubicBasis inner_basis(double t, int cell) {
  const double s = t - cell;
  const double r = 1.0 - s;
  CubicBasis basis;
  basis.first = cell;
  basis.value = {r * r * r / 6.0, 2.0 / 3.0 - s * s * (1.0 - 0.5 * s),
                 2.0 / 3.0 - r * r * (1.0 - 0.5 * r), s * s * s / 6.0};
  basis.slope = {-0.5 * r * r, s * (1.5 * s - 2.0), r * (2.0 - 1.5 * r), 0.5 * s * s};
  basis.bend = {r, 3.0 * s - 2.0, 3.0 * r - 2.0, s};
  return basis;
}

/// The basis at one end, where it is known, with 2 or more cells: of all points of a lens's rim.
CubicBasis end_basis(bool first, int cells) {
  if (first) return {0, {1.0}, {-3.0, 3.0}, {6.0, -9.0, 3.0}};
  return {cells - 1, {0.0, 0.0, 0.0, 1.0}, {0.0, 0.0, -3.0, 3.0}, {0.0, 3.0, -9.0, 6.0}};
}

}  // namespace

CubicBasis cubic_basis(double t, int cells) {
  if ((t == 0.0 || t == cells) && cells > 1) return end_basis(t == 0.0, cells);
  const int cell = cell_of(t, cells);
  if (cell >= kSplineDegree - 1 && cell + kSplineDegree <= cells) return inner_basis(t, cell);
  CubicBasis basis;
  basis.first = cell;
  basis.value = functions(t, basis.first, cells, kSplineDegree);
  basis.slope = differences(functions(t, basis.first, cells, 2), basis.first, cells, 3);
  basis.bend = differences(differences(functions(t, basis.first, cells, 1), basis.first, cells, 2),
                           basis.first, cells, 3);
  return basis;
}

double greville_point(int i, int cells) {
  return (knot(i + 1, cells) + knot(i + 2, cells) + knot(i + 3, cells)) / 3.0;
}

Eigen::SparseMatrix<double, Eigen::RowMajor> basis_matrix(const std::vector<double>& points,
                                                          int cells, bool slopes) {
  Eigen::SparseMatrix<double, Eigen::RowMajor> matrix(static_cast<Eigen::Index>(points.size()),
                                                      cells + kSplineDegree);
  matrix.reserve(Eigen::VectorXi::Constant(matrix.rows(), 4));
  for (std::size_t row = 0; row < points.size(); ++row) {
    const CubicBasis basis = cubic_basis(points[row], cells);
    for (int j = 0; j < 4; ++j) {
      const auto i = static_cast<std::size_t>(j);
      matrix.insert(static_cast<Eigen::Index>(row), basis.first + j) =
          slopes ? basis.slope[i] : basis.value[i];
    }
  }
  matrix.makeCompressed();
  return matrix;
}

Eigen::MatrixXd restriction(int cells, int from, int to) {
  const int count = to - from;
  Eigen::MatrixXd matrix(count + kSplineDegree, count + kSplineDegree);
  for (int k = 0; k < matrix.cols(); ++k) {
    Eigen::VectorXd unit = Eigen::VectorXd::Zero(cells + kSplineDegree);
    unit[from + k] = 1.0;
    for (int i = 0; i < matrix.rows(); ++i) {
      const std::array<double, 3> at{from + knot(i + 1, count), from + knot(i + 2, count),
                                     from + knot(i + 3, count)};
      matrix(i, k) = blossom(unit, from + cell_of(knot(i, count), count), at);
    }
  }
  return matrix;
}

}  // namespace lensforge
