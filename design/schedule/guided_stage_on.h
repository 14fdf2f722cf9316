// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

#include "core/compute/executor.h"
#include "core/compute/scalar.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "design/energy/objective.h"
#include "design/optimize/grid_preconditioner.h"
#include "design/optimize/lbfgs.h"
#include "design/schedule/guided_optimization.h"

namespace lensforge {

/// GuidedStage on any executor. Objective is DesignObjectiveOn or SplineObjectiveOn.
template <class Exec, class Objective = DesignObjectiveOn<Exec>>
class GuidedStageOn final : public GuidedStage {
 public:
  /// @param aspect  cell height ÷ cell width of the grid.
  GuidedStageOn(const SurfaceMesh& mesh, const OpticalSetup& setup, double aspect,
                const DesignGoal& goal, const ObjectiveOptions& options, const Exec& executor)
      : executor_(executor),
        objective_(mesh, setup, goal, options, executor),
        preconditioner_(mesh.grid, aspect, objective_.movable(), executor),
        x_(static_cast<std::size_t>(mesh.vertices.size())),
        y_(x_.size()) {}

  [[nodiscard]] const Eigen::Matrix3Xd& movable() const override { return objective_.movable(); }

  void relinearize(const Eigen::Matrix3Xd& vertices) override {
    send(vertices, x_);
    objective_.relinearize(x_.data());
    preconditioner_.set_movable(objective_.movable());
  }

  ObjectiveEvaluation evaluate(const Eigen::Matrix3Xd& vertices,
                               Eigen::Matrix3Xd& gradient) override {
    send(vertices, x_);
    const ObjectiveEvaluation result = objective_.evaluate(x_.data(), y_.data());
    gradient.resize(3, vertices.cols());
    fetch(y_, gradient);
    return result;
  }

  void set_symbols(const GridSymbol& xy, const GridSymbol& z) override {
    preconditioner_.xy = xy;
    preconditioner_.z = z;
  }

  void set_reach(const Eigen::Matrix3Xd& reach) override { preconditioner_.set_reach(reach); }

  Eigen::Matrix3Xd apply_root(const Eigen::Matrix3Xd& g) override {
    send(g, x_);
    preconditioner_.apply({x_.data(), x_.size()}, 0.5, {y_.data(), y_.size()});
    Eigen::Matrix3Xd r(3, g.cols());
    fetch(y_, r);
    return r;
  }

  LbfgsSummary minimize(const LbfgsOptions& options, const Observer& observe,
                        Eigen::Matrix3Xd& vertices) override {
    ObjectiveEvaluation last;
    const RawObjective function = [&](std::span<const double> x, std::span<double> gradient) {
      last = objective_.evaluate(x.data(), gradient.data());
      return last.feasible ? last.energy.total : kInfinity;
    };
    const RawPreconditioner precondition = [&](std::span<const double> g, std::span<double> r) {
      preconditioner_.apply(g, 1.0, r);
    };
    LbfgsOn<Exec> minimizer(function, precondition, options, executor_);
    send(vertices, x_);
    try {
      LbfgsSummary summary =
          minimizer.run([&](int iteration, double) { return observe(iteration, last); }, x_);
      fetch(x_, vertices);
      return summary;
    } catch (...) {
      fetch(x_, vertices);
      throw;
    }
  }

 private:
  using Vector = typename Exec::template Buffer<double>;

  void send(const Eigen::Matrix3Xd& from, Vector& to) {
    upload(executor_, std::span<const double>(from.data(), to.size()),
           std::span<double>(to.data(), to.size()));
  }
  void fetch(const Vector& from, Eigen::Matrix3Xd& to) {
    download(executor_, std::span<const double>(from.data(), from.size()),
             std::span<double>(to.data(), from.size()));
  }

  Exec executor_;
  Objective objective_;
  GridPreconditionerOn<Exec> preconditioner_;
  Vector x_;
  Vector y_;
};

}  // namespace lensforge
