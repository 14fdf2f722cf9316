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
#include "core/lens/surface_field.h"
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
///
/// For a levelling film (kFilmOrder) heights are filtered with film_over_gaussian_terms() before
/// they are averaged.
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

  /// Heights of all samples: those of the lens with margin() samples beyond it, and behind them
  /// those next to the rim.
  [[nodiscard]] Eigen::MatrixXd make_heights() const;
  [[nodiscard]] const Eigen::Vector2i& margin() const { return margin_; }
  /// Fills the samples beyond the rim as continued_surface() does.
  void continue_beyond_rim(Eigen::MatrixXd& heights) const;
  /// Adjoint of continue_beyond_rim(); leaves the derivatives by the samples beyond the rim
  /// unchanged.
  void continue_beyond_rim_adjoint(Eigen::MatrixXd& heights_bar) const;

  /// What is averaged, from heights with those beyond the rim: sample (i, j) of the lens is at (i +
  /// kReach, j + kReach). @throw Interrupted.
  [[nodiscard]] Eigen::MatrixXd filtered(const Eigen::MatrixXd& heights,
                                         const Executor& executor) const;
  /// Adjoint of filtered(). @throw Interrupted.
  [[nodiscard]] Eigen::MatrixXd filtered_adjoint(const Eigen::MatrixXd& filtered_bar,
                                                 const Executor& executor) const;

  /// Index in filtered() of the first sample in the average at `at`, along an axis.
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
  /// Weights of the sample on the rim and of those next to it in those 1 … margin beyond it.
  using RimWeights = std::vector<Eigen::Vector4d>;
  /// Weights, along x and along y, of a sample and of those 1, 2, … to either side.
  using FilterTerm = std::array<std::vector<double>, 2>;

  [[nodiscard]] RimWeights rim_weights(int axis) const;
  [[nodiscard]] std::vector<Line> make_lines(int axis) const;
  /// Numbers of samples on the even grid.
  [[nodiscard]] Eigen::Vector2i samples() const { return cells_.array() + 1 + 2 * margin_.array(); }
  void lay_filter(double sigma);
  [[nodiscard]] Eigen::MatrixXd convolved(const Eigen::MatrixXd& samples,
                                          const Executor& executor) const;

  Eigen::Vector2i cells_;
  Eigen::Vector2d step_;  ///< mm
  std::array<std::vector<Line>, 2> lines_;
  Eigen::Vector2i margin_{GaussianWeights::kReach, GaussianWeights::kReach};
  std::vector<FilterTerm> filter_;  ///< Empty if heights are averaged as they are.
};

/// The surface of a spline after cutting and polishing: the average of the spline with a Gaussian,
/// or the same levelled like a film, of which the polish's floor keeps a share of the spline
/// itself, minus the depth polished off at the rim.
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
/// (MadeSurface.IsTheAverageOfTheSpline); for a film the transfer of a wave is right to 1e-4
/// (MadeSurface.AWaveFadesAsTheTransferFunctionSays). The floor's share does not have the rows'
/// f″ p²/24.
class MadeSurface {
 public:
  /// @pre made.polish_sigma ≥ AveragingGrid::least_sigma(the lens's size). @throw Interrupted.
  MadeSurface(const ControlNet& net, const MadeBy& made, const Executor& executor);

  /// @pre xy is on the lens.
  [[nodiscard]] SurfacePoint at(const Eigen::Vector2d& xy) const;

 private:
  void sample_row(const ControlNet& net, const AveragingGrid::Line& row);

  double floor_;
  ControlNet net_;  ///< Empty without a floor.
  AveragingGrid grid_;
  Eigen::MatrixXd heights_;  ///< AveragingGrid::make_heights(), then filtered()
};

/// The made surface, to be sampled.
class MadeField final : public SurfaceField {
 public:
  /// @pre, @throw as MadeSurface.
  MadeField(const ControlNet& net, const MadeBy& made, const Executor& executor)
      : surface_(net, made, executor) {}

  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override;

 private:
  MadeSurface surface_;
};

/// The made surface above the nodes of its spline, spline_nodes().
SampledSurface made_nodes(const ControlNet& net, const MadeBy& made, int samples,
                          const Executor& executor);

/// Nodes of a spline, moved in z to its made surface (MadeSurface), and the adjoint. Same interface
/// as SplineNodesOn, on the CPU.
///
/// Notation: x place of a sample on the averaging grid, f(x) the spline's height there, w the
/// Gaussian's weights, F the film's filter; p a node in the plane, m = Σ w(p − x) (F f)(x) the made
/// height above it; a bar is ∂E/∂. A change of the control points c changes a sample by δf = Σ B
/// (δc_z − f′·δc_xy), and moves the node: δm = Σ w F δf + m′·δp. With a floor φ the node's height
/// is φ f + (1 − φ) m and its slope φ f′ + (1 − φ) m′, f and f′ those of the spline's own node.
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
  /// Place of a node, derivatives there of all of its height but the floor's share, and the
  /// spline's normal.
  struct Node {
    Eigen::Vector2d place;
    Eigen::Vector2d slope;
    Eigen::Matrix2d bend;
    Eigen::Vector3d normal;
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
  double floor_;
  AveragingGrid grid_;
  ControlNet net_;  ///< Control points of the last look().
  SplineNodesOn<Executor> plan_;
  Eigen::MatrixXd heights_;
  Eigen::MatrixXd filtered_;  ///< Heights as they are averaged.
  Eigen::MatrixXd heights_bar_;
  std::vector<Sample> samples_;
  std::vector<Node> nodes_;
  std::vector<double> plan_bar_;    ///< 3 × nodes
  std::vector<double> normal_bar_;  ///< 3 × nodes, of the spline's normals: zeros without a floor.
  bool known_ = false;              ///< True if samples_ are from a look().
};

