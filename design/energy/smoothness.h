// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/compute/scalar.h"
#include "core/mesh/surface_mesh.h"
#include "design/energy/objective_view.h"

namespace lensforge {

/// Centroid c and unit normal n of a triangle, n_z > −1 (Sun et al., section 3.3). The same struct
/// holds derivatives by these vectors.
struct FaceFrame {
  Eigen::Vector3d n{0.0, 0.0, 0.0};
  Eigen::Vector3d c{0.0, 0.0, 0.0};
};

LF_HD inline FaceFrame face_frame(const Corners& t) {
  const Eigen::Vector3d normal = area_normal(t);
  return {(1.0 / normal.norm()) * normal, (1.0 / 3.0) * (t.v0 + t.v1 + t.v2)};
}

/// Two unit vectors at right angles to each other and to a normal, e2 = n × e1 (Duff et al. 2017,
/// Building an Orthonormal Basis, Revisited). The paper takes e1 along an edge; the choice changes
/// no term, because each face's map is fitted in this basis.
struct TangentBasis {
  Eigen::Vector3d e1;
  Eigen::Vector3d e2;

  /// @pre n_z > −1.
  LF_HD explicit TangentBasis(const Eigen::Vector3d& n) {
    const double share = 1.0 / (1.0 + n.z());
    const double mixed = -n.x() * n.y() * share;
    e1 = {1.0 - n.x() * n.x() * share, mixed, -n.x()};
    e2 = {mixed, 1.0 - n.y() * n.y() * share, -n.y()};
  }
  /// Coordinates of a vector's projection onto the tangent plane.
  [[nodiscard]] LF_HD Eigen::Vector2d local(const Eigen::Vector3d& v) const {
    return {e1.x() * v.x() + e1.y() * v.y() + e1.z() * v.z(),
            e2.x() * v.x() + e2.y() * v.y() + e2.z() * v.z()};
  }
  /// The vector with these coordinates.
  [[nodiscard]] LF_HD Eigen::Vector3d world(const Eigen::Vector2d& v) const {
    return {v.x() * e1.x() + v.y() * e2.x(), v.x() * e1.y() + v.y() * e2.y(),
            v.x() * e1.z() + v.y() * e2.z()};
  }
};

// The Weingarten map of every face and its consistency across edges.
//
// Numbers that were just computed are read one by one: read in pairs, as an Eigen vector, they
// stall a processor and the smoothness terms take twice as long.
//
// Notation: face i with frame (n, c) and symmetric map M = [[a, c], [c, b]] in the tangent basis
// (e1, e2); d̄, n̄ local coordinates of the differences of centroids and normals to a
// neighbour j; r = M d̄ − n̄ residual; δ = |r|²/|d̄|² mismatch, h = δ(i, j) + δ(j, i).

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

// Least-squares fit of a face's Weingarten map.

/// Tikhonov regularisation that keeps the fit of a face with one neighbour (a mesh corner)
/// determined.
inline constexpr double kFitRegularization = 1e-9;

/// Solution of a symmetric positive definite system; only the matrix's lower triangle is read. It
/// uses cofactors, with one division, because every face solves a system in every evaluation; the
/// divisions of a factorisation wait for each other.
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
  double curvature = 0.0;  ///< Coefficient of H²A for a + b, A/4.
  Eigen::Vector3d right{0.0, 0.0, 0.0};

  /// Adds a neighbour's term w |M d̄ − n̄|²/|d̄|².
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

/// E_face of one triangle, H² A (Sun et al., Eq. 15), and its slope by the area. Dimensionless.
/// @param area mm²
LF_HD inline ValueSlope mean_curvature_term(const WeingartenMap& m, double area) {
  const double squared = m.mean_curvature() * m.mean_curvature();
  return {squared * area, squared};
}

// E_face and the linear part of E_edge. Both are sums over faces of F = H²A + τ1 Σ w δ, each
// minimised over the face's own map. So neither the map's derivative (envelope theorem) nor a
// rotation of the tangent basis in its plane enters the derivatives.

/// Derivatives of one face's F. In single precision: they are only added to others of the same
/// size, and reading them from memory limits an evaluation's speed.
struct FaceBend {
  struct ByNeighbour {
    Eigen::Vector3f n;
    Eigen::Vector3f c;
  };
  ByNeighbour by_neighbours[3];  ///< Undefined at the boundary.
  Eigen::Vector3f by_tilt;       ///< By the face's own normal, through the tilt of the basis.
  float by_area;                 ///< mm²
};

/// A face with the map that minimises its F. @pre frames are up to date.
struct FittedFace {
  const FaceFrame& frame;
  TangentBasis basis;
  WeingartenMap map;
  double area;                 ///< mm²
  NeighbourOffset offsets[3];  ///< Zero at the boundary.

  LF_HD FittedFace(const ObjectiveView& o, std::int64_t i)
      : frame(o.scratch.frames[i]), basis(frame.n) {
    const double doubled_area = frame.n.dot(area_normal(o.corners(i)));  // |N|, without its root
    area = 0.5 * doubled_area;
    FaceFit fit;
    for (int k = 0; k < 3; ++k) {
      const int j = o.mesh.neighbour(i, k);
      if (j < 0) continue;
      offsets[k] = NeighbourOffset(frame, basis, o.scratch.frames[j]);
      fit.add(offsets[k], o.weights.edge * o.scratch.edge_weights[3 * i + k]);
    }
    fit.add_mean_curvature(doubled_area);
    map = fit.solve();
  }
};

/// Stores the weighted derivatives of a face's F; returns its shares of E_face and of Σ w h. @pre
/// frames are up to date.
struct BendFace {
  ObjectiveView o;

