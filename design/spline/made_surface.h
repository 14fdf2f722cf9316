// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/compute/executor.h"
#include "core/lens/optical_surface.h"
#include "core/mesh/surface_mesh.h"
#include "core/spline/control_net.h"
#include "design/flux/columns.h"
#include "design/spline/made_by.h"
#include "design/spline/spline_nodes.h"

namespace lensforge {

/// Weights of heights on an even grid in a Gaussian average (unit integral) around a place, along
/// one axis: z ≈ Σ value z_k, ∂z ≈ Σ slope z_k, ∂²z ≈ Σ bend z_k. Exact for constants and straight
/// lines.
struct GaussianWeights {
  /// Samples on each side of an average: 5.25 σ.
  static constexpr int kReach = 7;
  static constexpr std::size_t kCount = 2 * kReach + 2;

  std::array<double, kCount> value{};
  std::array<double, kCount> slope{};  ///< 1/mm
  std::array<double, kCount> bend{};   ///< 1/mm²

  /// @param offset  of the first sample from the place, mm.
  GaussianWeights(double offset, double step, double sigma);
};

/// The even grid of heights over a lens whose averages make up a made surface. It includes the
/// samples beyond the rim that averages at the rim need, and samples next to the rim that give the
/// surface's own slopes and curvatures there: averages leave those out.
///
/// Samples are at most 3/4 σ apart: the relative error of a wave of wave number k in a Gaussian sum
/// is then exp(−(2π/0.75 − kσ)²/2).
class AveragingGrid {
 public:
  AveragingGrid(const Eigen::Vector2d& lens_size, const MadeBy& made);

  /// Grid cells over the lens.
  [[nodiscard]] const Eigen::Vector2i& cells() const { return cells_; }
  [[nodiscard]] const Eigen::Vector2d& size() const { return size_; }
  /// Places of samples on the lens along an axis, and their indices in make_heights().
  struct Line {
    double place = 0.0;  ///< mm
    Eigen::Index index = 0;
  };
  /// From rim to rim, with those next to both rims.
  [[nodiscard]] const std::vector<Line>& lines(int axis) const {
    return lines_[static_cast<std::size_t>(axis)];
  }

  /// Heights of all samples.
  [[nodiscard]] Eigen::MatrixXd make_heights() const;
  /// Fills the samples beyond the rim as continued_surface() does.
  void continue_beyond_rim(Eigen::MatrixXd& heights) const;
  /// Adjoint of continue_beyond_rim(); leaves the derivatives by the samples beyond the rim
  /// unchanged.
  void continue_beyond_rim_adjoint(Eigen::MatrixXd& heights_bar) const;

  /// Index in make_heights() of the first sample in the average at `at`, along an axis.
  [[nodiscard]] int first_sample(double at, int axis) const;
  [[nodiscard]] GaussianWeights weights(double at, int axis) const;

  /// Additional depth polished off near the rim, and its derivatives.
  struct RimLoss {
    double z = 0.0;
    Eigen::Vector2d slope{0.0, 0.0};
    Eigen::Vector2d bend{0.0, 0.0};  ///< ∂²/∂x², ∂²/∂y²; ∂²/∂x∂y is 0.
  };
  [[nodiscard]] RimLoss rim_loss(const Eigen::Vector2d& xy) const;

  /// Minimum σ of the polish, mm: below it the grid takes more than 0.8 GB.
  static double least_sigma(const Eigen::Vector2d& lens_size);

 private:
  Eigen::Vector2d size_;   ///< mm
  Eigen::Vector2d sigma_;  ///< mm
  double rim_depth_;
  double rim_length_;
  /// Weights of the sample on the rim and of those next to it in those 1 … kReach beyond it.
  using RimWeights = std::array<Eigen::Vector4d, GaussianWeights::kReach>;

  [[nodiscard]] RimWeights rim_weights(int axis) const;
  [[nodiscard]] std::vector<Line> make_lines(int axis) const;

  Eigen::Vector2i cells_;
  Eigen::Vector2d step_;  ///< mm
  std::array<std::vector<Line>, 2> lines_;
};

/// The surface of a spline after cutting and polishing: the average of the spline with a Gaussian,
/// minus the depth polished off at the rim.
///
/// Along the rows the Gaussian's variance is the polish's σ²; across them p²/12 is added. A ball of
/// radius R with its axis at y touches f at y + R f′, so contacts are p (1 + R f″) apart. At
/// distance d from a contact it leaves (1/R − f″) d²/2 above f, on average (1/R − f″) (1 + R f″)²
/// p²/24 = p²/24R + f″ p²/24 + …; the first part is the same everywhere. This neglects waves of the
/// pitch, of which polishing leaves exp(−2π²σ²/p²), and valleys sharper than the ball. A mould is
/// the same with f turned over. Beyond the rim the surface goes on as it is cut there
/// (continued_surface()).
///
/// Averages are sums over an AveragingGrid. Their error is below 1e-5 of the height for waves at
/// least 2σ long; for a spline with bumps of 1 µm it is 5e-8 mm and 1e-6 rad
/// (MadeSurface.IsTheAverageOfTheSpline).
class MadeSurface {
 public:
  /// @pre made.polish_sigma ≥ AveragingGrid::least_sigma(the lens's size). @throw Interrupted.
  MadeSurface(const ControlNet& net, const MadeBy& made, const Executor& executor);

