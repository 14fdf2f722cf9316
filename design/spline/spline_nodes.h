// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/compute/lanes.h"
#include "core/mesh/surface_mesh.h"
#include "design/flux/columns.h"
#include "design/spline/made_by.h"

namespace lensforge {

/// Nodes along one direction of a spline as sums of its coefficients, and offsets of their heights.
struct AxisBasis {
  int coefficients = 0;
  int taps = 0;                    ///< Coefficients per node.
  std::vector<int> first;          ///< Per node: number of its first coefficient; non-decreasing.
  std::vector<double> value;       ///< For heights; taps × nodes.
  std::vector<double> slope;       ///< taps × nodes, derivatives by the knot cell.
  std::vector<double> plan_value;  ///< For x and y: the spline itself; taps × nodes.
  std::vector<double> plan_slope;  ///< taps × nodes, derivatives by the knot cell.
  std::vector<double> lift;        ///< Added to a node's height, mm.
  std::vector<double> tilt;        ///< Derivative of lift, mm per knot cell.

  [[nodiscard]] int nodes() const { return static_cast<int>(first.size()); }
};

/// Points k / samples in 0 … cells, in knot cells.
std::vector<double> even_points(int cells, int samples);

/// The spline itself: cubic B-splines with a knot at every whole number, fourfold at both ends.
/// @param points  of the nodes, ascending, in knot cells.
AxisBasis plain_basis(int cells, const std::vector<double>& points);

/// An even spline's direction in space.
struct AxisLength {
  int axis = 0;         ///< 0: x; 1: y.
  int cells = 1;        ///< Knot cells, ≥ 1.
  double length = 1.0;  ///< mm
};

/// The made surface (MadeSurface) of an even spline: f replaced by G_σ ∗ (f + p²/24 · f″), minus
/// the depth polished off at the rim. It is linear in the coefficients, so the made surface is a
/// sum of the same coefficients with other functions. For a spline with uneven knots it is an
/// approximation.
///
/// Where the polish's transfer is no product of functions along x and y (PolishTransfer), the made
/// height is a sum of products, one for each basis of this list along x and the same of that along
/// y: the terms of a film, and for a floor the spline itself. The first has rim and plan.
/// @param points  as for plain_basis(). @pre made.polish_sigma > 0.
std::vector<AxisBasis> made_bases(const AxisLength& along, const std::vector<double>& points,
                                  const MadeBy& made);

/// The first of made_bases(): all of it for a Gaussian without a floor.
AxisBasis made_basis(const AxisLength& along, const std::vector<double>& points,
                     const MadeBy& made);

// Spline model: a tensor product of cubic B-splines evaluated on an even grid of nodes, and the
// adjoint. Both are two passes with few taps (AxisBasis), first along u, then along v.
//
// Notation: c control point, B the basis' functions, a = Σ B(u) c, a' = Σ B'(u) c along a row of
// control points; p = Σ B(v) a a node, p_u = Σ B(v) a', p_v = Σ B'(v) a, n = p_u × p_v; a bar is
// ∂E/∂.

/// AxisBasis for kernels.
struct AxisTaps {
  int taps;                  ///< Coefficients per node.
  const int* first;          ///< Per node: number of its first coefficient.
  const double* value;       ///< For heights; taps × nodes.
  const double* slope;       ///< taps × nodes, per knot cell.
  const double* plan_value;  ///< For x and y.
  const double* plan_slope;
  const double* lift;  ///< Per node, mm.
  const double* tilt;  ///< Per node, mm per knot cell.
  const int* begin;    ///< Per coefficient: its first node, and one past its last.
  const int* end;

