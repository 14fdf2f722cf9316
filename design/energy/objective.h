// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "design/energy/objective_on.h"
#include "design/energy/objective_options.h"

namespace lensforge {

/// The function that both halves of the alternation minimise, of the vertex positions alone: Sun et
/// al., Eq. 18 for a picture, Eq. 20 for a correspondence. On the CPU; DesignObjectiveOn is the
/// same on any executor.
///
/// The Weingarten maps are eliminated. Ψ_ν is concave in h, so that at a given surface E_edge has a
/// majorant linear in h, Σ Ψ(h⁰) + w (h − h⁰) with w = Ψ'(h⁰), tight at h⁰; with w held, every
/// face's best map is a 3 × 3 least-squares solution, and by the envelope theorem the gradient by
/// the vertices is the partial one. relinearize() moves h⁰ to a new surface; between two calls
/// the objective is one smooth function, never less than the paper's.
///
/// Lengths count in pixels in E_bdr and E_lap (the paper's unit); E_face and E_edge have none.
class DesignObjective {
 public:
  using Evaluation = ObjectiveEvaluation;

  /// @param mesh  gives the connectivity; its vertices are where relinearize() is first called.
  /// @param goal  a picture has setup.pixels and is not all black.
  DesignObjective(const SurfaceMesh& mesh, const OpticalSetup& setup, const DesignGoal& goal,
                  const ObjectiveOptions& options, const Executor& executor)
      : core_(mesh, setup, goal, options, executor) {}

  /// Takes the Welsch weights from this surface.
  void relinearize(const Eigen::Matrix3Xd& vertices) { core_.relinearize(vertices.data()); }

  /// Value and gradient (3 × V, per mm; zero for coordinates that are held: x on the lens's left
  /// and right border, y on the lower and upper one, both where relinearize() found a face on the
  /// outline). Same bits for any number of threads.
  Evaluation evaluate(const Eigen::Matrix3Xd& vertices, Eigen::Matrix3Xd& gradient) {
    gradient.resize(3, vertices.cols());
    return core_.evaluate(vertices.data(), gradient.data());
  }

  /// 1 where a coordinate may move, 0 where it is held; 3 × V.
  [[nodiscard]] const Eigen::Matrix3Xd& movable() const { return core_.movable(); }

 private:
  DesignObjectiveOn<Executor> core_;
};

extern template class DesignObjectiveOn<Executor>;

}  // namespace lensforge
