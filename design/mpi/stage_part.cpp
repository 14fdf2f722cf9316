// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/mpi/stage_part.h"

#include <algorithm>
#include <utility>

#include "core/value_slope.h"
#include "design/optimize/lbfgs.h"

namespace lensforge {
namespace {

/// An extended source's blur takes in rows of other ranks.
SharedPicture shared_picture(const StageProblem& problem, const Ranks& ranks) {
  const Eigen::Vector2i& pixels = problem.setup.pixels;
  const bool shared = problem.setup.extent.none() && pixels.y() >= ranks.count();
  return shared ? SharedPicture{pixels.x(), pixels.y()} : SharedPicture{};
}

std::size_t numbers_of(const ItemRange& vertices) {
  return 3 * static_cast<std::size_t>(vertices.count());
}

}  // namespace

StagePart::Held StagePart::held_of(const StageProblem* problem, const Ranks& ranks) {
  Held held;
  held.problem = share_problem(problem, ranks, held.grid);
  return held;
}

StagePart::StagePart(const StageProblem* problem, const Ranks& ranks, const Executor& threads,
                     std::stop_token stop)
    : StagePart(held_of(problem, ranks), ranks, threads, std::move(stop)) {}

StagePart::StagePart(const Held& held, const Ranks& ranks, const Executor& threads,
                     std::stop_token stop)
    : executor_(threads, ranks, RowSlab(held.grid, ranks.count(), ranks.rank()),
                shared_picture(held.problem, ranks), std::move(stop)),
      has_outline_(held.problem.setup.outline.has_value()),
      objective_(held.problem.mesh, held.problem.setup, held.problem.goal, held.problem.options,
                 executor_),
      preconditioner_(held.grid, held.problem.aspect, own_movable(), ranks, executor_),
      held_(numbers_of(executor_.slab().held_vertices())),
      held_gradient_(held_.size()) {}

std::span<double> StagePart::own(Vector& held) const {
  const ItemRange vertices = executor_.slab().own_vertices_here();
  return std::span(held).subspan(3 * static_cast<std::size_t>(vertices.begin),
                                 numbers_of(vertices));
}

StagePart::Vector StagePart::own_movable() const {
  const Eigen::Matrix3Xd& held = objective_.movable();
  Vector movable(held.data(), held.data() + held.size());
  const std::span<double> part = own(movable);
  return {part.begin(), part.end()};
}

void StagePart::scatter(const Eigen::Matrix3Xd* whole, std::span<double> own) const {
  const Ranks& ranks = executor_.ranks();
  if (!ranks.is_first()) {
    ranks.receive(0, own);
    return;
  }
  for (int r = 1; r < ranks.count(); ++r) {
    const ItemRange part = RowSlab(executor_.slab().grid(), ranks.count(), r).own_vertices();
    ranks.send(r, std::span<const double>(whole->data() + 3 * part.begin, numbers_of(part)));
  }
  std::copy_n(whole->data(), own.size(), own.begin());
}

void StagePart::gather(std::span<const double> own, Eigen::Matrix3Xd* whole) const {
  const Ranks& ranks = executor_.ranks();
  if (!ranks.is_first()) {
    ranks.send(0, own);
    return;
  }
  const GridShape& grid = executor_.slab().grid();
  whole->resize(3, static_cast<Eigen::Index>(grid.columns) * grid.rows);
  std::copy(own.begin(), own.end(), whole->data());
  for (int r = 1; r < ranks.count(); ++r) {
    const ItemRange part = RowSlab(grid, ranks.count(), r).own_vertices();
    ranks.receive(r, std::span<double>(whole->data() + 3 * part.begin, numbers_of(part)));
  }
}

void StagePart::gather_movable(Eigen::Matrix3Xd* movable) { gather(own_movable(), movable); }

void StagePart::relinearize(const Eigen::Matrix3Xd* vertices) {
  scatter(vertices, own(held_));
  fill_halo(executor_, held_);
  objective_.relinearize(held_.data());
  preconditioner_.set_movable(own_movable());
}

ObjectiveEvaluation StagePart::evaluate(const Eigen::Matrix3Xd* vertices,
                                        Eigen::Matrix3Xd* gradient) {
  scatter(vertices, own(held_));
  fill_halo(executor_, held_);
  const ObjectiveEvaluation result = objective_.evaluate(held_.data(), held_gradient_.data());
  gather(own(held_gradient_), gradient);
  return result;
}

void StagePart::set_symbols(const GridSymbol& xy, const GridSymbol& z) {
  preconditioner_.xy = xy;
  preconditioner_.z = z;
}

void StagePart::set_reach(const Eigen::Matrix3Xd* reach) {
  Vector part(numbers_of(executor_.slab().own_vertices()));
  scatter(reach, part);
  preconditioner_.set_reach(part);
}

void StagePart::apply_root(const Eigen::Matrix3Xd* g, Eigen::Matrix3Xd* r) {
  Vector part(numbers_of(executor_.slab().own_vertices()));
  scatter(g, part);
  preconditioner_.apply(part, 0.5, part);
  gather(part, r);
}

double StagePart::evaluate_own(std::span<const double> x, std::span<double> gradient) {
  std::copy(x.begin(), x.end(), own(held_).begin());
  fill_halo(executor_, held_);
  last_ = objective_.evaluate(held_.data(), held_gradient_.data());
  const std::span<const double> part = own(held_gradient_);
  std::copy(part.begin(), part.end(), gradient.begin());
  return last_.feasible ? last_.energy.total : kInfinity;
}

bool StagePart::goes_on(int iteration, const GuidedStage::Observer& observe) {
  bool on = true;
  if (executor_.ranks().is_first()) {
    try {
      on = observe(iteration, last_);
    } catch (...) {
      thrown_ = std::current_exception();
      on = false;
    }
  }
  executor_.ranks().broadcast(on);
  return on;
}

LbfgsSummary StagePart::minimize(const LbfgsOptions& options, const GuidedStage::Observer& observe,
                                 Eigen::Matrix3Xd* vertices) {
  thrown_ = nullptr;
  const RawObjective function = [&](std::span<const double> x, std::span<double> gradient) {
    return evaluate_own(x, gradient);
  };
  const RawPreconditioner precondition = [&](std::span<const double> g, std::span<double> r) {
    preconditioner_.apply(g, 1.0, r);
  };
  LbfgsOn<RankExecutor> minimizer(function, precondition, options, executor_);
  Vector x(numbers_of(executor_.slab().own_vertices()));
  scatter(vertices, x);
  try {
    LbfgsSummary summary =
        minimizer.run([&](int iteration, double) { return goes_on(iteration, observe); }, x);
    gather(x, vertices);
    return summary;
  } catch (const Interrupted&) {
    gather(x, vertices);
    throw;
  }
}

}  // namespace lensforge
