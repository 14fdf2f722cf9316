// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/compute/lanes.h"
#include "core/compute/scalar.h"
#include "core/mesh/surface_mesh.h"
#include "design/energy/objective_view.h"

namespace lensforge {

// T is a double, or a vector of the doubles of several faces (face_batch.cpp), each with the
// same bits.

/// Centroid c and unit normal n of a triangle, n_z > −1 (Sun et al., section 3.3). The same struct
/// holds derivatives by these vectors.
template <class T>
struct FaceFrameOf {
  SpaceVector<T> n{T{}, T{}, T{}};
  SpaceVector<T> c{T{}, T{}, T{}};
};

/// Unit normal and twice the area of a triangle, mm².
template <class T>
struct FaceNormalOf {
  SpaceVector<T> n;
  T doubled_area;

  LF_HD LF_INLINE FaceNormalOf(const SpaceVector<T>& unit, const T& area)
      : n(unit), doubled_area(area) {}
  LF_HD LF_INLINE explicit FaceNormalOf(const CornersOf<T>& t) {
    const SpaceVector<T> normal = area_normal(t);
    const T inverse = 1.0 / length_of<T>(normal);
    n = inverse * normal;
    doubled_area = n.dot(normal);  // Without waiting for the root.
  }
};
using FaceNormal = FaceNormalOf<double>;

template <class T>
LF_HD LF_INLINE SpaceVector<T> centroid(const CornersOf<T>& t) {
  return (1.0 / 3.0) * (t.v0 + t.v1 + t.v2);
}

template <class T>
LF_HD LF_INLINE FaceFrameOf<T> face_frame(const CornersOf<T>& t) {
  return {FaceNormalOf<T>(t).n, centroid(t)};
}

/// Two unit vectors at right angles to each other and to a normal, e2 = n × e1 (Duff et al. 2017,
/// Building an Orthonormal Basis, Revisited). The paper takes e1 along an edge; the choice changes
/// no term, because each face's map is fitted in this basis.
template <class T>
struct TangentBasisOf {
  SpaceVector<T> e1;
  SpaceVector<T> e2;

  /// @pre n_z > −1.
  LF_HD LF_INLINE explicit TangentBasisOf(const SpaceVector<T>& n) {
    const T share = 1.0 / (1.0 + n.z());
    const T mixed = -n.x() * n.y() * share;
    e1 = {1.0 - n.x() * n.x() * share, mixed, -n.x()};
    e2 = {mixed, 1.0 - n.y() * n.y() * share, -n.y()};
  }
  /// Coordinates of a vector's projection onto the tangent plane.
  [[nodiscard]] LF_HD LF_INLINE PlaneVector<T> local(const SpaceVector<T>& v) const {
    return {e1.x() * v.x() + e1.y() * v.y() + e1.z() * v.z(),
            e2.x() * v.x() + e2.y() * v.y() + e2.z() * v.z()};
  }
  /// The vector with these coordinates.
  [[nodiscard]] LF_HD LF_INLINE SpaceVector<T> world(const PlaneVector<T>& v) const {
    return {v.x() * e1.x() + v.y() * e2.x(), v.x() * e1.y() + v.y() * e2.y(),
            v.x() * e1.z() + v.y() * e2.z()};
  }
};
using TangentBasis = TangentBasisOf<double>;

/// The lower triangle of a symmetric matrix, indexed as Eigen's.
template <class T>
struct LowerTriangle {
  T entries[3][3];

