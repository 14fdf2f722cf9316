// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/compute/executor.h"
#include "core/spline/control_net.h"
#include "design/optics/averaging_grid.h"
#include "design/optics/made_by.h"
#include "design/optics/spline_nodes.h"

namespace lensforge {

/// Nodes of a spline, moved in z to what is made of it there (MadeSurface), and the adjoint. As
/// SplineNodesOn has it, for the processor.
///
/// Notation: x place of a sample on the averaging grid, f(x) the spline's height there, w the
/// Gaussian's weights; p a node in the plane, m = Σ w(p − x) f(x) the made height above it; a bar
/// is ∂E/∂. A change of the control points c changes a sample by δf = Σ B (δc_z − f′·δc_xy), and
/// moves the node: δm = Σ w δf + m′·δp.
class MadeNodes {
 public:
  /// @param net  control points of the spline; its lens has this size.
  MadeNodes(const GridShape& net, const Eigen::Vector2d& size, int samples, const MadeBy& made,
            const Executor& executor);

  [[nodiscard]] GridShape shape() const { return plan_.shape(); }

  /// Forgets what look() has found before, so that its results depend on its arguments alone.
  void forget() { known_ = false; }

  /// Points and normals (of any length) of all nodes. Searches the grid's samples from where the
  /// last call has found them. @throw Interrupted.
  void look(const double* points, double* positions, double* normals);

  /// Adjoint of look() at the control points that were looked at last. @throw Interrupted.
  void look_adjoint(const double* position_bar, const double* normal_bar, double* points_bar);

 private:
  /// Where a sample lies on the spline, and the slope there.
  struct Sample {
    Eigen::Vector2d uv;
    Eigen::Vector2d slope;
  };
  /// Place of a node and derivatives of the made height there.
  struct Node {
    Eigen::Vector2d place;
    Eigen::Vector2d slope;
    Eigen::Matrix2d bend;
  };

  void sample_row(int row);
  [[nodiscard]] Eigen::Vector2d search(const Eigen::Vector2d& xy, Eigen::Vector2d uv,
                                       SplineFrame& frame) const;
  void average(std::int64_t node, double* positions, double* normals);
  void spread_nodes(const double* position_bar, const double* normal_bar);
  void spread_samples(double* points_bar);
  [[nodiscard]] Sample& sample(int i, int row) {
    return samples_[static_cast<std::size_t>(row) *
                        static_cast<std::size_t>(grid_.cells().x() + 1) +
                    static_cast<std::size_t>(i)];
  }

  Executor executor_;
  AveragingGrid grid_;
  ControlNet net_;  ///< That was looked at last.
  SplineNodesOn<Executor> plan_;
  Eigen::MatrixXd heights_;
  Eigen::MatrixXd heights_bar_;
  std::vector<Sample> samples_;
  std::vector<Node> nodes_;
  std::vector<double> plan_bar_;  ///< 3 × nodes
  std::vector<double> no_bar_;    ///< 3 × nodes, zeros: normals do not count in the plane.
  bool known_ = false;            ///< Are samples_ those of a look()?
};

}  // namespace lensforge
