// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <memory>
#include <stop_token>
#include <string>
#include <thread>

#include "core/error.h"
#include "design/design.h"
#include "design/mpi/rank_test.h"
#include "design/mpi/ranks.h"
#include "design/schedule/guided_optimization.h"
#include "design/stage_on_rough_mesh.h"
#include "design/transport_scenes.h"

namespace lensforge {
namespace {

using testing::Goal;

ObjectiveOptions options_of(SurfaceModel model) {
  ObjectiveWeights weights;
  weights.gradient = 1.0;
  return testing::options_of(model, weights);
}

std::unique_ptr<GuidedStage> shared_stage(SurfaceModel model, Goal goal, const OpticalSetup& setup,
                                          const Executor& executor = Executor::serial()) {
  auto stage = make_stage_on_ranks(testing::rough_mesh(), setup, 1.0, testing::goal_of(goal),
                                   options_of(model), executor);
  if (Ranks::world().count() > 1) {
    EXPECT_NE(stage, nullptr);
  }
  return stage;
}

std::unique_ptr<GuidedStage> whole_stage(SurfaceModel model, Goal goal, const OpticalSetup& setup) {
  return std::make_unique<GuidedStageOn<Executor>>(testing::rough_mesh(), setup, 1.0,
                                                   testing::goal_of(goal), options_of(model),
                                                   Executor::serial());
}

void expect_same_energy(const ObjectiveEvaluation& found, const ObjectiveEvaluation& expected) {
  ASSERT_TRUE(expected.feasible);
  ASSERT_TRUE(found.feasible);
  const EnergyValues& a = found.energy;
  const EnergyValues& b = expected.energy;
  EXPECT_EQ(found.mae, expected.mae);
  EXPECT_EQ(a.image, b.image);
  EXPECT_EQ(a.gradient, b.gradient);
  EXPECT_EQ(a.unlit, b.unlit);
  EXPECT_EQ(a.boundary, b.boundary);
  EXPECT_EQ(a.barrier, b.barrier);
  EXPECT_EQ(a.face, b.face);
  EXPECT_EQ(a.edge, b.edge);
  EXPECT_EQ(a.laplacian, b.laplacian);
  EXPECT_EQ(a.align, b.align);
  EXPECT_EQ(a.flux, b.flux);
  EXPECT_EQ(a.total, b.total);
}

/// Compares both stages at the mesh where it was linearized, and after a move.
void expect_same_objective(SurfaceModel model, Goal goal, const OpticalSetup& setup) {
  const auto shared = shared_stage(model, goal, setup);
  const auto whole = whole_stage(model, goal, setup);
  EXPECT_TRUE(shared->movable() == whole->movable());
  Eigen::Matrix3Xd vertices = testing::rough_mesh().vertices;
  testing::Random random(11);
  for (int pass = 0; pass < 3; ++pass) {
    Eigen::Matrix3Xd found;
    Eigen::Matrix3Xd expected;
    const ObjectiveEvaluation there = shared->evaluate(vertices, found);
    expect_same_energy(there, whole->evaluate(vertices, expected));
    EXPECT_TRUE(found == expected)
        << "largest difference " << (found - expected).cwiseAbs().maxCoeff() << " of "
        << expected.cwiseAbs().maxCoeff();
    for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
      vertices.col(v) +=
          1e-3 * random.vector3().cwiseProduct(Eigen::Vector3d(whole->movable().col(v)));
    }
    if (pass == 0) continue;  // Weights of the edges from elsewhere, then from here.
    shared->relinearize(vertices);
    whole->relinearize(vertices);
    EXPECT_TRUE(shared->movable() == whole->movable());
  }
}

class StageOnRanks : public ::testing::Test {
 protected:
  void SetUp() override {
    if (Ranks::world().count() == 1) GTEST_SKIP() << "one process has no stage on ranks";
  }
};

class GradientOnRanks : public StageOnRanks,
                        public ::testing::WithParamInterface<testing::NamedSetup> {};

INSTANTIATE_TEST_SUITE_P(Setups, GradientOnRanks, ::testing::ValuesIn(testing::all_setups()),
                         [](const auto& one) { return one.param.name; });

/// Both agree to the last bit.
TEST_P(GradientOnRanks, AndEnergyAreThoseOfOneProcess) {
  testing::on_first_rank([] {
    for (const SurfaceModel model : testing::kModels) {
      for (const Goal goal : testing::kGoals) {
        SCOPED_TRACE(model_name(model) + (goal == Goal::kPicture ? ", picture" : ", places"));
        expect_same_objective(model, goal, GetParam().setup);
      }
    }
  });
}

TEST_F(StageOnRanks, RootOfThePreconditionerEqualsThatOfOneProcess) {
  testing::on_first_rank([] {
    const auto shared = shared_stage(SurfaceModel::kSmooth, Goal::kPicture, testing::kSetup);
    const auto whole = whole_stage(SurfaceModel::kSmooth, Goal::kPicture, testing::kSetup);
    testing::Random random(4);
    Eigen::Matrix3Xd g(3, whole->movable().cols());
    Eigen::Matrix3Xd reach(3, g.cols());
    for (double& entry : g.reshaped()) entry = random.between(-1.0, 1.0);
    for (double& entry : reach.reshaped()) entry = random.between(0.3, 1.0);
    const GridSymbol xy{2.0, 0.25, 1.0, 0.1};
    const GridSymbol z{3.0, 0.01, 2.0, 0.0};
    for (GuidedStage* stage : {shared.get(), whole.get()}) {
      stage->set_reach(reach);
      stage->set_symbols(xy, z);
    }
    const Eigen::Matrix3Xd expected = whole->apply_root(g);
    EXPECT_TRUE(shared->apply_root(g) == expected);
  });
}

/// Everything that a round does with a stage, including scales, for this number of steps.
struct Descent {
  SurfaceMesh mesh = testing::rough_mesh();
  LbfgsSummary summary;

