// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/round.h"

#include <gtest/gtest.h>

#include "core/surface/grid_mesh.h"

namespace lensforge {
namespace {

constexpr int kRounds = 6;

SurfaceMesh mesh_at(double z) { return make_grid_mesh({2.0, 2.0}, {3, 3}, z); }

/// After the first round of a level, of value 1.
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

}  // namespace
}  // namespace lensforge
