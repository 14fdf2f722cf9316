// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "core/compute/host_device.h"
#include "design/energy/weingarten.h"

/// Least-squares fit of a face's Weingarten map.
namespace lensforge {

/// Tikhonov share that keeps the fit of a face with one neighbour (a mesh corner) determined.
inline constexpr double kFitRegularization = 1e-9;

/// Solution of a symmetric positive definite system; only the matrix's lower triangle is read. By
/// cofactors because every face solves one in every evaluation: one division, where those of a
/// factorisation wait for each other.
LF_HD inline Eigen::Vector3d solve_positive(const Eigen::Matrix3d& m,
                                            const Eigen::Vector3d& right) {
  const double c00 = m(1, 1) * m(2, 2) - m(2, 1) * m(2, 1);
  const double c10 = m(2, 0) * m(2, 1) - m(1, 0) * m(2, 2);
  const double c20 = m(1, 0) * m(2, 1) - m(2, 0) * m(1, 1);
  const double c11 = m(0, 0) * m(2, 2) - m(2, 0) * m(2, 0);
  const double c21 = m(1, 0) * m(2, 0) - m(0, 0) * m(2, 1);
  const double c22 = m(0, 0) * m(1, 1) - m(1, 0) * m(1, 0);
  const double inverse = 1.0 / (m(0, 0) * c00 + m(1, 0) * c10 + m(2, 0) * c20);
  return {inverse * (c00 * right[0] + c10 * right[1] + c20 * right[2]),
          inverse * (c10 * right[0] + c11 * right[1] + c21 * right[2]),
          inverse * (c20 * right[0] + c21 * right[1] + c22 * right[2])};
}

/// Normal equations of the map (a, b, c) that minimises H²A + Σ w |M d̄ − n̄|²/|d̄|².
struct FaceFit {
  double xx = 0.0;  ///< Σ w d̄x²/|d̄|², and so on.
  double yy = 0.0;
  double xy = 0.0;
  double curvature = 0.0;  ///< Of H²A by a + b, A/4.
  Eigen::Vector3d right{0.0, 0.0, 0.0};

  /// Adds a neighbour's share w |M d̄ − n̄|²/|d̄|².
  LF_HD void add(const NeighbourOffset& offset, double weight) {
    const double w = weight * offset.inverse;
    const double wx = w * offset.d.x();
    const double wy = w * offset.d.y();
    xx += wx * offset.d.x();
    yy += wy * offset.d.y();
    xy += wx * offset.d.y();
    right += Eigen::Vector3d(wx * offset.n.x(), wy * offset.n.y(),
                             wy * offset.n.x() + wx * offset.n.y());
  }
  /// Adds H²A. @param doubled_area  of the face, mm².
  LF_HD void add_mean_curvature(double doubled_area) { curvature += 0.125 * doubled_area; }

  [[nodiscard]] LF_HD WeingartenMap solve() const {
    const double tikhonov = kFitRegularization * 2.0 * (xx + yy + curvature);
    Eigen::Matrix3d lower;
    lower(0, 0) = xx + curvature + tikhonov;
    lower(1, 0) = curvature;
    lower(2, 0) = xy;
    lower(1, 1) = yy + curvature + tikhonov;
    lower(2, 1) = xy;
    lower(2, 2) = xx + yy + 2.0 * tikhonov;
    const Eigen::Vector3d m = solve_positive(lower, right);
    return {m[0], m[1], m[2]};
  }
};

}  // namespace lensforge
