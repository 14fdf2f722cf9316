// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/rounds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/error.h"
#include "core/mesh/surface_mesh.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

constexpr int kRounds = 6;

SurfaceMesh mesh_at(double z) { return make_grid_mesh({2.0, 2.0}, {3, 3}, z); }

/// State after the first round of a level, of value 1.
Checkpoint second_round() {
  Checkpoint state;
  state.round = 1;
  state.value = 1.0;
  state.mesh = mesh_at(2.0);
  state.scales.reach = Eigen::Matrix3Xd::Ones(3, 9);
  return state;
}

TEST(ConcludeRound, TakesABetterMeshAndKeepsTheScales) {
  Checkpoint state = second_round();
  const SurfaceMesh before = mesh_at(1.0);
  conclude_round({before, 0.5, true, false}, kRounds, state);
  EXPECT_EQ(state.value, 0.5);
  EXPECT_EQ(state.mesh.vertices, mesh_at(2.0).vertices);
  EXPECT_TRUE(state.scales.known());
  EXPECT_TRUE(state.transporting);
  EXPECT_EQ(state.round, 2);
}

TEST(ConcludeRound, GoesBackToTheMeshBeforeAWorseRound) {
  Checkpoint state = second_round();
  const SurfaceMesh before = mesh_at(1.0);
  conclude_round({before, 1.5, true, false}, kRounds, state);
  EXPECT_EQ(state.value, 1.0);
  EXPECT_EQ(state.mesh.vertices, before.vertices);
  EXPECT_EQ(state.round, 2);
}

TEST(ConcludeRound, AnIdleRoundEndsTransportAndMeasuresAnew) {
  Checkpoint state = second_round();
  const SurfaceMesh before = mesh_at(1.0);
  conclude_round({before, 0.9995, true, false}, kRounds, state);
  EXPECT_EQ(state.mesh.vertices, mesh_at(2.0).vertices);
  EXPECT_FALSE(state.transporting);
  EXPECT_FALSE(state.scales.known());
  EXPECT_EQ(state.round, 2);
}

TEST(ConcludeRound, AnIdleRoundWithNothingLeftToTryEndsTheLevel) {
  const SurfaceMesh before = mesh_at(1.0);
  for (const bool transported : {false, true}) {
    for (const bool rescaled : {false, true}) {
      Checkpoint state = second_round();
      conclude_round({before, 1.0, transported, rescaled}, kRounds, state);
      EXPECT_EQ(state.round, !transported && rescaled ? kRounds : 2);
    }
  }
}

DesignOptions narrow_lens(int transport_rounds, double focal_length) {
  DesignOptions options;
  options.model = SurfaceModel::kFacet;
  options.pixels = 24;
  options.width = 12.0;
  options.thickness = 1.0;
  options.focal_length = focal_length;
  options.rounds = 3;
  options.transport_rounds = transport_rounds;
  options.iterations = 2;
  return options;
}

/// A running design.
struct Work {
  explicit Work(const DesignOptions& given) : options(given) {}

  [[nodiscard]] bool run_round() {
    GuidedOptimization stage = this->stage();
    return lensforge::run_round({task, level, problem, stage, log}, state);
  }
  [[nodiscard]] bool mesh_is_allowed() { return std::isfinite(stage().value(state.mesh)); }

  DesignOptions options;
  Image picture = testing::spot_picture(24, 20);
  RunControl control;
  DesignTask task = make_task(picture, options, Executor::serial(), control);
  Level level = task.levels.front();
  Checkpoint state = first_state(task);
  LevelProblem problem = make_problem(task, level, state.mesh.triangle_count());
  DesignLog log{task, state};

 private:
  [[nodiscard]] GuidedOptimization stage() const {
    return {state.mesh, problem.setup, problem.target, problem.objective, task.executor};
  }
};

TEST(RunRound, GoesOnWithTheSurfaceBeforeWhereTransportAsksForTooMuch) {
  constexpr double kTooShort = 4.0;
  Work first(narrow_lens(2, kTooShort));
  EXPECT_THROW(static_cast<void>(first.run_round()), InputError);

  Work second(narrow_lens(2, kTooShort));
  second.state.round = 1;
  EXPECT_TRUE(second.run_round());
  EXPECT_TRUE(second.mesh_is_allowed());
  EXPECT_FALSE(second.state.transporting);
  EXPECT_NE(second.log.remark().find("no surface sends the light"), std::string::npos);
}

TEST(RunRound, DrawsASurfaceBackThatReflectsTotally) {
  Work work(narrow_lens(0, 36.0));
  for (auto p : work.state.mesh.vertices.colwise()) p.z() += 2.0 * p.x();
  ASSERT_FALSE(work.mesh_is_allowed());
  EXPECT_TRUE(work.run_round());
  EXPECT_TRUE(work.mesh_is_allowed());
}

}  // namespace
}  // namespace lensforge
