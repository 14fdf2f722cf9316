// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/SparseCore>
#include <array>
#include <cstdint>
#include <vector>

#include "core/compute/executor.h"
#include "core/lens/smooth_surface.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// Map from points of the flat grid to the moved grid, seen from above. Design concentrates
/// vertices where the picture needs them, down to a thirtieth of the mean cell. The identity for a
/// mesh that is no grid, or whose border vertices have left the border.
class GridWarp {
 public:
  /// @param box  the mesh's rectangle, mm. Keeps a reference to the mesh.
  GridWarp(const SurfaceMesh& mesh, const Eigen::AlignedBox2d& box);

  /// @pre uv lies in the box.
  [[nodiscard]] Eigen::Vector2d at(const Eigen::Vector2d& uv) const;
  /// Approximate inverse of at() at the vertex.
  [[nodiscard]] Eigen::Vector2d before(Eigen::Index vertex) const;

  /// x and y of the control points of a spline with these knot cells: `share` of the way from the
  /// even grid to the moved vertices, sampled at the Greville points (Schoenberg's operator, which
  /// folds nothing that is monotonic along its lines).
  [[nodiscard]] std::array<Eigen::MatrixXd, 2> control_points(int cells_u, int cells_v,
                                                              double share) const;

 private:
  [[nodiscard]] bool borders_hold() const;
  [[nodiscard]] Eigen::Vector2d displacement(double column, int row) const;
  [[nodiscard]] Eigen::Vector2d rest(Eigen::Index vertex) const;

  const SurfaceMesh& mesh_;
  Eigen::AlignedBox2d box_;
  bool moves_ = false;
};

// A tensor product of cubic splines, sampled on a tensor grid, as the fit needs it.

/// Coefficients of x and y, mm; row index runs along u.
using SplinePlan = std::array<Eigen::MatrixXd, 2>;

/// One direction: its splines at its samples.
struct AxisSamples {
  using Basis = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  /// @param at  the samples, in cells. @param length  of the whole axis, mm.
  AxisSamples(const std::vector<double>& at, int knot_cells, double length);

  int cells = 0;
  Basis values;  ///< One row per sample.
  Basis slopes;  ///< The same, 1/mm.
};

/// Basis of coefficient vectors in which a direction's sums of squares of values and of slopes are
/// both diagonal.
struct AxisModes {
  explicit AxisModes(const AxisSamples& axis);

  Eigen::MatrixXd modes;      ///< Columns; squares of values sum to 1.
  Eigen::VectorXd stiffness;  ///< Sum of squares of slopes per mode, 1/mm².
};

/// Points and their derivatives by the parameters along a line of samples, 2 × samples.
struct PlanLine {
  Eigen::Matrix2Xd xy, by_u, by_v;

  [[nodiscard]] Eigen::Matrix2d derivative(Eigen::Index j) const;
};

/// Height and its derivatives by the parameters along a line of samples.
struct HeightLine {
  Eigen::VectorXd z, by_u, by_v;
};

/// Samples along both directions.
struct SplineGrid {
  AxisSamples u;
  AxisSamples v;

  /// The line at sample number `i` along u.
  [[nodiscard]] PlanLine plan_line(const SplinePlan& plan, std::int64_t i) const;
  [[nodiscard]] HeightLine height_line(const Eigen::MatrixXd& heights, std::int64_t i) const;

  /// Σ over all samples of (a·∂/∂u + b·∂/∂v + c) of every basis function, where `weigh(i)` returns
  /// a, b and c (columns) along line i. Several threads call it at the same time.
  template <class Weigh>
  [[nodiscard]] Eigen::MatrixXd moments(const Executor& executor, const Weigh& weigh) const {
    Eigen::MatrixXd by_slope(v.values.cols(), u.values.rows());
    Eigen::MatrixXd by_value(v.values.cols(), u.values.rows());
    parallel_for(
        executor, "spline moments", u.values.rows(),
        [&](std::int64_t i) {
          const Eigen::MatrixX3d wanted = weigh(i);
          by_slope.col(i) = v.values.transpose() * wanted.col(0);
          by_value.col(i) =
              v.slopes.transpose() * wanted.col(1) + v.values.transpose() * wanted.col(2);
        },
        1);
    return u.slopes.transpose() * by_slope.transpose() +
           u.values.transpose() * by_value.transpose();
  }
};

/// Side of a square with the mean area of two of the surface's triangles, mm.
double mesh_cell(const SmoothSurface& surface);

/// The vertex-normal model's height and slopes, at the nearest point of the surface's box.
SurfacePoint model_near(const SmoothSurface& surface, const Eigen::Vector2d& xy);

/// Least-squares heights of one spline over a surface's whole rectangle, all parameters weighted
/// equally.
class SlopeFit {
 public:
  /// Keeps references. @param cells  knot cells along u and v, ≥ 1.
  /// @param most_share  maximum share of the vertices' movement that the knot lines follow, 0 … 1;
  ///        less where they would fold.
  SlopeFit(const SmoothSurface& surface, const GridWarp& warp, const std::array<int, 2>& cells,
           double most_share, const Executor& executor, const RunControl& control);

  /// Coefficients of z, mm, with the surface's volume. @throw Interrupted.
  [[nodiscard]] Eigen::MatrixXd solve() const;

  /// The coefficients that have these moments: the last step of solve().
  [[nodiscard]] Eigen::MatrixXd heights_of(const Eigen::MatrixXd& moments) const;

  /// A change of heights less the constant that would change the volume.
  [[nodiscard]] Eigen::MatrixXd without_volume(const Eigen::MatrixXd& change) const;

  [[nodiscard]] const SmoothSurface& surface() const { return surface_; }
  [[nodiscard]] const SplinePlan& plan() const { return plan_; }
  [[nodiscard]] const SplineGrid& grid() const { return grid_; }
  /// Weight of a squared height against a squared slope, 1/mm².
  [[nodiscard]] double height_weight() const { return height_weight_; }

 private:
  [[nodiscard]] SplinePlan make_plan(const GridWarp& warp, double most_share) const;
  [[nodiscard]] double least_area(const SplinePlan& plan) const;
  [[nodiscard]] Eigen::MatrixXd area_moments() const;

  const SmoothSurface& surface_;
  const Executor& executor_;
  const RunControl& control_;
  SplineGrid grid_;
  std::array<AxisModes, 2> modes_;
  SplinePlan plan_;
  Eigen::MatrixXd areas_;
  double height_weight_;
};

}  // namespace lensforge