  /// A coefficient's, or several nodes' coefficients', shares of x, y and z of a node, and of their
  /// derivatives.
  template <class T>
  [[nodiscard]] LF_HD LF_INLINE SpaceVector<T> valued(std::int64_t tap,
                                                      const SpaceVector<T>& c) const {
    return {plan_value[tap] * c.x(), plan_value[tap] * c.y(), value[tap] * c.z()};
  }
  template <class T>
  [[nodiscard]] LF_HD LF_INLINE SpaceVector<T> sloped(std::int64_t tap,
                                                      const SpaceVector<T>& c) const {
    return {plan_slope[tap] * c.x(), plan_slope[tap] * c.y(), slope[tap] * c.z()};
  }
};

/// AxisTaps in the memory of an executor.
template <class Exec>
class AxisTapsOn {
 public:
  AxisTapsOn(const AxisBasis& basis, const Exec& executor)
      : taps_(basis.taps),
        first_(buffer_of(executor, std::span<const int>(basis.first))),
        value_(buffer_of(executor, std::span<const double>(basis.value))),
        slope_(buffer_of(executor, std::span<const double>(basis.slope))),
        plan_value_(buffer_of(executor, std::span<const double>(basis.plan_value))),
        plan_slope_(buffer_of(executor, std::span<const double>(basis.plan_slope))),
        lift_(buffer_of(executor, std::span<const double>(basis.lift))),
        tilt_(buffer_of(executor, std::span<const double>(basis.tilt))) {
    std::vector<int> begin(static_cast<std::size_t>(basis.coefficients), basis.nodes());
    std::vector<int> end(begin.size(), 0);
    for (int k = 0; k < basis.nodes(); ++k) {
      for (int j = 0; j < basis.taps; ++j) {
        const int coefficient = basis.first[static_cast<std::size_t>(k)] + j;
        const auto c = static_cast<std::size_t>(coefficient);
        begin[c] = std::min(begin[c], k);
        end[c] = k + 1;
      }
    }
    begin_ = buffer_of(executor, std::span<const int>(begin));
    end_ = buffer_of(executor, std::span<const int>(end));
  }

  [[nodiscard]] AxisTaps view() const {
    return {taps_,         first_.data(),      value_.data(),
            slope_.data(), plan_value_.data(), plan_slope_.data(),
            lift_.data(),  tilt_.data(),       begin_.data(),
            end_.data()};
  }
  [[nodiscard]] int nodes() const { return static_cast<int>(first_.size()); }
  [[nodiscard]] int coefficients() const { return static_cast<int>(begin_.size()); }

 private:
  template <class T>
  using Buffer = typename Exec::template Buffer<T>;

  int taps_;
  Buffer<int> first_;
  Buffer<double> value_;
  Buffer<double> slope_;
  Buffer<double> plan_value_;
  Buffer<double> plan_slope_;
  Buffer<double> lift_;
  Buffer<double> tilt_;
  Buffer<int> begin_;
  Buffer<int> end_;
};

/// A table of vectors, row by row: x of all, then y, then z, so that several are read at once.
struct VectorTable {
  double* numbers;
  std::int64_t size;  ///< Number of vectors.

  /// Vectors i and following, as many as T has doubles.
  template <class T>
  [[nodiscard]] LF_HD LF_INLINE SpaceVector<T> at(std::int64_t i) const {
    return {load_lanes<T>(numbers + i), load_lanes<T>(numbers + size + i),
            load_lanes<T>(numbers + 2 * size + i)};
  }
  template <class T>
  LF_HD LF_INLINE void set(std::int64_t i, const SpaceVector<T>& v) const {
    store_lanes<T>(v.x(), numbers + i);
    store_lanes<T>(v.y(), numbers + size + i);
    store_lanes<T>(v.z(), numbers + 2 * size + i);
  }
};

/// Arguments of the kernels.
struct SplineNodesView {
  AxisTaps u;
  AxisTaps v;
  std::int64_t columns;  ///< Columns of control points.
  std::int64_t nodes_u;
  VectorTable along;  ///< nodes_u × rows of control points: a, and in an adjoint its bar.
  VectorTable steep;  ///< The same of a'.
  VectorTable by_u;   ///< Of all nodes: p_u
  VectorTable by_v;   ///< Of all nodes: p_v
};

/// a and a' of one node column and one row of control points.
struct LookAlongRow {
  SplineNodesView s;
  const double* points;