  LF_HD std::array<double, 2> operator()(std::int64_t i) const {
    const FittedFace face(o, i);
    const Eigen::Vector3d& n = face.frame.n;
    FaceBend& bend = o.scratch.bends[i];
    const ValueSlope curvature = mean_curvature_term(face.map, face.area);
    bend.by_area = static_cast<float>(o.weights.smooth * curvature.slope);
    Eigen::Vector2d tilt(0.0, 0.0);
    double edge = 0.0;
    for (int k = 0; k < 3; ++k) {
      const int j = o.mesh.neighbour(i, k);
      if (j < 0) continue;
      const FaceFrame& there = o.scratch.frames[j];
      const MismatchSlope slope(face.offsets[k], face.map);
      const double w = o.scratch.edge_weights[3 * i + k];
      const double scaled = o.weights.smooth * o.weights.edge * w;
      const Eigen::Vector3d by_n = scaled * face.basis.world(slope.by_n);
      const Eigen::Vector3d by_c = scaled * face.basis.world(slope.by_d);
      bend.by_neighbours[k] = {by_n.cast<float>(), by_c.cast<float>()};
      // A basis vector e tilts with the normal by −n (e·dn).
      const double along_d = scaled * n.dot(there.c - face.frame.c);
      const double along_n = scaled * n.dot(there.n);
      tilt.x() -= along_d * slope.by_d.x() + along_n * slope.by_n.x();
      tilt.y() -= along_d * slope.by_d.y() + along_n * slope.by_n.y();
      edge += w * slope.value;
    }
    bend.by_tilt = face.basis.world(tilt).cast<float>();
    return {curvature.value, edge};
  }
};

/// Derivatives of all faces' F by one face's frame and area. @pre bends are up to date.
LF_HD inline FaceFrame bend_adjoint(const ObjectiveView& o, std::int64_t face, double& area_bar) {
  const FaceBend& own = o.scratch.bends[face];
  FaceFrame bar;
  bar.n = own.by_tilt.cast<double>();
  for (int k = 0; k < 3; ++k) {
    const int j = o.mesh.neighbour(face, k);
    if (j < 0) continue;
    const FaceBend::ByNeighbour& there = o.scratch.bends[j].by_neighbours[o.mesh.edge_to(j, face)];
    bar.n += there.n.cast<double>();
    bar.c += there.c.cast<double>() - own.by_neighbours[k].c.cast<double>();
  }
  area_bar = own.by_area;
  return bar;
}

/// One vertex of E_lap. Stores its offset from the mean of its neighbours, divided by their number,
/// in `shares` (2 × V), where LaplacianGradient gathers it; zero on the boundary.
struct LaplacianDistance {
  MeshView mesh;
  const double* vertices;
  double* shares;

  LF_HD std::array<double, 1> operator()(std::int64_t v) const {
    column2(shares, v).setZero();
    if (mesh.on_boundary[v] != 0) return {0.0};
    const std::int32_t begin = mesh.vertex_neighbour_begin[v];
    const std::int32_t end = mesh.vertex_neighbour_begin[v + 1];
    Eigen::Vector2d sum(0.0, 0.0);
    for (std::int32_t k = begin; k < end; ++k) {
      sum += column3(vertices, mesh.vertex_neighbours[k]).head<2>();
    }
    const double count = static_cast<double>(end - begin);
    const Eigen::Vector2d difference = column3(vertices, v).head<2>() - sum / count;
    column2(shares, v) = difference / count;
    return {difference.squaredNorm()};
  }
};

/// Adds weight × ∂E_lap/∂(x, y) of one vertex.
struct LaplacianGradient {
  MeshView mesh;
  const double* shares;
  double weight;
  double* gradient;

  LF_HD void operator()(std::int64_t v) const {
    const std::int32_t begin = mesh.vertex_neighbour_begin[v];
    const std::int32_t end = mesh.vertex_neighbour_begin[v + 1];
    Eigen::Vector2d bar = static_cast<double>(end - begin) * column2(shares, v);
    for (std::int32_t k = begin; k < end; ++k) bar -= column2(shares, mesh.vertex_neighbours[k]);
    column3(gradient, v).head<2>() += 2.0 * weight * bar;
  }
};

/// E_lap = Σ over interior vertices of ‖P_U(v) − mean of P_U(neighbours)‖² (Sun et al., Eq. 16),
/// mm². Adds weight × derivative to x and y of `gradient` (3 × V), `.get()[0]` is the value.
/// @param distance  mesh, vertices and scratch memory.
template <class Exec>
auto laplacian_term(const Exec& executor, const LaplacianDistance& distance, double weight,
                    double* gradient) {
  const MeshView& mesh = distance.mesh;
  const auto value = pending_sum<1>(executor, "laplacian term", mesh.vertices, distance);
  parallel_for(executor, "laplacian gradient", mesh.vertices,
               LaplacianGradient{mesh, distance.shares, weight, gradient});
  return value;
}

}  // namespace lensforge
