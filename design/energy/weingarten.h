// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "core/compute/host_device.h"
#include "core/compute/scalar.h"
#include "design/energy/face_frame.h"

/// The Weingarten map of every face and its consistency across edges.
///
/// Two numbers that were just computed are read one by one here: taken together as a vector of
/// Eigen's, each pair stalls a processor, and the smoothness terms take twice as long.
///
/// Notation: face i with frame (n, c) and symmetric map M = [[a, c], [c, b]] in the tangent basis
/// (e1, e2); d̄, n̄ local coordinates of the differences of centroids and normals to a
/// neighbour j; r = M d̄ − n̄ residual; δ = |r|²/|d̄|² mismatch, h = δ(i, j) + δ(j, i).
namespace lensforge {

/// The symmetric 2 × 2 matrix of a face (Sun et al., Eq. 10), 1/mm.
struct WeingartenMap {
  double a = 0.0;
  double b = 0.0;
  double c = 0.0;

  /// Half the trace.
  [[nodiscard]] LF_HD double mean_curvature() const { return 0.5 * (a + b); }
};

/// Local coordinates of a neighbour (Sun et al., Eqs. 11 and 12).
struct NeighbourOffset {
  Eigen::Vector2d d;  ///< mm
  Eigen::Vector2d n;
  double inverse = 0.0;  ///< 1/|d̄|², 1/mm²

  LF_HD NeighbourOffset() : d(0.0, 0.0), n(0.0, 0.0) {}
  LF_HD NeighbourOffset(const Eigen::Vector2d& d_bar, const Eigen::Vector2d& n_bar)
      : d(d_bar), n(n_bar), inverse(1.0 / (d_bar.x() * d_bar.x() + d_bar.y() * d_bar.y())) {}
  /// @param basis  of i's tangent plane.
  LF_HD NeighbourOffset(const FaceFrame& i, const TangentBasis& basis, const FaceFrame& j)
      : NeighbourOffset(basis.local(j.c - i.c), basis.local(j.n)) {}

  [[nodiscard]] LF_HD Eigen::Vector2d residual(const WeingartenMap& m) const {
    return {m.a * d.x() + m.c * d.y() - n.x(), m.c * d.x() + m.b * d.y() - n.y()};
  }
  /// δ of Sun et al., Eq. 13, 1/mm².
  [[nodiscard]] LF_HD double mismatch(const WeingartenMap& m) const {
    return residual(m).squaredNorm() * inverse;
  }
};

/// δ(i, j) and its derivatives by d̄ and n̄.
struct MismatchSlope {
  double value;
  Eigen::Vector2d by_d;
  Eigen::Vector2d by_n;

  LF_HD MismatchSlope(const NeighbourOffset& offset, const WeingartenMap& m) {
    const Eigen::Vector2d r = offset.residual(m);
    value = (r.x() * r.x() + r.y() * r.y()) * offset.inverse;
    const double scale = -2.0 * offset.inverse;
    by_n = {scale * r.x(), scale * r.y()};
    const double pull = 2.0 * value * offset.inverse;
    by_d = {-m.a * by_n.x() - m.c * by_n.y() - pull * offset.d.x(),
            -m.c * by_n.x() - m.b * by_n.y() - pull * offset.d.y()};
  }
};

/// Ψ_ν(√h) = 1 − exp(−h/(2ν²)) (Welsch function, Sun et al., Eq. 14) and its slope by h.
LF_HD inline ValueSlope welsch(double h, double nu) {
  const double scale = 1.0 / (2.0 * nu * nu);
  const double decay = std::exp(-h * scale);
  return {1.0 - decay, scale * decay};
}

}  // namespace lensforge
