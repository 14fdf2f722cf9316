// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/surface/control_net.h"
#include "core/surface/surface_mesh.h"
#include "design/energy/ball_term.h"
#include "design/energy/objective_on.h"
#include "design/optics/spline_nodes.h"

namespace lensforge {

/// DesignObjective of a spline's control points: every node of the spline sends one ray by the
/// spline's own normal; with ObjectiveOptions::made_by, those are the nodes of what becomes of it,
/// and control points move in z alone. Barriers and the goal are those of the mesh of the nodes;
/// there are no smoothness terms. Same interface as DesignObjectiveOn.
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
        movable_(movable_of(net, setup, options)),
        movable_here_(buffer_of(executor, objective_detail::entries(movable_))),
        positions_(3 * static_cast<std::size_t>(nodes_.shape().columns) *
                   static_cast<std::size_t>(nodes_.shape().rows)),
        positions_bar_(positions_.size()),
        ball_(ball_of(net, setup, options)),
        barrier_weight_(options.weights.barrier) {}

  void relinearize(const double* points) {
    look(points);
    core_.relinearize(positions_.data());
  }

  ObjectiveEvaluation evaluate(const double* points, double* gradient) {
    look(points);
    ObjectiveEvaluation result = core_.evaluate(positions_.data(), positions_bar_.data());
    if (!result.feasible) return result;
    nodes_.look_adjoint(positions_bar_.data(), core_.sampled_rays().normal_bar, gradient);
    if (ball_) keep_valleys_wide(points, gradient, result.energy);
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

  /// Polish is an average in millimetres: knots stay where they are even.
  static Eigen::Matrix3Xd movable_of(const SurfaceMesh& net, const OpticalSetup& setup,
                                     const ObjectiveOptions& options) {
    Eigen::Matrix3Xd movable = objective_detail::movable_coordinates(net.vertices, setup.lens_size);
    if (options.made_by) movable.topRows<2>().setZero();
    return movable;
  }

  using Buffer = typename Exec::template Buffer<double>;

  /// Factor of E_ball within E_barr. With 2e6 and more, at the default λ5, a 96² logo, whose bright
  /// and black parts meet in creases, is sharpened less than a 128² portrait, which has hardly a
  /// valley that is too sharp.
  static constexpr double kBallShare = 2e6;

  static std::optional<BallNet> ball_of(const SurfaceMesh& net, const OpticalSetup& setup,
                                        const ObjectiveOptions& options) {
    if (!options.made_by) return std::nullopt;
    return BallNet{nullptr,
                   net.grid.columns,
                   net.grid.rows,
                   setup.lens_size.x() / (net.grid.columns - 3),
                   setup.lens_size.y() / (net.grid.rows - 3),
                   options.made_by->sharpest_valley()};
  }

  void keep_valleys_wide(const double* points, double* gradient, EnergyValues& energy) {
    ball_->points = points;
    const double weight = barrier_weight_ * kBallShare;
    const double value = ball_term(executor_, *ball_, weight, gradient);
    energy.total += weight * value;
    energy.barrier += kBallShare * value;
  }

  void look(const double* points) {
    nodes_.look(points, positions_.data(), core_.sampled_rays().normals);
  }

  Exec executor_;
  SplineNodesOn<Exec> nodes_;
  DesignObjectiveOn<Exec> core_;
  Eigen::Matrix3Xd movable_;
  Buffer movable_here_;
  Buffer positions_;
  Buffer positions_bar_;
  std::optional<BallNet> ball_;
  double barrier_weight_;
};

}  // namespace lensforge
