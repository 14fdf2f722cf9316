// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/height_spline.h"

#include <Eigen/Core>
#include <algorithm>
#include <utility>

namespace lensforge {
namespace {

using Lines = Eigen::MatrixXd;  ///< n × L: one line per column.

/// m at all samples. "Not a knot" ends have m_0 = 2 m_1 − m_2; with m_0 + 4 m_1 + m_2 = 6 d_1, d
/// the second difference of the samples, this gives m_1 = d_1.
Lines second_derivatives(const Lines& samples) {
  const Eigen::Index n = samples.rows();
  Lines m(n, samples.cols());
  for (Eigen::Index i = 1; i < n - 1; ++i) {
    m.row(i) = samples.row(i - 1) - 2.0 * samples.row(i) + samples.row(i + 1);
  }
  // m_{i−1} + 4 m_i + m_{i+1} = 6 d_i for the others, by elimination from both known ends.
  Eigen::VectorXd pivot = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 2; i < n - 2; ++i) {
    pivot[i] = 1.0 / (4.0 - pivot[i - 1]);
    m.row(i) = pivot[i] * (6.0 * m.row(i) - m.row(i - 1));
  }
  for (Eigen::Index i = n - 3; i > 1; --i) m.row(i) -= pivot[i] * m.row(i + 1);
  m.row(0) = 2.0 * m.row(1) - m.row(2);
  m.row(n - 1) = 2.0 * m.row(n - 2) - m.row(n - 3);
  return m;
}

/// c of all lines; a sample is c_i + m_i / 6.
Lines coefficients_of(const Lines& samples) {
  constexpr Eigen::Index kBeyond = HeightSpline::kBeyond;
  const Eigen::Index n = samples.rows();
  const Lines m = second_derivatives(samples);
  Lines c(n + 2 * kBeyond, samples.cols());
  const auto at = [&c](Eigen::Index i) { return c.row(i + kBeyond); };
  c.middleRows(kBeyond, n) = samples - m / 6.0;
  at(-1) = m.row(0) + 2.0 * at(0) - at(1);
  at(n) = m.row(n - 1) + 2.0 * at(n - 1) - at(n - 2);
  at(-2) = 2.0 * at(-1) - at(0);
  at(n + 1) = 2.0 * at(n) - at(n - 1);
  return c;
}

}  // namespace

HeightSpline::HeightSpline(HeightGrid grid) : grid_(std::move(grid)) {
  Lines by_x(grid_.columns, grid_.rows);
  for (int row = 0; row < grid_.rows; ++row) {
    const float* const heights = grid_.heights.data() + std::ptrdiff_t{row} * grid_.columns;
    for (int i = 0; i < grid_.columns; ++i) {
      by_x(i, grid_.rows - 1 - row) = static_cast<double>(heights[i]);
    }
  }
  const Lines by_y = coefficients_of(by_x).transpose();
  const Lines all = coefficients_of(by_y).transpose();
  coefficients_.assign(all.data(), all.data() + all.size());
}

float HeightSpline::lowest() const {
  return *std::min_element(grid_.heights.begin(), grid_.heights.end());
}

float HeightSpline::highest() const {
  return *std::max_element(grid_.heights.begin(), grid_.heights.end());
}

}  // namespace lensforge