  void run(SurfaceModel model, const Executor& executor, int steps,
           const GuidedOptimization::Observer& observe) {
    GuidedOptimization stage(mesh, testing::kSetup, testing::target(), options_of(model), executor);
    LbfgsOptions options;
    options.max_iterations = steps;
    summary = stage.run(options, observe, mesh);
  }
};

Executor on_ranks() { return Executor::serial().with_device(Device::kRanks); }

bool go_on(int /*iteration*/, const ObjectiveEvaluation& /*there*/) { return true; }

TEST_F(StageOnRanks, DescendsAsOneProcessDoes) {
  testing::on_first_rank([] {
    for (const SurfaceModel model : testing::kModels) {
      Descent shared;
      Descent whole;
      shared.run(model, on_ranks(), 10, go_on);
      whole.run(model, Executor::serial(), 10, go_on);
      ASSERT_EQ(whole.summary.iterations, 10);
      EXPECT_EQ(shared.summary.iterations, 10);
      EXPECT_EQ(shared.summary.evaluations, whole.summary.evaluations);
      EXPECT_EQ(shared.summary.value, whole.summary.value);
      EXPECT_TRUE(shared.mesh.vertices == whole.mesh.vertices);
    }
  });
}

double value_in_one_process(const SurfaceMesh& mesh) {
  return GuidedOptimization(mesh, testing::kSetup, testing::target(),
                            options_of(SurfaceModel::kSmooth), Executor::serial())
      .value(mesh);
}

/// Stopped by another thread, like a signal.
TEST_F(StageOnRanks, StopsOnAllRanksAndKeepsTheBest) {
  testing::on_first_rank([] {
    std::stop_source stop;
    std::thread later;
    const auto observe = [&](int iteration, const ObjectiveEvaluation& /*there*/) {
      if (iteration == 3) later = std::thread([&stop] { stop.request_stop(); });
      if (iteration == 3) later.join();
      return iteration < 4;
    };
    Descent descent;
    EXPECT_THROW(
        descent.run(SurfaceModel::kSmooth, on_ranks().with_stop(stop.get_token()), 50, observe),
        Interrupted);
    EXPECT_LT(value_in_one_process(descent.mesh),
              0.9 * value_in_one_process(testing::rough_mesh()));
    // The ranks are still in step and can do more together.
    Descent again;
    again.run(SurfaceModel::kSmooth, on_ranks(), 2, go_on);
    EXPECT_EQ(again.summary.iterations, 2);
  });
}

/// For example because the disk is full.
TEST_F(StageOnRanks, PassesOnWhatItsObserverThrows) {
  testing::on_first_rank([] {
    const auto observe = [](int iteration, const ObjectiveEvaluation& /*there*/) {
      if (iteration == 2) throw RunError("no space left");
      return true;
    };
    Descent descent;
    EXPECT_THROW(descent.run(SurfaceModel::kSmooth, on_ranks(), 5, observe), RunError);
    EXPECT_LT(value_in_one_process(descent.mesh), value_in_one_process(testing::rough_mesh()));
    Descent again;
    again.run(SurfaceModel::kSmooth, on_ranks(), 2, go_on);
    EXPECT_EQ(again.summary.iterations, 2);
  });
}

TEST_F(StageOnRanks, IsNotMadeWhereRowsAreTooFew) {
  testing::on_first_rank([] {
    const GridShape few{9, kHaloRows * Ranks::world().count() - 1};
    const SurfaceMesh mesh = make_grid_mesh(testing::kSize, few, 5.0);
    EXPECT_EQ(make_stage_on_ranks(mesh, testing::kSetup, 1.0, testing::target(),
                                  options_of(SurfaceModel::kSmooth), Executor::serial()),
              nullptr);
  });
}

/// The surface of a small design, which determines everything else.
SurfaceMesh designed(SurfaceModel model, const Executor& executor) {
  const Image picture = testing::spot_picture(64, 56);
  DesignOptions options = default_design_options(model, picture);
  options.rounds = 3;
  options.transport_rounds = 2;
  options.iterations = 30;
  const DesignResult result = design_lens(picture, options, executor, {});
  EXPECT_EQ(result.status, DesignResult::Status::kDone) << result.message;
  return result.lens.surface;
}

TEST(DesignOnRanks, IsThatOfOneProcess) {
  if (Ranks::world().count() == 1) GTEST_SKIP() << "that is one process";
  testing::on_first_rank([] {
    for (const SurfaceModel model : testing::kModels) {
      const SurfaceMesh whole = designed(model, Executor::serial());
      const SurfaceMesh shared = designed(model, Executor::serial().with_device(Device::kRanks));
      EXPECT_TRUE(shared.vertices == whole.vertices) << model_name(model);
    }
  });
}

}  // namespace

}  // namespace lensforge
