// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/mpi/rank_stage.h"

#include <map>
#include <string>
#include <utility>

#include "core/error.h"
#include "design/mpi/stage_part.h"

namespace lensforge {
namespace {

/// What rank 0 asks of the others. Arguments follow in messages of their own.
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
  int threads = 1;  ///< Of a new stage.
};

struct Symbols {
  GridSymbol xy;
  GridSymbol z;
};

void announce(const Order& order) {
  Order copy = order;
  Ranks::world().await_bytes(&copy, sizeof(copy));
}

/// Does its part of something that all ranks do. What fails on one rank would leave the others
/// waiting, so that it ends them all.
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
    // Made or interrupted together: an interrupted one is not there on any rank.
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

/// The parts of rank 0's stages on another rank.
class Server {
 public:
  /// False at the end.
  bool follow(const Order& order) {
    try {
      together([&] { obey(order); });
    } catch (const Interrupted&) {
      // Rank 0 knows and goes on from there.
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

}  // namespace lensforge
