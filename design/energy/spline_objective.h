// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/surface/control_net.h"
#include "core/surface/surface_mesh.h"
#include "design/energy/objective_on.h"
#include "design/optics/columns.h"
#include "design/optics/made_surface.h"
#include "design/optics/spline_nodes.h"

namespace lensforge {

/// Moves nodes of a spline to other heights and slopes.
struct ShiftNode {
  const double* shift;  ///< 3 × nodes: added to ∂z/∂x, ∂z/∂y and z.
  double* positions;
  double* normals;

  LF_HD void operator()(std::int64_t i) const {
    const auto add = column3(shift, i);
    auto n = column3(normals, i);
    n.x() -= n.z() * add.x();
    n.y() -= n.z() * add.y();
    column3(positions, i).z() += add.z();
  }
};

/// Its adjoint; the bars of the positions are the same before and after.
struct ShiftNodeAdjoint {
  const double* shift;
  double* normal_bar;

  LF_HD void operator()(std::int64_t i) const {
    const auto add = column3(shift, i);
    auto n = column3(normal_bar, i);
    n.z() -= add.x() * n.x() + add.y() * n.y();
  }
};

/// DesignObjective of a spline's control points: every node of the spline sends one ray by the
/// spline's own normal. Barriers and the goal are those of the mesh of the nodes; there are no
/// smoothness terms. Same interface as DesignObjectiveOn.
///
/// With ObjectiveOptions::made_by the nodes are those of what becomes of the spline. made_basis()
/// has that for even knots; what even knots leave out is measured by relinearize() (MadeSurface)
/// and stays until the next one.
template <class Exec>
class SplineObjectiveOn {
 public:
  /// @param net  a ControlNet as a mesh.
  SplineObjectiveOn(const SurfaceMesh& net, const OpticalSetup& setup, const DesignGoal& goal,
                    const ObjectiveOptions& options, const Exec& executor)
      : executor_(executor),
        nodes_(basis_along(0, net, setup, options), basis_along(1, net, setup, options), executor),
        core_(spline_nodes({net.grid, net.vertices}, options.samples).mesh, setup, goal, options,
              executor),
        movable_(objective_detail::movable_coordinates(net.vertices, setup.lens_size)),
        movable_here_(buffer_of(executor, objective_detail::entries(movable_))),
        positions_(3 * static_cast<std::size_t>(nodes_.shape().columns) *
                   static_cast<std::size_t>(nodes_.shape().rows)),
        positions_bar_(positions_.size()),
        made_by_(options.made_by),
        grid_(net.grid) {}

  /// @throw Interrupted.
  void relinearize(const double* points) {
    if (made_by_ && !is_measured_at(points)) measure_shift(points);
    look(points);
    core_.relinearize(positions_.data());
  }

  ObjectiveEvaluation evaluate(const double* points, double* gradient) {
    look(points);
    ObjectiveEvaluation result = core_.evaluate(positions_.data(), positions_bar_.data());
    if (!result.feasible) return result;
    double* const normal_bar = core_.sampled_rays().normal_bar;
    if (shift_.size() > 0) {
      parallel_for(executor_, "shift nodes adjoint", node_count(),
                   ShiftNodeAdjoint{shift_.data(), normal_bar});
    }
    nodes_.look_adjoint(positions_bar_.data(), normal_bar, gradient);
    parallel_for(executor_, "hold borders", static_cast<std::int64_t>(movable_here_.size()),
                 HoldCoordinate{movable_here_.data(), gradient});
    return result;
  }

  [[nodiscard]] const Eigen::Matrix3Xd& movable() const { return movable_; }

 private:
  static AxisBasis basis_along(int axis, const SurfaceMesh& net, const OpticalSetup& setup,
                               const ObjectiveOptions& options) {
    const int cells = (axis == 0 ? net.grid.columns : net.grid.rows) - 3;
    const std::vector<double> points = even_points(cells, options.samples);
    if (!options.made_by) return plain_basis(cells, points);
    return made_basis({axis, cells, setup.lens_size[axis]}, points, *options.made_by);
  }

  using Buffer = typename Exec::template Buffer<double>;

  [[nodiscard]] std::int64_t node_count() const {
    return std::int64_t{nodes_.shape().columns} * nodes_.shape().rows;
  }

  void look(const double* points) {
    nodes_.look(points, positions_.data(), core_.sampled_rays().normals);
    if (shift_.size() == 0) return;
    parallel_for(executor_, "shift nodes", node_count(),
                 ShiftNode{shift_.data(), positions_.data(), core_.sampled_rays().normals});
  }

  [[nodiscard]] bool is_measured_at(const double* points) const {
    return !measured_at_.empty() && std::equal(measured_at_.begin(), measured_at_.end(), points);
  }

  /// From the nodes to what is made above them. A spline's stage works on the processor, whatever
  /// the device.
  void measure_shift(const double* points) {
    measured_at_.clear();
    shift_ = {};
    look(points);
    const ControlNet net{grid_, Eigen::Map<const Eigen::Matrix3Xd>(
                                    points, 3, Eigen::Index{grid_.columns} * grid_.rows)};
    const MadeSurface made(net, *made_by_, executor_);
    shift_ = Buffer(positions_.size());
    const auto measure = [&](std::int64_t i) {
      const auto p = column3(positions_.data(), i);
      const auto n = column3(core_.sampled_rays().normals, i);
      const SurfacePoint point = made.at(p.template head<2>());
      column3(shift_.data(), i) = Eigen::Vector3d(point.slope.x() + n.x() / n.z(),
                                                  point.slope.y() + n.y() / n.z(), point.z - p.z());
    };
    parallel_for(executor_, "measure shift", node_count(), measure);
    measured_at_.assign(points, points + net.points.size());
  }

  Exec executor_;
  SplineNodesOn<Exec> nodes_;
  DesignObjectiveOn<Exec> core_;
  Eigen::Matrix3Xd movable_;
  Buffer movable_here_;
  Buffer positions_;
  Buffer positions_bar_;
  std::optional<MadeBy> made_by_;
  GridShape grid_;
  Buffer shift_;  ///< Empty where nothing is shifted.
  std::vector<double>
      measured_at_;  ///< Control points of the shift; a round begins where one ended.
};

}  // namespace lensforge
