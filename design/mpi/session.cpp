// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/mpi/session.h"

#include <Eigen/Core>
#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <initializer_list>
#include <map>
#include <memory>
#include <new>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "core/compute/scalar.h"
#include "core/error.h"
#include "design/energy/objective.h"
#include "design/mpi/rank_executor.h"
#include "design/mpi/ranks.h"
#include "design/optimize/lbfgs.h"
#include "design/schedule/guided_optimization.h"

namespace lensforge {
namespace {

/// One rank's part of a GuidedStage. Vectors of a minimisation hold the rank's own vertices; the
/// objective works on those of its halo too. Everything is collective. Whole matrices, 3 × V, are
/// rank 0's and null on the others.
/// @throw Interrupted, on all ranks, if rank 0 is asked to stop.
class StagePart {
 public:
  /// @param problem  rank 0's whole problem; null elsewhere.
  StagePart(const StageProblem* problem, const Ranks& ranks, const Executor& threads,
            std::stop_token stop);

  void gather_movable(Eigen::Matrix3Xd* movable);
  void relinearize(const Eigen::Matrix3Xd* vertices);
  ObjectiveEvaluation evaluate(const Eigen::Matrix3Xd* vertices, Eigen::Matrix3Xd* gradient);
  void set_symbols(const GridSymbol& xy, const GridSymbol& z);
  void set_reach(const Eigen::Matrix3Xd* reach);
  void apply_root(const Eigen::Matrix3Xd* g, Eigen::Matrix3Xd* r);

  /// @param observe  called on rank 0; an exception is kept for thrown_by_observer().
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
  Vector held_gradient_;  ///< 3 each; valid for the rank's own vertices.
  ObjectiveEvaluation last_;
  std::exception_ptr thrown_;
};

/// An extended source's blur uses rows of other ranks.
SharedPicture shared_picture(const StageProblem& problem, const Ranks& ranks) {
  const Eigen::Vector2i& pixels = problem.setup.pixels;
  const bool shared = problem.setup.extent.none() && pixels.y() >= ranks.count();
  return shared ? SharedPicture{pixels.x(), pixels.y()} : SharedPicture{};
}

std::size_t numbers_of(const ItemRange& vertices) {
  return 3 * static_cast<std::size_t>(vertices.count());
}

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

/// A request of rank 0 to the others. Arguments follow in messages of their own.
struct Order {
  enum class Kind {
    kMake,
    kGatherMovable,
    kRelinearize,
    kEvaluate,
    kSetSymbols,
    kSetReach,
    kApplyRoot,
    kMinimize,
    kDestroy,
    kEnd
  };
  Kind kind = Kind::kEnd;
  int stage = 0;
  int threads = 1;  ///< For a new stage.
};

struct Symbols {
  GridSymbol xy;
  GridSymbol z;
};

void announce(const Order& order) {
  Order copy = order;
  Ranks::world().await_bytes(&copy, sizeof(copy));
}

/// Runs this rank's part of a common task. A failure on one rank would leave the others waiting, so
/// it ends them all.
template <class Body>
auto together(const Body& body) {
  try {
    return body();
  } catch (const Interrupted&) {
    throw;
  } catch (const std::bad_alloc&) {
    Ranks::world().abort("not enough memory");
  } catch (const std::exception& e) {
    Ranks::world().abort(e.what());
  }
}

class RankStage final : public GuidedStage {
 public:
  RankStage(const StageProblem& problem, const Executor& executor) : number_(next_number()) {
    const Ranks ranks = Ranks::world();
    announce({Order::Kind::kMake, number_, executor.concurrency()});
    // All ranks make it or are interrupted together: an interrupted stage exists on no rank.
    part_ = together([&] {
      return std::make_unique<StagePart>(&problem, ranks, executor, executor.stop_token());
    });
    gather_movable();
  }
  ~RankStage() override { announce({Order::Kind::kDestroy, number_}); }
  RankStage(const RankStage&) = delete;
  RankStage& operator=(const RankStage&) = delete;

  [[nodiscard]] const Eigen::Matrix3Xd& movable() const override { return movable_; }

  void relinearize(const Eigen::Matrix3Xd& vertices) override {
    announce({Order::Kind::kRelinearize, number_});
    together([&] { part_->relinearize(&vertices); });
    if (part_->has_outline()) gather_movable();
  }

  ObjectiveEvaluation evaluate(const Eigen::Matrix3Xd& vertices,
                               Eigen::Matrix3Xd& gradient) override {
    announce({Order::Kind::kEvaluate, number_});
    return together([&] { return part_->evaluate(&vertices, &gradient); });
  }

  void set_symbols(const GridSymbol& xy, const GridSymbol& z) override {
    announce({Order::Kind::kSetSymbols, number_});
    Symbols symbols{xy, z};
    Ranks::world().broadcast(symbols);
    part_->set_symbols(xy, z);
  }

  void set_reach(const Eigen::Matrix3Xd& reach) override {
    announce({Order::Kind::kSetReach, number_});
    together([&] { part_->set_reach(&reach); });
  }

  Eigen::Matrix3Xd apply_root(const Eigen::Matrix3Xd& g) override {
    announce({Order::Kind::kApplyRoot, number_});
    Eigen::Matrix3Xd r;
    together([&] { part_->apply_root(&g, &r); });
    return r;
  }

