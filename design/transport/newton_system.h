// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "design/transport/cell_kernels.h"
#include "design/transport/cell_stage.h"
#include "design/transport/conjugate_kernels.h"

namespace lensforge {

/// Borders that run through black do not couple their cells at all, and whole groups of cells would
/// hang loose from the others. So L is that of a density with this share spread evenly; masses are
/// not touched by it, and nothing but the direction of a step depends on it.
inline constexpr double kCouplingFloor = 1e-9;

/// Newton directions from edges in the caller's memory, by factorisation.
Eigen::VectorXd factorised_direction(std::span<const DualEdge> edges,
                                     std::span<const EdgeMeasure> measures, double even,
                                     const Eigen::VectorXd& right);

/// Newton directions on an executor. The CPU factorises or takes multigrid, whose set-up runs from
/// node to node and whose coarse levels are small; any other executor takes conjugate gradients
/// scaled by the diagonal, which need no set-up at all and are nothing but sums over long vectors:
/// 400 iterations on average and 966 at most for the 51,200 sites of a 128² design.
template <class Exec>
class NewtonSystem {
 public:
  NewtonSystem(std::size_t cells, const Exec& executor)
      : executor_(executor),
        inverse_diagonal_(cells),
        solution_(cells),
        residual_(cells),
        direction_(cells),
        image_(cells) {}

  /// @param edges  in the caller's memory, `measures` and what `cells` names in the executor's.
  Eigen::VectorXd solve(const CellView& cells, std::span<const DualEdge> edges,
                        std::span<const EdgeMeasure> measures, double even,
                        const Eigen::VectorXd& right) {
    if (weights_.size() < 2 * edges.size()) weights_ = Vector(2 * edges.size());
    each_cell("newton rows", FillRow{cells.first, cells.sides, measures.data(), even,
                                     weights_.data(), inverse_diagonal_.data()});
    fill_zero(executor_, solution_);
    fill_zero(executor_, direction_);
    upload(executor_, numbers(right), std::span<double>(residual_.data(), residual_.size()));
    if (!iterate(GraphRows{cells.first, cells.sides, weights_.data()})) {
      // Cells that nothing ties to the others; no Newton step meets them.
      std::vector<EdgeMeasure> here(measures.size());
      download(executor_, measures, std::span<EdgeMeasure>(here));
      return factorised_direction(edges, here, even, right);
    }
    Eigen::VectorXd result(right.size());
    download(executor_, std::span<const double>(solution_.data(), solution_.size()),
             std::span<double>(result.data(), solution_.size()));
    return result;
  }

 private:
  using Vector = typename Exec::template Buffer<double>;

  /// Residual of a direction. What conjugate gradients leave is smooth, and a picture shows that:
  /// the MAE of a 128² design (two rounds of 30 iterations) is 0.0055 with 1e-2, 0.0032 with 1e-3
  /// and 0.0029 with this; 0.0027 with multigrid, whose 1e-2 is rough. 1e-2 takes 170 iterations.
  static constexpr double kTolerance = 1e-4;
  /// Iterations are given up after this many times √cells; 4.3 is the most that any took.
  static constexpr double kMaxIterations = 20.0;

  [[nodiscard]] static std::span<const double> numbers(const Eigen::VectorXd& v) {
    return {v.data(), static_cast<std::size_t>(v.size())};
  }
  [[nodiscard]] std::int64_t count() const { return static_cast<std::int64_t>(solution_.size()); }
  template <class Functor>
  void each_cell(const char* kernel, const Functor& functor) const {
    parallel_for(executor_, kernel, count(), functor);
  }

  /// Conjugate gradients from 0. @return whether they came to the end.
  bool iterate(const GraphRows& rows) {
    const auto sizes = pending_sum<2>(executor_, "newton residual", count(),
                                      ResidualSizes{residual_.data(), inverse_diagonal_.data()})
                           .get();
    const double goal = kTolerance * kTolerance * sizes[0];
    double size = sizes[0];
    double scaled_size = sizes[1];
    double turn = 0.0;
    const double most = kMaxIterations * std::sqrt(static_cast<double>(count()));
    for (int i = 0; size > goal && i < most; ++i) {
      each_cell("newton turn",
                TurnDirection{residual_.data(), inverse_diagonal_.data(), turn, direction_.data()});
      const double energy = pending_sum<1>(executor_, "newton product", count(),
                                           MultiplyRow{rows, direction_.data(), image_.data()})
                                .get()[0];
      if (!(energy > 0.0)) return false;
      const auto next =
          pending_sum<2>(executor_, "newton step", count(),
                         TakeStep{scaled_size / energy, direction_.data(), image_.data(),
                                  inverse_diagonal_.data(), solution_.data(), residual_.data()})
              .get();
      turn = next[1] / scaled_size;
      size = next[0];
      scaled_size = next[1];
    }
    return size <= goal;
  }

  Exec executor_;
  Vector weights_;
  Vector inverse_diagonal_;
  Vector solution_;
  Vector residual_;
  Vector direction_;
  Vector image_;
};

template <>
class NewtonSystem<Executor> {
 public:
  NewtonSystem(std::size_t /*cells*/, const Executor& executor) : executor_(executor) {}

  [[nodiscard]] Eigen::VectorXd solve(const CellView& cells, std::span<const DualEdge> edges,
                                      std::span<const EdgeMeasure> measures, double even,
                                      const Eigen::VectorXd& right) const;

 private:
  Executor executor_;
};

}  // namespace lensforge
