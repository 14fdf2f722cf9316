// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "core/spline/control_net.h"
#include "design/energy/objective.h"
#include "design/energy/objective_options.h"
#include "design/flux/columns.h"
#include "design/spline/made_surface.h"
#include "design/spline/spline_nodes.h"
#include "design/waves/wave_picture.h"

namespace lensforge {

/// Nodes of a spline, or of the surface that is made of it.
template <class Exec>
using SplinePart = std::variant<SplineNodesOn<Exec>, MadeNodes, ShiftedNodes>;

/// One for the spline itself, or for every part that a design averages over (MadeBy::drawn()).
/// @param size  of the lens, mm. @param samples  nodes per knot cell each way.
template <class Exec>
std::vector<SplinePart<Exec>> spline_parts(const GridShape& net, const Eigen::Vector2d& size,
                                           int samples, const ObjectiveOptions& options,
                                           const Exec& executor) {
  std::vector<SplinePart<Exec>> parts;
  if (!options.made_by) {
    parts.push_back(spline_nodes_on(net, samples, executor));
    return parts;
  }
  const double cell = std::sqrt(size.prod() / ((net.columns - 3.0) * (net.rows - 3.0)));
  for (const MadeBy& made : options.made_by->drawn()) {
    if (cell > kFineKnotCell * made.polish_sigma) {
      parts.push_back(ShiftedNodes(net, size, samples, made, executor));
    } else {
      parts.push_back(MadeNodes(net, size, samples, made, executor));
    }
  }
  return parts;
}

/// Makes a part's next nodes depend on these control points and those of the next look alone.
/// @throw Interrupted.
template <class Exec>
void relinearize_part(const double* points, SplinePart<Exec>& part) {
  if (auto* const made = std::get_if<MadeNodes>(&part)) made->forget();
  if (auto* const made = std::get_if<ShiftedNodes>(&part)) made->measure(points);
}

template <class Exec>
GridShape shape_of(const SplinePart<Exec>& part) {
  return std::visit([](const auto& nodes) { return nodes.shape(); }, part);
}

/// Counts the triangles of a grid of points (grid_triangles()) that are folded, seen from +z.
struct CountFolds {
  const double* points;
  int columns;    ///< Points in a row.
  double lowest;  ///< Area of a triangle that is not folded.

  LF_HD std::array<double, 1> operator()(std::int64_t cell) const {
    const std::int64_t a = cell / (columns - 1) * columns + cell % (columns - 1);
    const std::int64_t d = a + columns;
    return {folded(a, a + 1, d + 1) + folded(a, d + 1, d)};
  }

 private:
  [[nodiscard]] LF_HD double folded(std::int64_t a, std::int64_t b, std::int64_t c) const {
    const Corners t{column3(points, a), column3(points, b), column3(points, c)};
    return plan_area(t) > lowest ? 0.0 : 1.0;
  }
};

/// Tells whether a spline is a surface that a file can hold: none of its nodes' triangles is
/// folded.
template <class Exec>
class SplineFoldsOn {
 public:
  /// @param size  of the lens, mm.
  SplineFoldsOn(const GridShape& net, const Eigen::Vector2d& size, const Exec& executor)
      : executor_(executor),
        nodes_(spline_nodes_on(net, kMeshSamples, executor)),
        shape_(nodes_.shape()),
        cells_(std::int64_t{shape_.columns - 1} * (shape_.rows - 1)),
        lowest_(kLeastShare * 0.5 * size.prod() / static_cast<double>(cells_)),
        positions_(3 * static_cast<std::size_t>(std::int64_t{shape_.columns} * shape_.rows)),
        normals_(positions_.size()) {}

  [[nodiscard]] bool any(const double* points) {
    nodes_.look(points, positions_.data(), normals_.data());
    const CountFolds count{positions_.data(), shape_.columns, lowest_};
    return pending_sum<1>(executor_, "folds", cells_, count).get()[0] > 0.0;
  }

 private:
  /// Of an even grid's triangles: far above the rounding of their areas.
  static constexpr double kLeastShare = 1e-6;

