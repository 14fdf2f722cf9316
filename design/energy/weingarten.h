// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "core/compute/host_device.h"
#include "core/optics/barrier.h"
#include "design/energy/face_frame.h"

/// The Weingarten map of every face and its consistency across edges.
///
/// Notation: face i with frame (n, e1, c) and symmetric map M = [[a, c], [c, b]] in the basis
/// (e1, e2 = n × e1); d̄, n̄ local coordinates of the differences of centroids and normals to a
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

/// A face's frame with its map, or the derivatives by them.
struct CurvedFace {
  FaceFrame frame;
  WeingartenMap map;
};

/// Local coordinates of a neighbour (Sun et al., Eqs. 11 and 12).
struct NeighbourOffset {
  Eigen::Vector2d d;  ///< mm
  Eigen::Vector2d n;

  LF_HD NeighbourOffset(const FaceFrame& i, const FaceFrame& j) {
    const Eigen::Vector3d e2 = i.n.cross(i.e1);
    const Eigen::Vector3d centroid = j.c - i.c;
    const Eigen::Vector3d normal = j.n - i.n;
    d = Eigen::Vector2d(i.e1.dot(centroid), e2.dot(centroid));
    n = Eigen::Vector2d(i.e1.dot(normal), e2.dot(normal));
  }
  [[nodiscard]] LF_HD Eigen::Vector2d residual(const WeingartenMap& m) const {
    return {m.a * d.x() + m.c * d.y() - n.x(), m.c * d.x() + m.b * d.y() - n.y()};
  }
  /// δ of Sun et al., Eq. 13, 1/mm².
  [[nodiscard]] LF_HD double mismatch(const WeingartenMap& m) const {
    return residual(m).squaredNorm() / d.squaredNorm();
  }
};

/// Adjoint of (frame and map of i, frame j) ↦ δ(i, j): adds weight × the derivatives by all of
/// them, and returns δ. Inline, so that derivatives that a caller leaves unread cost nothing.
LF_HD LF_INLINE double mismatch_adjoint(const CurvedFace& face, const FaceFrame& j, double weight,
                                        CurvedFace& face_bar, FaceFrame& j_bar) {
  const FaceFrame& i = face.frame;
  const WeingartenMap& m = face.map;
  FaceFrame& i_bar = face_bar.frame;
  WeingartenMap& m_bar = face_bar.map;
  const NeighbourOffset offset(i, j);
  const double inverse = 1.0 / offset.d.squaredNorm();
  const Eigen::Vector2d r = offset.residual(m);
  const Eigen::Vector2d r_bar = (2.0 * weight * inverse) * r;
  const double shrink = 2.0 * weight * r.squaredNorm() * inverse * inverse;
  const Eigen::Vector2d d_bar =
      Eigen::Vector2d(m.a * r_bar.x() + m.c * r_bar.y(), m.c * r_bar.x() + m.b * r_bar.y()) -
      shrink * offset.d;
  m_bar.a += r_bar.x() * offset.d.x();
  m_bar.b += r_bar.y() * offset.d.y();
  m_bar.c += r_bar.x() * offset.d.y() + r_bar.y() * offset.d.x();

  const Eigen::Vector3d e2 = i.n.cross(i.e1);
  const Eigen::Vector3d centroid = j.c - i.c;
  const Eigen::Vector3d normal = j.n - i.n;
  const Eigen::Vector3d centroid_bar = d_bar.x() * i.e1 + d_bar.y() * e2;
  const Eigen::Vector3d normal_bar = -r_bar.x() * i.e1 - r_bar.y() * e2;
  const Eigen::Vector3d e2_bar = d_bar.y() * centroid - r_bar.y() * normal;
  i_bar.c -= centroid_bar;
  j_bar.c += centroid_bar;
  j_bar.n += normal_bar;
  i_bar.n += i.e1.cross(e2_bar) - normal_bar;
  i_bar.e1 += d_bar.x() * centroid - r_bar.x() * normal + e2_bar.cross(i.n);
  return r.squaredNorm() * inverse;
}

/// Ψ_ν(√h) = 1 − exp(−h/(2ν²)) (Welsch function, Sun et al., Eq. 14) and its slope by h.
LF_HD inline ValueSlope welsch(double h, double nu) {
  const double scale = 1.0 / (2.0 * nu * nu);
  const double decay = std::exp(-h * scale);
  return {1.0 - decay, scale * decay};
}

}  // namespace lensforge
