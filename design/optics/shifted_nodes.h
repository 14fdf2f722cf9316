// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/compute/executor.h"
#include "core/spline/control_net.h"
#include "design/optics/columns.h"
#include "design/optics/made_surface.h"
#include "design/optics/spline_nodes.h"

namespace lensforge {

/// Nodes of a spline, moved in z to what is made of it there, as MadeNodes has them, for knot cells
/// much wider than the polish's σ: what becomes of even knots is in the nodes (made_basis()) and in
/// the adjoint; what that leaves out is measured by measure() (MadeSurface) and stays until the
/// next call. The grid of MadeNodes would have many samples for each knot cell; how the rest
/// depends on the control points counts little here.
class ShiftedNodes {
 public:
  /// @param net  control points of the spline; its lens has this size.
  ShiftedNodes(const GridShape& net, const Eigen::Vector2d& size, int samples, const MadeBy& made,
               const Executor& executor)
      : executor_(executor),
        net_{net, Eigen::Matrix3Xd(3, Eigen::Index{net.columns} * net.rows)},
        made_(made),
        nodes_(basis_along({0, net.columns - 3, size.x()}, samples, made),
               basis_along({1, net.rows - 3, size.y()}, samples, made), executor) {}

  [[nodiscard]] GridShape shape() const { return nodes_.shape(); }

  /// Measures at these control points what is added to the nodes. @throw Interrupted.
  void measure(const double* points) {
    if (!shift_.empty() && std::equal(points, points + net_.points.size(), net_.points.data())) {
      return;  // A round begins where one ended.
    }
    std::copy_n(points, net_.points.size(), net_.points.data());
    std::vector<double> positions(3 * count());
    std::vector<double> normals(positions.size());
    nodes_.look(points, positions.data(), normals.data());
    const MadeSurface made(net_, made_, executor_);
    shift_.resize(positions.size());
    const auto measure = [&](std::int64_t i) {
      const auto p = column3(positions.data(), i);
      const auto n = column3(normals.data(), i);
      const SurfacePoint point = made.at(p.head<2>());
      column3(shift_.data(), i) << point.slope + n.head<2>() / n.z(), point.z - p.z();
    };
    parallel_for(executor_, "measure shift", static_cast<std::int64_t>(count()), measure);
  }

  /// Points and normals (of any length) of all nodes.
  void look(const double* points, double* positions, double* normals) {
    nodes_.look(points, positions, normals);
    if (shift_.empty()) return;
    parallel_for(executor_, "shift nodes", static_cast<std::int64_t>(count()), [&](std::int64_t i) {
      const auto add = column3(shift_.data(), i);
      auto n = column3(normals, i);
      n.head<2>() -= n.z() * add.head<2>();
      column3(positions, i).z() += add.z();
    });
  }

  /// Adjoint of look() at the control points that were looked at last.
  /// @param normal_bar  is changed.
  void look_adjoint(const double* position_bar, double* normal_bar, double* points_bar) {
    if (!shift_.empty()) {
      parallel_for(executor_, "shift nodes adjoint", static_cast<std::int64_t>(count()),
                   [&](std::int64_t i) {
                     auto n = column3(normal_bar, i);
                     n.z() -= column3(shift_.data(), i).head<2>().dot(n.head<2>());
                   });
    }
    nodes_.look_adjoint(position_bar, normal_bar, points_bar);
  }

 private:
  static AxisBasis basis_along(const AxisLength& along, int samples, const MadeBy& made) {
    return made_basis(along, even_points(along.cells, samples), made);
  }
  [[nodiscard]] std::size_t count() const {
    return static_cast<std::size_t>(shape().columns) * static_cast<std::size_t>(shape().rows);
  }

  Executor executor_;
  ControlNet net_;  ///< That was measured last.
  MadeBy made_;
  SplineNodesOn<Executor> nodes_;
  std::vector<double> shift_;  ///< 3 × nodes: ∂z/∂x, ∂z/∂y and z; empty before measure().
};

}  // namespace lensforge