  LF_HD void operator()(std::int64_t i) const {
    const std::int64_t node = i % s.nodes_u;
    const std::int64_t at = i / s.nodes_u * s.columns + s.u.first[node];
    Eigen::Vector3d a(0.0, 0.0, 0.0);
    Eigen::Vector3d steep(0.0, 0.0, 0.0);
    for (int k = 0; k < s.u.taps; ++k) {
      const Eigen::Vector3d c = column3(points, at + k);
      a += s.u.valued<double>(s.u.taps * node + k, c);
      steep += s.u.sloped<double>(s.u.taps * node + k, c);
    }
    s.along.set<double>(i, a);
    s.steep.set<double>(i, steep);
  }
};

/// Computes one node, or several of a row, and their normals.
struct LookAcrossRows {
  SplineNodesView s;
  double* positions;
  double* normals;

  LF_HD void operator()(std::int64_t i) const { call<double>(i); }
  template <class T>
  LF_HD LF_INLINE void call(std::int64_t i) const {
    const std::int64_t node = i / s.nodes_u;
    const std::int64_t column = i % s.nodes_u;
    const std::int64_t at = s.v.first[node] * s.nodes_u + column;
    SpaceVector<T> p{T{}, T{}, T{}};
    SpaceVector<T> p_u{T{}, T{}, T{}};
    SpaceVector<T> p_v{T{}, T{}, T{}};
    for (int k = 0; k < s.v.taps; ++k) {
      const std::int64_t tap = s.v.taps * node + k;
      const SpaceVector<T> a = s.along.at<T>(at + k * s.nodes_u);
      p += s.v.valued<T>(tap, a);
      p_v += s.v.sloped<T>(tap, a);
      p_u += s.v.valued<T>(tap, s.steep.at<T>(at + k * s.nodes_u));
    }
    p.z() += load_lanes<T>(s.u.lift + column) + s.v.lift[node];
    p_u.z() += load_lanes<T>(s.u.tilt + column);
    p_v.z() += s.v.tilt[node];
    set_columns3<T>(positions, i, p);
    s.by_u.set<T>(i, p_u);
    s.by_v.set<T>(i, p_v);
    set_columns3<T>(normals, i, p_u.cross(p_v));
  }
};

/// Computes the bars of a and a' for one node column, or several, and one row of control points.
/// They follow from n̄ · dn = dp_u · (p_v × n̄) + dp_v · (n̄ × p_u).
struct GatherAcrossRows {
  SplineNodesView s;
  const double* position_bar;
  const double* normal_bar;

  LF_HD void operator()(std::int64_t i) const { call<double>(i); }
  template <class T>
  LF_HD LF_INLINE void call(std::int64_t i) const {
    const std::int64_t row = i / s.nodes_u;
    SpaceVector<T> a_bar{T{}, T{}, T{}};
    SpaceVector<T> steep_bar{T{}, T{}, T{}};
    for (std::int64_t node = s.v.begin[row]; node < s.v.end[row]; ++node) {
      const std::int64_t tap = s.v.taps * node + row - s.v.first[node];
      const std::int64_t at = node * s.nodes_u + i % s.nodes_u;
      const SpaceVector<T> n_bar = columns3<T>(normal_bar, at);
      const SpaceVector<T> u_bar = s.by_v.at<T>(at).cross(n_bar);
      const SpaceVector<T> v_bar = n_bar.cross(s.by_u.at<T>(at));
      a_bar += s.v.valued<T>(tap, columns3<T>(position_bar, at)) + s.v.sloped<T>(tap, v_bar);
      steep_bar += s.v.valued<T>(tap, u_bar);
    }
    s.along.set<T>(i, a_bar);
    s.steep.set<T>(i, steep_bar);
  }
};

/// Computes the bar of one control point.
struct GatherAlongRow {
  SplineNodesView s;
  double* points_bar;