  Exec executor_;
  SplineNodesOn<Exec> nodes_;
  GridShape shape_;
  std::int64_t cells_;
  double lowest_;  ///< mm²
  typename Exec::template Buffer<double> positions_;
  typename Exec::template Buffer<double> normals_;
};

/// DesignObjective as a function of a spline's control points: every node of the spline sends one
/// ray by the spline's own normal. Barriers and goal are those of the mesh of the nodes; there are
/// no smoothness terms. Same interface as DesignObjectiveOn.
///
/// With ObjectiveOptions::made_by the nodes are those of the made surface (MadeNodes, or
/// ShiftedNodes for wide knot cells), and value and gradient are means over MadeBy::drawn(). Their
/// barriers do not see a fold that making smooths away, so the spline itself is checked for folds.
template <class Exec>
class SplineObjectiveOn {
 public:
  /// @param net  a ControlNet as a mesh.
  SplineObjectiveOn(const SurfaceMesh& net, const OpticalSetup& setup, const DesignGoal& goal,
                    const ObjectiveOptions& options, const Exec& executor)
      : executor_(executor),
        core_(spline_nodes({net.grid, net.vertices}, options.samples).mesh, setup, goal, options,
              executor),
        unheld_(objective_detail::movable_coordinates(net.vertices, setup.lens_size)),
        parts_(spline_parts(net.grid, setup.lens_size, options.samples, options, executor)),
        gradient_(static_cast<std::size_t>(net.vertices.size())) {
    positions_ = Buffer(3 * static_cast<std::size_t>(node_count()));
    positions_bar_ = Buffer(positions_.size());
    if (options.made_by) folds_.emplace(net.grid, setup.lens_size, executor);
    if (setup.outline) {
      for (const int coefficients : {net.grid.columns, net.grid.rows}) {
        bases_.push_back(
            plain_basis(coefficients - 3, even_points(coefficients - 3, options.samples)));
      }
    }
    hold(unheld_);
  }

  /// @throw Interrupted.
  void relinearize(const double* points) {
    for (Part& part : parts_) relinearize_part(points, part);
    look(points, parts_.front());
    core_.relinearize(positions_.data());
    if (!bases_.empty()) hold(held_with_nodes());
  }

  ObjectiveEvaluation evaluate(const double* points, double* gradient) {
    if (folds_ && folds_->any(points)) return {};
    ObjectiveEvaluation mean;
    const double share = 1.0 / static_cast<double>(parts_.size());
    const auto entries = static_cast<std::int64_t>(share_.size());
    for (Part& part : parts_) {
      const bool first = &part == &parts_.front();
      const ObjectiveEvaluation result =
          evaluate(points, part, first ? gradient : gradient_.data());
      if (!result.feasible) return {};
      mean.energy.add(result.energy, share);
      mean.mae += share * result.mae;
      if (!first) {
        parallel_for(executor_, "add gradient", entries, AddEntry{gradient_.data(), gradient});
      }
    }
    mean.feasible = true;
    parallel_for(executor_, "hold borders and take the mean", entries,
                 HoldCoordinate{share_.data(), gradient});
    return mean;
  }

  [[nodiscard]] const Eigen::Matrix3Xd& movable() const { return movable_; }

 private:
  using Buffer = typename Exec::template Buffer<double>;

  using Part = SplinePart<Exec>;

  /// Sets the coordinates that may move.
  void hold(Eigen::Matrix3Xd movable) {
    movable_ = std::move(movable);
    const Eigen::Matrix3Xd share = movable_ / static_cast<double>(parts_.size());
    share_ = buffer_of(executor_, objective_detail::entries(share));
  }

