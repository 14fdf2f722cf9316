// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "core/host_device.h"
#include "design/energy/weingarten.h"

/// Least-squares fit of a face's Weingarten map.
namespace lensforge {

/// Tikhonov share that keeps the fit of a face with one neighbour (a mesh corner) determined.
inline constexpr double kFitRegularization = 1e-9;

/// Solution of a symmetric positive definite system by Cholesky factorisation; only the matrix's
/// lower triangle is read. Written out because Eigen's LLT does not run on a GPU; the order of
/// operations is the same, and so are the bits (FaceFit.SolvesToTheBitsOfEigen).
LF_HD inline Eigen::Vector3d solve_positive(const Eigen::Matrix3d& m,
                                            const Eigen::Vector3d& right) {
  const double l00 = std::sqrt(m(0, 0));
  const double l10 = m(1, 0) / l00;
  const double l20 = m(2, 0) / l00;
  const double l11 = std::sqrt(m(1, 1) - l10 * l10);
  const double l21 = (m(2, 1) - l20 * l10) / l11;
  const double l22 = std::sqrt(m(2, 2) - (l20 * l20 + l21 * l21));
  const double y0 = right[0] / l00;
  const double y1 = (right[1] - l10 * y0) / l11;
  const double y2 = (right[2] - (l20 * y0 + l21 * y1)) / l22;
  const double x2 = y2 / l22;
  const double x1 = (y1 - l21 * x2) / l11;
  const double x0 = (y0 - (l10 * x1 + l20 * x2)) / l00;
  return {x0, x1, x2};
}

/// Normal equations of the map (a, b, c) that minimises H²A + Σ w |M d̄ − n̄|²/|d̄|².
struct FaceFit {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();

  /// Adds a neighbour's share w |M d̄ − n̄|²/|d̄|².
  LF_HD void add(const NeighbourOffset& offset, double weight) {
    const double w = weight / offset.d.squaredNorm();
    const Eigen::Vector3d row_x(offset.d.x(), 0.0, offset.d.y());
    const Eigen::Vector3d row_y(0.0, offset.d.y(), offset.d.x());
    matrix += w * (row_x * row_x.transpose() + row_y * row_y.transpose());
    right += w * (offset.n.x() * row_x + offset.n.y() * row_y);
  }
  /// Adds H²A. @param doubled_area  of the face, mm².
  LF_HD void add_mean_curvature(double doubled_area) {
    matrix.topLeftCorner<2, 2>().array() += 0.125 * doubled_area;
  }
  [[nodiscard]] LF_HD WeingartenMap solve() {
    const double tikhonov = kFitRegularization * matrix.trace();
    matrix.diagonal() += tikhonov * Eigen::Vector3d(1.0, 1.0, 2.0);
    const Eigen::Vector3d m = solve_positive(matrix, right);
    return {m[0], m[1], m[2]};
  }
};

}  // namespace lensforge