  /// @pre xy is on the lens.
  [[nodiscard]] SurfacePoint at(const Eigen::Vector2d& xy) const;

 private:
  void sample_row(const ControlNet& net, const AveragingGrid::Line& row);

  AveragingGrid grid_;
  Eigen::MatrixXd heights_;  ///< AveragingGrid::make_heights()
};

/// The made surface above the nodes of its spline, spline_nodes().
SampledSurface made_nodes(const ControlNet& net, const MadeBy& made, int samples,
                          const Executor& executor);

/// Nodes of a spline, moved in z to its made surface (MadeSurface), and the adjoint. Same interface
/// as SplineNodesOn, on the CPU.
///
/// Notation: x place of a sample on the averaging grid, f(x) the spline's height there, w the
/// Gaussian's weights; p a node in the plane, m = Σ w(p − x) f(x) the made height above it; a bar
/// is ∂E/∂. A change of the control points c changes a sample by δf = Σ B (δc_z − f′·δc_xy), and
/// moves the node: δm = Σ w δf + m′·δp.
class MadeNodes {
 public:
  /// @param net  control points of the spline. @param size  of its lens, mm.
  MadeNodes(const GridShape& net, const Eigen::Vector2d& size, int samples, const MadeBy& made,
            const Executor& executor);

  [[nodiscard]] GridShape shape() const { return plan_.shape(); }

  /// Forgets the last look(), so the next one depends on its arguments alone.
  void forget() { known_ = false; }

  /// Computes points and normals (of any length) of all nodes. The search for the grid's samples
  /// starts from the last call's. @throw Interrupted.
  void look(const double* points, double* positions, double* normals);

  /// Adjoint of look() at the control points of its last call. @throw Interrupted.
  void look_adjoint(const double* position_bar, const double* normal_bar, double* points_bar);

 private:
  /// Parameters of a sample on the spline, and the slope there.
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

  void sample_row(std::size_t row);
  [[nodiscard]] Eigen::Vector2d search(const Eigen::Vector2d& xy, Eigen::Vector2d uv,
                                       SplineFrame& frame) const;
  void average(std::int64_t node, double* positions, double* normals);
  void spread_nodes(const double* position_bar, const double* normal_bar);
  void spread_samples(double* points_bar);
  /// @param i, row  of AveragingGrid::lines().
  [[nodiscard]] Sample& sample(std::size_t i, std::size_t row) {
    return samples_[row * grid_.lines(0).size() + i];
  }

  Executor executor_;
  AveragingGrid grid_;
  ControlNet net_;  ///< Control points of the last look().
  SplineNodesOn<Executor> plan_;
  Eigen::MatrixXd heights_;
  Eigen::MatrixXd heights_bar_;
  std::vector<Sample> samples_;
  std::vector<Node> nodes_;
  std::vector<double> plan_bar_;  ///< 3 × nodes
  std::vector<double> no_bar_;    ///< 3 × nodes, zeros: normals have no effect in the plane.
  bool known_ = false;            ///< True if samples_ are from a look().
};

/// Like MadeNodes, for knot cells much wider than the polish's σ, where the grid of MadeNodes would
/// have many samples per knot cell. Nodes and adjoint use made_basis(), which is exact for even
/// knots; measure() computes the remaining difference to MadeSurface, which stays constant until
/// its next call. The difference hardly depends on the control points.
class ShiftedNodes {
 public:
  /// @param net  control points of the spline. @param size  of its lens, mm.
  ShiftedNodes(const GridShape& net, const Eigen::Vector2d& size, int samples, const MadeBy& made,
               const Executor& executor)
      : executor_(executor),
        net_{net, Eigen::Matrix3Xd(3, Eigen::Index{net.columns} * net.rows)},
        made_(made),
        nodes_(basis_along({0, net.columns - 3, size.x()}, samples, made),
               basis_along({1, net.rows - 3, size.y()}, samples, made), executor) {}

  [[nodiscard]] GridShape shape() const { return nodes_.shape(); }

  /// Computes the difference at these control points. @throw Interrupted.
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

  /// Computes points and normals (of any length) of all nodes.
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

  /// Adjoint of look() at the control points of its last call.
  /// @param normal_bar  is modified.
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
  ControlNet net_;  ///< Control points of the last measure().
  MadeBy made_;
  SplineNodesOn<Executor> nodes_;
  std::vector<double> shift_;  ///< 3 × nodes: ∂z/∂x, ∂z/∂y and z; empty before measure().
};

}  // namespace lensforge