  [[nodiscard]] LF_HD LF_INLINE T& operator()(int row, int column) { return entries[row][column]; }
  [[nodiscard]] LF_HD LF_INLINE const T& operator()(int row, int column) const {
    return entries[row][column];
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
template <class T>
struct WeingartenMapOf {
  T a{};
  T b{};
  T c{};

  /// Half the trace.
  [[nodiscard]] LF_HD LF_INLINE T mean_curvature() const { return 0.5 * (a + b); }
};

/// Local coordinates of a neighbour (Sun et al., Eqs. 11 and 12).
template <class T>
struct NeighbourOffsetOf {
  PlaneVector<T> d{T{}, T{}};  ///< mm
  PlaneVector<T> n{T{}, T{}};
  T inverse{};  ///< 1/|d̄|², 1/mm²

  NeighbourOffsetOf() = default;
  LF_HD LF_INLINE NeighbourOffsetOf(const PlaneVector<T>& d_bar, const PlaneVector<T>& n_bar)
      : d(d_bar), n(n_bar), inverse(1.0 / (d_bar.x() * d_bar.x() + d_bar.y() * d_bar.y())) {}
  /// @param basis  of i's tangent plane.
  LF_HD LF_INLINE NeighbourOffsetOf(const FaceFrameOf<T>& i, const TangentBasisOf<T>& basis,
                                    const FaceFrameOf<T>& j)
      : NeighbourOffsetOf(basis.local(j.c - i.c), basis.local(j.n)) {}

  [[nodiscard]] LF_HD LF_INLINE PlaneVector<T> residual(const WeingartenMapOf<T>& m) const {
    return {m.a * d.x() + m.c * d.y() - n.x(), m.c * d.x() + m.b * d.y() - n.y()};
  }
  /// δ of Sun et al., Eq. 13, 1/mm².
  [[nodiscard]] LF_HD LF_INLINE T mismatch(const WeingartenMapOf<T>& m) const {
    const PlaneVector<T> r = residual(m);
    return (r.x() * r.x() + r.y() * r.y()) * inverse;
  }
};
using NeighbourOffset = NeighbourOffsetOf<double>;

/// δ(i, j) and its derivatives by d̄ and n̄.
template <class T>
struct MismatchSlopeOf {
  T value;
  PlaneVector<T> by_d;
  PlaneVector<T> by_n;

  LF_HD LF_INLINE MismatchSlopeOf(const NeighbourOffsetOf<T>& offset, const WeingartenMapOf<T>& m) {
    const PlaneVector<T> r = offset.residual(m);
    value = (r.x() * r.x() + r.y() * r.y()) * offset.inverse;
    const T scale = -2.0 * offset.inverse;
    by_n = {scale * r.x(), scale * r.y()};
    const T pull = 2.0 * value * offset.inverse;
    by_d = {-m.a * by_n.x() - m.c * by_n.y() - pull * offset.d.x(),
            -m.c * by_n.x() - m.b * by_n.y() - pull * offset.d.y()};
  }
};
using MismatchSlope = MismatchSlopeOf<double>;

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
template <class Matrix, class Vector>
LF_HD LF_INLINE Vector solve_positive(const Matrix& m, const Vector& right) {
  using T = typename Vector::Scalar;
  const T c00 = m(1, 1) * m(2, 2) - m(2, 1) * m(2, 1);
  const T c10 = m(2, 0) * m(2, 1) - m(1, 0) * m(2, 2);
  const T c20 = m(1, 0) * m(2, 1) - m(2, 0) * m(1, 1);
  const T c11 = m(0, 0) * m(2, 2) - m(2, 0) * m(2, 0);
  const T c21 = m(1, 0) * m(2, 0) - m(0, 0) * m(2, 1);
  const T c22 = m(0, 0) * m(1, 1) - m(1, 0) * m(1, 0);
  const T inverse = 1.0 / (m(0, 0) * c00 + m(1, 0) * c10 + m(2, 0) * c20);
  return {inverse * (c00 * right.x() + c10 * right.y() + c20 * right.z()),
          inverse * (c10 * right.x() + c11 * right.y() + c21 * right.z()),
          inverse * (c20 * right.x() + c21 * right.y() + c22 * right.z())};
}

/// Normal equations of the map (a, b, c) that minimises H²A + Σ w |M d̄ − n̄|²/|d̄|².
template <class T>
struct FaceFitOf {
  T xx{};  ///< Σ w d̄x²/|d̄|², and so on.
  T yy{};
  T xy{};
  T curvature{};  ///< Coefficient of H²A for a + b, A/4.
  SpaceVector<T> right{T{}, T{}, T{}};

  /// Adds a neighbour's term w |M d̄ − n̄|²/|d̄|².
  LF_HD LF_INLINE void add(const NeighbourOffsetOf<T>& offset, const T& weight) {
    const T w = weight * offset.inverse;
    const T wx = w * offset.d.x();
    const T wy = w * offset.d.y();
    xx += wx * offset.d.x();
    yy += wy * offset.d.y();
    xy += wx * offset.d.y();
    right +=
        SpaceVector<T>(wx * offset.n.x(), wy * offset.n.y(), wy * offset.n.x() + wx * offset.n.y());
  }
  /// Adds H²A. @param doubled_area  of the face, mm².
  LF_HD LF_INLINE void add_mean_curvature(const T& doubled_area) {
    curvature += 0.125 * doubled_area;
  }

  [[nodiscard]] LF_HD LF_INLINE WeingartenMapOf<T> solve() const {
    const T tikhonov = kFitRegularization * 2.0 * (xx + yy + curvature);
    LowerTriangle<T> lower;
    lower(0, 0) = xx + curvature + tikhonov;
    lower(1, 0) = curvature;
    lower(2, 0) = xy;
    lower(1, 1) = yy + curvature + tikhonov;
    lower(2, 1) = xy;
    lower(2, 2) = xx + yy + 2.0 * tikhonov;
    const SpaceVector<T> m = solve_positive(lower, right);
    return {m.x(), m.y(), m.z()};
  }
};
using FaceFit = FaceFitOf<double>;

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

/// A face and its neighbours. Those at the boundary are the face itself and do not count.
template <class T>
struct FaceRing {
  FaceFrameOf<T> frame;
  T doubled_area{};
  FaceFrameOf<T> there[3];
  T edge_weights[3] = {};
  bool inner[3] = {};
};

/// @pre frames are up to date.
LF_HD inline FaceRing<double> face_ring(const ObjectiveView& o, std::int64_t i) {
  FaceRing<double> ring;
  ring.frame = o.scratch.frames[i];
  ring.doubled_area = o.scratch.doubled_areas[i];
  for (int k = 0; k < 3; ++k) {
    const int j = o.mesh.neighbour(i, k);
    ring.inner[k] = j >= 0;
    if (j < 0) continue;
    ring.there[k] = o.scratch.frames[j];
    ring.edge_weights[k] = o.scratch.edge_weights[3 * i + k];
  }
  return ring;
}

/// A face with the map that minimises its F.
template <class T>
struct FittedFaceOf {
  TangentBasisOf<T> basis;
  WeingartenMapOf<T> map;
  NeighbourOffsetOf<T> offsets[3];  ///< Zero at the boundary.

  LF_HD LF_INLINE FittedFaceOf(const FaceRing<T>& ring, double edge_weight) : basis(ring.frame.n) {
    FaceFitOf<T> fit;
    for (int k = 0; k < 3; ++k) {
      if (!ring.inner[k]) continue;
      offsets[k] = NeighbourOffsetOf<T>(ring.frame, basis, ring.there[k]);
      fit.add(offsets[k], edge_weight * ring.edge_weights[k]);
    }
    fit.add_mean_curvature(ring.doubled_area);
    map = fit.solve();
  }
};

/// Weighted derivatives of one face's F, and its shares of E_face and of Σ w h.
template <class T>
struct BentFace {
  FaceFrameOf<T> by_neighbours[3];  ///< Zero at the boundary.
  SpaceVector<T> by_tilt;
  T by_area;
  T curvature;
  T edge{};

  LF_HD LF_INLINE BentFace(const FaceRing<T>& ring, const ObjectiveWeights& weights) {
    const FittedFaceOf<T> face(ring, weights.edge);
    const T squared = face.map.mean_curvature() * face.map.mean_curvature();
    curvature = squared * (0.5 * ring.doubled_area);
    by_area = weights.smooth * squared;
    PlaneVector<T> tilt{T{}, T{}};
    for (int k = 0; k < 3; ++k) {
      if (ring.inner[k]) add_neighbour(ring, face, k, weights.smooth * weights.edge, tilt);
    }
    by_tilt = face.basis.world(tilt);
  }

 private:
  LF_HD LF_INLINE void add_neighbour(const FaceRing<T>& ring, const FittedFaceOf<T>& face, int k,
                                     double weight, PlaneVector<T>& tilt) {
    const FaceFrameOf<T>& there = ring.there[k];
    const MismatchSlopeOf<T> slope(face.offsets[k], face.map);
    const T scaled = weight * ring.edge_weights[k];
    by_neighbours[k].n = scaled * face.basis.world(slope.by_n);
    by_neighbours[k].c = scaled * face.basis.world(slope.by_d);
    // A basis vector e tilts with the normal by −n (e·dn).
    const SpaceVector<T>& n = ring.frame.n;
    const SpaceVector<T> to_there = there.c - ring.frame.c;
    const T along_d = scaled * n.dot(to_there);
    const T along_n = scaled * n.dot(there.n);
    tilt.x() -= along_d * slope.by_d.x() + along_n * slope.by_n.x();
    tilt.y() -= along_d * slope.by_d.y() + along_n * slope.by_n.y();
    edge += ring.edge_weights[k] * slope.value;
  }
};

/// Stores the weighted derivatives of a face's F; returns its shares of E_face and of Σ w h. @pre
/// frames are up to date.
struct BendFace {
  ObjectiveView o;

  LF_HD std::array<double, 2> operator()(std::int64_t i) const {
    const FaceRing<double> ring = face_ring(o, i);
    const BentFace<double> bent(ring, o.weights);
    FaceBend& bend = o.scratch.bends[i];
    bend.by_area = static_cast<float>(bent.by_area);
    for (int k = 0; k < 3; ++k) {
      const FaceFrame& by = bent.by_neighbours[k];
      if (ring.inner[k]) bend.by_neighbours[k] = {by.n.cast<float>(), by.c.cast<float>()};
    }
    bend.by_tilt = bent.by_tilt.cast<float>();
    return {bent.curvature, bent.edge};
  }
};

/// The same for all faces on the CPU, several at a time: face_batch.cpp.
FinishedSum<2> sum_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                            const BendFace& bend, Lanes lanes = widest_lanes());

template <std::size_t N>
FinishedSum<N> pending_sum(const Executor& executor, const char* kernel, std::int64_t count,
                           const BendFace& bend) {
  return sum_in_lanes(executor, kernel, count, bend);
}

/// A face's bend and what its neighbours' bends have left for it.
template <class T>
struct BendRing {
  SpaceVector<T> by_tilt;
  T by_area;
  SpaceVector<T> own_c[3];     ///< Own derivatives by the neighbours' c.
  FaceFrameOf<T> by_there[3];  ///< The neighbours' derivatives by this face's frame.
  bool inner[3] = {};
};

/// @pre bends are up to date.
LF_HD inline BendRing<double> bend_ring(const ObjectiveView& o, std::int64_t face) {
  const FaceBend& own = o.scratch.bends[face];
  BendRing<double> ring;
  ring.by_tilt = own.by_tilt.cast<double>();
  ring.by_area = own.by_area;
  for (int k = 0; k < 3; ++k) {
    const int j = o.mesh.neighbour(face, k);
    ring.inner[k] = j >= 0;
    if (j < 0) continue;
    const FaceBend::ByNeighbour& there = o.scratch.bends[j].by_neighbours[o.mesh.edge_to(j, face)];
    ring.by_there[k] = {there.n.cast<double>(), there.c.cast<double>()};
    ring.own_c[k] = own.by_neighbours[k].c.cast<double>();
  }
  return ring;
}

/// Derivatives of all faces' F by one face's frame.
template <class T>
LF_HD LF_INLINE FaceFrameOf<T> bend_adjoint(const BendRing<T>& ring) {
  FaceFrameOf<T> bar;
  bar.n = ring.by_tilt;
  for (int k = 0; k < 3; ++k) {
    if (!ring.inner[k]) continue;
    bar.n += ring.by_there[k].n;
    bar.c += ring.by_there[k].c - ring.own_c[k];
  }
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
