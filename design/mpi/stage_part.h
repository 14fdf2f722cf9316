// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <exception>
#include <span>
#include <stop_token>
#include <vector>

#include "design/energy/objective.h"
#include "design/mpi/rank_executor.h"
#include "design/mpi/rank_preconditioner.h"
#include "design/mpi/stage_problem.h"
#include "design/optimize/lbfgs.h"
#include "design/schedule/guided_stage.h"

namespace lensforge {

/// One rank's part of a GuidedStage. Vectors of a minimisation hold the vertices that the rank
/// owns, the objective works on those of its halo too. Everything is collective; whole matrices,
/// 3 × V, are rank 0's, null on the others.
/// @throw Interrupted, on all ranks, if rank 0 is asked to stop.
class StagePart {
 public:
  /// @param problem  rank 0's whole one; null elsewhere.
  StagePart(const StageProblem* problem, const Ranks& ranks, const Executor& threads,
            std::stop_token stop);

  void gather_movable(Eigen::Matrix3Xd* movable);
  void relinearize(const Eigen::Matrix3Xd* vertices);
  ObjectiveEvaluation evaluate(const Eigen::Matrix3Xd* vertices, Eigen::Matrix3Xd* gradient);
  void set_symbols(const GridSymbol& xy, const GridSymbol& z);
  void set_reach(const Eigen::Matrix3Xd* reach);
  void apply_root(const Eigen::Matrix3Xd* g, Eigen::Matrix3Xd* r);

  /// @param observe  asked on rank 0; what it throws is kept for thrown_by_observer().
  LbfgsSummary minimize(const LbfgsOptions& options, const GuidedStage::Observer& observe,
                        Eigen::Matrix3Xd* vertices);
  [[nodiscard]] std::exception_ptr thrown_by_observer() const { return thrown_; }

  [[nodiscard]] bool has_outline() const { return has_outline_; }

 private:
  struct Held {
    StageProblem problem;
    GridShape grid;
  };
  static Held held_of(const StageProblem* problem, const Ranks& ranks);
  StagePart(const Held& held, const Ranks& ranks, const Executor& threads, std::stop_token stop);

  using Vector = std::vector<double>;

  [[nodiscard]] std::span<double> own(Vector& held) const;
  [[nodiscard]] Vector own_movable() const;
  void scatter(const Eigen::Matrix3Xd* whole, std::span<double> own) const;
  void gather(std::span<const double> own, Eigen::Matrix3Xd* whole) const;
  double evaluate_own(std::span<const double> x, std::span<double> gradient);
  [[nodiscard]] bool goes_on(int iteration, const GuidedStage::Observer& observe);

  RankExecutor executor_;
  bool has_outline_;
  DesignObjectiveOn<RankExecutor> objective_;
  RankPreconditioner preconditioner_;
  Vector held_;           ///< Vertices with the halo, 3 each.
  Vector held_gradient_;  ///< Likewise; right where the rank owns them.
  ObjectiveEvaluation last_;
  std::exception_ptr thrown_;
};

}  // namespace lensforge