  LbfgsSummary minimize(const LbfgsOptions& options, const Observer& observe,
                        Eigen::Matrix3Xd& vertices) override {
    announce({Order::Kind::kMinimize, number_});
    LbfgsOptions copy = options;
    Ranks::world().broadcast(copy);
    LbfgsSummary summary = together([&] { return part_->minimize(options, observe, &vertices); });
    if (part_->thrown_by_observer()) std::rethrow_exception(part_->thrown_by_observer());
    return summary;
  }

 private:
  static int next_number() {
    static int number = 0;
    return ++number;
  }

  void gather_movable() {
    announce({Order::Kind::kGatherMovable, number_});
    together([&] { part_->gather_movable(&movable_); });
  }

  int number_;
  std::unique_ptr<StagePart> part_;
  Eigen::Matrix3Xd movable_;
};

/// Holds another rank's parts of rank 0's stages.
class Server {
 public:
  /// Returns false at the end.
  bool follow(const Order& order) {
    try {
      together([&] { obey(order); });
    } catch (const Interrupted&) {
      // Rank 0 throws too and decides how to continue.
    }
    return order.kind != Order::Kind::kEnd;
  }

 private:
  void obey(const Order& order) {
    if (order.kind == Order::Kind::kEnd) return;
    if (order.kind == Order::Kind::kMake) {
      const Executor threads =
          order.threads > 1 ? Executor::cpu(order.threads) : Executor::serial();
      parts_[order.stage] =
          std::make_unique<StagePart>(nullptr, ranks_, threads, std::stop_token());
    } else if (order.kind == Order::Kind::kDestroy) {
      parts_.erase(order.stage);
    } else {
      obey(order.kind, *parts_.at(order.stage));
    }
  }

  void obey(Order::Kind kind, StagePart& part) const {
    switch (kind) {
      case Order::Kind::kGatherMovable:
        part.gather_movable(nullptr);
        break;
      case Order::Kind::kRelinearize:
        part.relinearize(nullptr);
        break;
      case Order::Kind::kEvaluate:
        part.evaluate(nullptr, nullptr);
        break;
      case Order::Kind::kSetSymbols: {
        Symbols symbols;
        ranks_.broadcast(symbols);
        part.set_symbols(symbols.xy, symbols.z);
        break;
      }
      case Order::Kind::kSetReach:
        part.set_reach(nullptr);
        break;
      case Order::Kind::kApplyRoot:
        part.apply_root(nullptr, nullptr);
        break;
      case Order::Kind::kMinimize: {
        LbfgsOptions options;
        ranks_.broadcast(options);
        part.minimize(options, {}, nullptr);
        break;
      }
      default:
        LF_CHECK(false, std::to_string(static_cast<int>(kind)));
    }
  }

  Ranks ranks_ = Ranks::world();
  std::map<int, std::unique_ptr<StagePart>> parts_;
};

}  // namespace

std::unique_ptr<GuidedStage> make_stage_on_ranks(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                                 double aspect, const DesignGoal& goal,
                                                 const ObjectiveOptions& options,
                                                 const Executor& executor) {
  if (!MpiSession::lives()) return nullptr;
  const int ranks = Ranks::world().count();
  const bool serves = ranks > 1 && options.model != SurfaceModel::kSpline && has_row_order(mesh) &&
                      RowSlab::suffices(mesh.grid, ranks);
  if (!serves) return nullptr;
  return std::make_unique<RankStage>(StageProblem{mesh, setup, aspect, goal, options}, executor);
}

void serve_rank() {
  const Ranks ranks = Ranks::world();
  Server server;
  Order order;
  do {
    ranks.await_bytes(&order, sizeof(order));
  } while (server.follow(order));
}

void dismiss_ranks() { announce({Order::Kind::kEnd}); }

namespace {

/// Value of an environment variable; 0 if it is not set.
int number_in(const char* variable) {
  const char* const text = std::getenv(variable);
  return text != nullptr ? std::atoi(text) : 0;
}

/// Value of the first of these variables that is set.
int first_of(std::initializer_list<const char*> variables) {
  for (const char* variable : variables) {
    if (const int number = number_in(variable); number > 0) return number;
  }
  return 0;
}

/// Number of processes started together, as each launcher states it: Open MPI, then MPICH's and
/// Slurm's PMI, then Slurm with PMIx.
int started_together() {
  if (const int number = first_of({"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"}); number > 0) return number;
  if (std::getenv("PMIX_RANK") == nullptr) return 1;
  return std::max(1, number_in("SLURM_STEP_NUM_TASKS"));
}

}  // namespace

int rank_count() { return MpiSession::lives() ? Ranks::world().count() : 1; }

int ranks_here() {
  if (rank_count() == 1) return 1;
  const int here = first_of({"OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS"});
  return here > 0 ? here : rank_count();
}

int run_on_ranks(const std::function<int()>& first) {
  if (started_together() == 1) return first();
  const MpiSession session;
  if (!Ranks::world().is_first()) {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_IGN);
    serve_rank();
    return 0;
  }
  const int outcome = first();
  dismiss_ranks();
  return outcome;
}

}  // namespace lensforge