  LF_HD void operator()(std::int64_t i) const {
    const std::int64_t column = i % s.columns;
    const std::int64_t row = i / s.columns;
    Eigen::Vector3d c_bar(0.0, 0.0, 0.0);
    for (std::int64_t node = s.u.begin[column]; node < s.u.end[column]; ++node) {
      const std::int64_t tap = s.u.taps * node + column - s.u.first[node];
      const std::int64_t at = row * s.nodes_u + node;
      c_bar += s.u.valued<double>(tap, s.along.at<double>(at)) +
               s.u.sloped<double>(tap, s.steep.at<double>(at));
    }
    column3(points_bar, i) = c_bar;
  }
};

/// Kernels on the CPU, for several nodes of a row at a time, to the bits of single ones.
void call_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                   const LookAcrossRows& look, Lanes lanes = widest_lanes());
void call_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                   const GatherAcrossRows& gather, Lanes lanes = widest_lanes());

inline void parallel_for(const Executor& executor, const char* kernel, std::int64_t count,
                         const LookAcrossRows& look) {
  call_in_lanes(executor, kernel, count, look);
}
inline void parallel_for(const Executor& executor, const char* kernel, std::int64_t count,
                         const GatherAcrossRows& gather) {
  call_in_lanes(executor, kernel, count, gather);
}

/// Nodes of a net of control points, and their adjoint.
template <class Exec>
class SplineNodesOn {
 public:
  SplineNodesOn(const AxisBasis& u, const AxisBasis& v, const Exec& executor)
      : executor_(executor),
        u_(u, executor),
        v_(v, executor),
        along_(3 * static_cast<std::size_t>(u_.nodes()) *
               static_cast<std::size_t>(v_.coefficients())),
        steep_(along_.size()),
        by_u_(3 * static_cast<std::size_t>(u_.nodes()) * static_cast<std::size_t>(v_.nodes())),
        by_v_(by_u_.size()) {}

  [[nodiscard]] GridShape shape() const { return {u_.nodes(), v_.nodes()}; }

  /// Computes points and normals (of any length) of all nodes from the control points.
  void look(const double* points, double* positions, double* normals) {
    parallel_for(executor_, "spline rows", table_size(), LookAlongRow{view(), points});
    parallel_for(executor_, "spline nodes", node_count(),
                 LookAcrossRows{view(), positions, normals});
  }

  /// Adjoint of look() at the control points of its last call.
  void look_adjoint(const double* position_bar, const double* normal_bar, double* points_bar) {
    parallel_for(executor_, "spline nodes adjoint", table_size(),
                 GatherAcrossRows{view(), position_bar, normal_bar});
    parallel_for(executor_, "spline rows adjoint",
                 std::int64_t{u_.coefficients()} * v_.coefficients(),
                 GatherAlongRow{view(), points_bar});
  }

 private:
  [[nodiscard]] std::int64_t table_size() const {
    return std::int64_t{u_.nodes()} * v_.coefficients();
  }
  [[nodiscard]] std::int64_t node_count() const { return std::int64_t{u_.nodes()} * v_.nodes(); }
  [[nodiscard]] SplineNodesView view() {
    const std::int64_t nodes = node_count();
    return {u_.view(),
            v_.view(),
            u_.coefficients(),
            u_.nodes(),
            {along_.data(), table_size()},
            {steep_.data(), table_size()},
            {by_u_.data(), nodes},
            {by_v_.data(), nodes}};
  }

  Exec executor_;
  AxisTapsOn<Exec> u_;
  AxisTapsOn<Exec> v_;
  typename Exec::template Buffer<double> along_;
  typename Exec::template Buffer<double> steep_;
  typename Exec::template Buffer<double> by_u_;
  typename Exec::template Buffer<double> by_v_;
};

/// Nodes of the spline itself. @param samples  nodes per knot cell each way.
template <class Exec>
SplineNodesOn<Exec> spline_nodes_on(const GridShape& net, int samples, const Exec& executor) {
  const auto basis = [&](int coefficients) {
    return plain_basis(coefficients - 3, even_points(coefficients - 3, samples));
  };
  return {basis(net.columns), basis(net.rows), executor};
}

}  // namespace lensforge