/// Heights above the nodes of a spline as sums of products of functions along u and v (all of
/// made_bases() but the first), and the adjoint. Rows of three numbers per node: ∂z/∂u, ∂z/∂v per
/// knot cell, and z.
class HeightTerms {
 public:
  /// @param u, v  one basis for every term, of made_bases().
  HeightTerms(const std::vector<AxisBasis>& u, const std::vector<AxisBasis>& v,
              const Executor& executor);

  [[nodiscard]] bool empty() const { return terms_.empty(); }
  /// Adds the terms' heights for these control points.
  void add(const double* points, double* heights);
  /// Adjoint of add(); adds to the control points' z.
  void add_adjoint(const double* heights_bar, double* points_bar);

 private:
  struct Term {
    AxisTapsOn<Executor> u;
    AxisTapsOn<Executor> v;
  };

  Executor executor_;
  std::vector<Term> terms_;
  std::vector<double> along_;  ///< Per node column and row of control points: z and ∂z/∂u.
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
        cell_(size.x() / (net.columns - 3), size.y() / (net.rows - 3)),
        nodes_(bases_along({0, net.columns - 3, size.x()}, samples, made).front(),
               bases_along({1, net.rows - 3, size.y()}, samples, made).front(), executor),
        terms_(bases_along({0, net.columns - 3, size.x()}, samples, made),
               bases_along({1, net.rows - 3, size.y()}, samples, made), executor) {}

  [[nodiscard]] GridShape shape() const { return nodes_.shape(); }

  /// Computes the difference at these control points. @throw Interrupted.
  void measure(const double* points) {
    if (!shift_.empty() && std::equal(points, points + net_.points.size(), net_.points.data())) {
      return;  // A round begins where one ended.
    }
    std::copy_n(points, net_.points.size(), net_.points.data());
    std::vector<double> positions(3 * count());
    std::vector<double> normals(positions.size());
    shift_.clear();
    look(points, positions.data(), normals.data());
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
    if (!terms_.empty()) add_up(points);
    if (added().empty()) return;
    parallel_for(executor_, "shift nodes", static_cast<std::int64_t>(count()), [&](std::int64_t i) {
      const auto add = column3(added().data(), i);
      auto n = column3(normals, i);
      n.head<2>() -= n.z() * add.head<2>();
      column3(positions, i).z() += add.z();
      if (!terms_.empty()) upright_[static_cast<std::size_t>(i)] = n.z();
    });
  }

  /// Adjoint of look() at the control points of its last call.
  /// @param normal_bar  is modified.
  void look_adjoint(const double* position_bar, double* normal_bar, double* points_bar) {
    if (!added().empty()) {
      parallel_for(executor_, "shift nodes adjoint", static_cast<std::int64_t>(count()),
                   [&](std::int64_t i) {
                     auto n = column3(normal_bar, i);
                     if (!terms_.empty()) {
                       const double upright = upright_[static_cast<std::size_t>(i)];
                       column3(added_bar_.data(), i) << -upright * n.x() / cell_.x(),
                           -upright * n.y() / cell_.y(), column3(position_bar, i).z();
                     }
                     n.z() -= column3(added().data(), i).head<2>().dot(n.head<2>());
                   });
    }
    nodes_.look_adjoint(position_bar, normal_bar, points_bar);
    if (!terms_.empty()) terms_.add_adjoint(added_bar_.data(), points_bar);
  }

 private:
  static std::vector<AxisBasis> bases_along(const AxisLength& along, int samples,
                                            const MadeBy& made) {
    return made_bases(along, even_points(along.cells, samples), made);
  }
  /// What the nodes' slopes and heights lack.
  [[nodiscard]] const std::vector<double>& added() const {
    return terms_.empty() ? shift_ : added_;
  }
  /// The other terms, with slopes as of an even spline, and the shift.
  void add_up(const double* points) {
    added_.assign(3 * count(), 0.0);
    added_bar_.resize(added_.size());
    upright_.resize(count());
    terms_.add(points, added_.data());
    for (std::size_t i = 0; i < count(); ++i) {
      column3(added_.data(), static_cast<std::int64_t>(i)).head<2>().array() /= cell_.array();
    }
    for (std::size_t i = 0; i < shift_.size(); ++i) added_[i] += shift_[i];
  }
  [[nodiscard]] std::size_t count() const {
    return static_cast<std::size_t>(shape().columns) * static_cast<std::size_t>(shape().rows);
  }

  Executor executor_;
  ControlNet net_;  ///< Control points of the last measure().
  MadeBy made_;
  Eigen::Vector2d cell_;  ///< Of an even spline's knots, mm.
  SplineNodesOn<Executor> nodes_;
  HeightTerms terms_;
  std::vector<double> shift_;  ///< 3 × nodes: ∂z/∂x, ∂z/∂y and z; empty before measure().
  std::vector<double> added_;  ///< The same with the terms'; empty without terms.
  std::vector<double> added_bar_;
  std::vector<double> upright_;  ///< z of the nodes' normals.
};

}  // namespace lensforge
