// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/clamped.h"
#include "core/compute/host_device.h"
#include "design/flux/flux_triangle.h"

namespace lensforge {

/// Vector from the nearest point of the picture rectangle [0, columns] × [0, rows] to u, pixels.
LF_HD inline Eigen::Vector2d excess_outside(const Eigen::Vector2d& u, double columns, double rows) {
  return u - Eigen::Vector2d(clamped(u.x(), 0.0, columns), clamped(u.y(), 0.0, rows));
}

/// E_bdr of one image triangle, Σ_k ‖u_k − P_I(u_k)‖² over its corners (Sun et al., Eq. 7), in
/// square pixels. Adds weight × derivative to `bar`, returns the value.
LF_HD inline double boundary_term(const ImageTriangle& t, double columns, double rows,
                                  double weight, ImageTriangle& bar) {
  const Eigen::Vector2d e0 = excess_outside(t.p0, columns, rows);
  const Eigen::Vector2d e1 = excess_outside(t.p1, columns, rows);
  const Eigen::Vector2d e2 = excess_outside(t.p2, columns, rows);
  bar.p0 += 2.0 * weight * e0;
  bar.p1 += 2.0 * weight * e1;
  bar.p2 += 2.0 * weight * e2;
  return e0.squaredNorm() + e1.squaredNorm() + e2.squaredNorm();
}

}  // namespace lensforge