  /// Coordinates that may move: control points that move a node on the outline's rim keep x and y.
  [[nodiscard]] Eigen::Matrix3Xd held_with_nodes() const {
    const AxisBasis& u = bases_[0];
    const AxisBasis& v = bases_[1];
    Eigen::Matrix3Xd movable = unheld_;
    const auto hold_point = [&](int node_u, int node_v, int j, int k) {
      const int i = u.first[static_cast<std::size_t>(node_u)] + j;
      const int row = v.first[static_cast<std::size_t>(node_v)] + k;
      const auto tap = [](const AxisBasis& basis, int node, int n) {
        const int at = basis.taps * node + n;
        return basis.plan_value[static_cast<std::size_t>(at)];
      };
      if (tap(u, node_u, j) * tap(v, node_v, k) == 0.0) return;
      movable.col(Eigen::Index{row} * u.coefficients + i).template head<2>().setZero();
    };
    for (Eigen::Index node = 0; node < core_.movable().cols(); ++node) {
      if (core_.movable().col(node).template head<2>().any()) continue;
      const int node_u = static_cast<int>(node % u.nodes());
      const int node_v = static_cast<int>(node / u.nodes());
      for (int n = 0; n < u.taps * v.taps; ++n) hold_point(node_u, node_v, n % u.taps, n / u.taps);
    }
    return movable;
  }

  [[nodiscard]] std::int64_t node_count() const {
    const GridShape shape = shape_of(parts_.front());
    return std::int64_t{shape.columns} * shape.rows;
  }

  /// Value and gradient of one part, without holding borders.
  ObjectiveEvaluation evaluate(const double* points, Part& part, double* gradient) {
    look(points, part);
    ObjectiveEvaluation result = core_.evaluate(positions_.data(), positions_bar_.data());
    if (!result.feasible) return result;
    const auto pull_back = [&](auto& nodes) {
      nodes.look_adjoint(positions_bar_.data(), core_.normals_bar(), gradient);
    };
    std::visit(pull_back, part);
    return result;
  }

  void look(const double* points, Part& part) {
    const auto look = [&](auto& nodes) { nodes.look(points, positions_.data(), core_.normals()); };
    std::visit(look, part);
  }

  Exec executor_;
  DesignObjectiveOn<Exec> core_;
  Eigen::Matrix3Xd unheld_;  ///< movable_ ignoring the outline's rim.
  Eigen::Matrix3Xd movable_;
  std::vector<AxisBasis> bases_;  ///< Bases of nodes along u and v; empty without an outline.
  std::vector<Part> parts_;
  std::optional<SplineFoldsOn<Exec>> folds_;  ///< Of the spline, where the parts are others.
  Buffer share_;      ///< 1 / number of parts where a coordinate may move, else 0.
  Buffer positions_;  ///< Nodes of the last part.
  Buffer positions_bar_;
  Buffer gradient_;  ///< Gradient of one part.
};

/// SplineObjectiveOn with the picture of a wave (NodeWaves) instead of that of rays; barriers and
/// E_bdr stay those of its rays. Its gradient is that of NodeWaves: good to about 1 % of it. Same
/// interface, on the CPU.
class WaveObjective {
 public:
  /// @pre goal is a picture, options.waves is set.
  WaveObjective(const SurfaceMesh& net, const OpticalSetup& setup, const DesignGoal& goal,
                const ObjectiveOptions& options, const Executor& executor);

  /// @throw Interrupted.
  void relinearize(const double* points);
  /// @throw Interrupted.
  ObjectiveEvaluation evaluate(const double* points, double* gradient);

  [[nodiscard]] const Eigen::Matrix3Xd& movable() const { return rays_.movable(); }

 private:
  /// Adds a share of the picture's error of one part.
  void add_picture(const double* points, SplinePart<Executor>& part, double share,
                   ObjectiveEvaluation& sum, double* gradient);

  Executor executor_;
  ObjectiveWeights weights_;
  SplineObjectiveOn<Executor> rays_;
  std::vector<SplinePart<Executor>> parts_;
  std::unique_ptr<NodeWaves> waves_;
  int columns_, rows_;          ///< Pixels.
  double total_;                ///< Light of the target.
  std::vector<double> target_;  ///< Display-encoded.
  std::vector<double> error_, by_pixel_;
  std::vector<double> positions_, normals_, positions_bar_, normals_bar_;
  std::vector<double> gradient_;
};

}  // namespace lensforge
