// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/surface/control_net.h"
#include "core/surface/surface_mesh.h"
#include "design/energy/objective_on.h"
#include "design/optics/spline_nodes.h"

namespace lensforge {

/// DesignObjective of a spline's control points: every node of the spline sends one ray by the
/// spline's own normal. Barriers and the goal are those of the mesh of the nodes; there are no
/// smoothness terms. Same interface as DesignObjectiveOn.
template <class Exec>
class SplineObjectiveOn {
 public:
  /// @param net  a ControlNet as a mesh.
  SplineObjectiveOn(const SurfaceMesh& net, const OpticalSetup& setup, const DesignGoal& goal,
                    const ObjectiveOptions& options, const Exec& executor)
      : executor_(executor),
        nodes_(net.grid, options.samples, executor),
        core_(spline_nodes({net.grid, net.vertices}, options.samples).mesh, setup, goal, options,
              executor),
        movable_(objective_detail::movable_coordinates(net.vertices, setup.lens_size)),
        movable_here_(buffer_of(executor, objective_detail::entries(movable_))),
        positions_(3 * static_cast<std::size_t>(nodes_.shape().columns) *
                   static_cast<std::size_t>(nodes_.shape().rows)),
        positions_bar_(positions_.size()) {}

  void relinearize(const double* points) {
    look(points);
    core_.relinearize(positions_.data());
  }

  ObjectiveEvaluation evaluate(const double* points, double* gradient) {
    look(points);
    const ObjectiveEvaluation result = core_.evaluate(positions_.data(), positions_bar_.data());
    if (!result.feasible) return result;
    nodes_.look_adjoint(positions_bar_.data(), core_.sampled_rays().normal_bar, gradient);
    parallel_for(executor_, "hold borders", static_cast<std::int64_t>(movable_here_.size()),
                 HoldCoordinate{movable_here_.data(), gradient});
    return result;
  }

  [[nodiscard]] const Eigen::Matrix3Xd& movable() const { return movable_; }

 private:
  using Buffer = typename Exec::template Buffer<double>;

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
};

}  // namespace lensforge
