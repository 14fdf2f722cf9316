// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/pencil.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "cam/adversarial_meshes.h"

namespace lensforge::pencil_test {
namespace {

constexpr double kRadius = 0.2;
constexpr double kSide = 4.0;

/// A valley along x = 2 between slopes of −a and b.
SurfaceMesh straight_valley(double a, double b) {
  return testing::grid_mesh(21, 17, kSide, kSide, [=](double x, double) {
    return 5.0 + (x < 2.0 ? -a * (x - 2.0) : b * (x - 2.0));
  });
}

double length_of(const Valley& valley) {
  double length = 0.0;
  for (std::size_t i = 1; i < valley.size(); ++i) length += (valley[i] - valley[i - 1]).norm();
  return length;
}

FinishRun pencil_run() {
  FinishRun run;
  run.safe_z = 20.0;
  return run;
}

TEST(Pencil, FollowsAStraightValleyWhereTheBallTouchesBothSides) {
  const SurfaceMesh mesh = straight_valley(0.3, 0.1);
  const std::vector<Valley> valleys = find_valleys(mesh, kRadius, {});
  ASSERT_EQ(valleys.size(), 1U);
  EXPECT_NEAR(length_of(valleys[0]), kSide, 1e-9);
  // The centre lies on both planes moved out by R: 5 − a t + R √(1 + a²) = 5 + b t + R √(1 + b²).
  const double x = 2.0 + kRadius * (std::sqrt(1.09) - std::sqrt(1.01)) / 0.4;
  for (const Eigen::Vector2d& p : valleys[0]) EXPECT_NEAR(p.x(), x, 1e-12);
  EXPECT_NEAR(valleys[0].front().y(), 0.0, 1e-12);
}

TEST(Pencil, LeavesRidgesFlatsAndShallowValleysAlone) {
  EXPECT_TRUE(find_valleys(straight_valley(-0.3, -0.3), kRadius, {}).empty());
  EXPECT_TRUE(find_valleys(straight_valley(0.0, 0.0), kRadius, {}).empty());
  EXPECT_TRUE(find_valleys(straight_valley(0.02, 0.02), kRadius, {}).empty());
  PencilOptions options;
  options.least_angle = 0.03;
  EXPECT_EQ(find_valleys(straight_valley(0.02, 0.02), kRadius, options).size(), 1U);
  options.least_length = 4.1;
  EXPECT_TRUE(find_valleys(straight_valley(0.02, 0.02), kRadius, options).empty());
}

TEST(Pencil, GoesStraightOnWhereValleysCross) {
  const SurfaceMesh mesh = testing::grid_mesh(21, 21, kSide, kSide, [](double x, double y) {
    return 5.0 + 0.2 * std::abs(x - 2.0) + 0.2 * std::abs(y - 2.0);
  });
  const std::vector<Valley> valleys = find_valleys(mesh, kRadius, {});
  ASSERT_EQ(valleys.size(), 2U);
  for (const Valley& valley : valleys) EXPECT_NEAR(length_of(valley), kSide, 0.1);
}

TEST(Pencil, GoesOnToTheNearestEnd) {
  // Four valleys side by side: to and fro.
  const SurfaceMesh mesh = testing::grid_mesh(41, 11, kSide, kSide, [](double x, double) {
    return 5.0 + 0.3 * std::abs(std::remainder(x - 0.5, 1.0));
  });
  const std::vector<Valley> valleys = find_valleys(mesh, kRadius, {});
  ASSERT_EQ(valleys.size(), 4U);
  for (std::size_t i = 1; i < valleys.size(); ++i) {
    EXPECT_NEAR((valleys[i].front() - valleys[i - 1].back()).norm(), 1.0, 1e-6);
  }
}

/// The whole path against the drop-cutter, ways between valleys included.
TEST(Pencil, NeverGouges) {
  for (const auto& [name, mesh] : testing::adversarial_meshes()) {
    if (name == "soup" || name == "steps" || name.find("noise") != std::string::npos) continue;
    const DropCutter cutter(mesh, kRadius, Executor::serial());
    std::vector<PathMove> moves;
    const MoveSink sink = [&](std::span<const PathMove> some) {
      moves.insert(moves.end(), some.begin(), some.end());
    };
    PencilOptions options;
    options.least_length = 0.3;
    options.top = mesh.vertices.row(2).maxCoeff();
    const FacetCutSurface surface(mesh, kRadius, Executor::serial());
    const OperationSummary summary =
        cut_pencil(surface, find_valleys(mesh, kRadius, options), options, pencil_run(), sink, {});
    EXPECT_TRUE(summary.complete);
    EXPECT_EQ(summary.moves, static_cast<std::int64_t>(moves.size()));
    EXPECT_TRUE(name.find("valley") == std::string::npos || summary.passes > 0) << name;
    double highest = 0.0;
    Eigen::Vector3d from = moves.empty() ? Eigen::Vector3d::Zero() : moves.front().end;
    for (const PathMove& move : moves) {
      for (double part = 0.0; part <= 1.0; part += 0.1) {
        const Eigen::Vector3d tip = from + part * (move.end - from);
        const CutterLocation under = cutter.drop(tip.head<2>());
        EXPECT_GE(tip.z(), under.tip - 1e-9) << name;
        if (move.kind == MoveKind::kCut) highest = std::max(highest, tip.z() - under.tip);
      }
      from = move.end;
    }
    EXPECT_EQ(summary.certificate.gouge.value, 0.0);
    EXPECT_LE(summary.certificate.excess.value, highest + 1e-9);
    EXPECT_LE(summary.certificate.excess.value, 2e-4);
  }
}

/// Facets of a smooth surface are made stretch by stretch: the path is that over all of them.
TEST(Pencil, FollowsASmoothSurfaceAsAWhole) {
  const SurfaceMesh mesh = straight_valley(0.3, 0.1);
  const SmoothCutSurface surface(mesh, kRadius, {1e-4, 2e-2}, Executor::serial());
  const auto whole = surface.cutter({Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(kSide, kSide)},
                                    Executor::serial());
  PencilOptions options;
  options.top = mesh.vertices.row(2).maxCoeff();
  std::int64_t points = 0;
  const MoveSink sink = [&](std::span<const PathMove> some) {
    for (const PathMove& move : some) {
      if (move.kind != MoveKind::kCut) continue;
      ++points;
      EXPECT_NEAR(move.end.z() - whole->drop(move.end.head<2>()).tip, 1.77e-4, 1e-6);
    }
  };
  const std::vector<Valley> valleys = find_valleys(mesh, kRadius, options);
  EXPECT_TRUE(cut_pencil(surface, valleys, options, pencil_run(), sink, {}).complete);
  EXPECT_GT(points, 390);
}

}  // namespace
}  // namespace lensforge::pencil_test
