// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/mesh/surface_mesh.h"
#include "design/random_input.h"
#include "design/schedule/levels.h"
#include "design/schedule/rounds.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

/// Discs and strokes of any brightness on a ground that is often black.
Image random_scene(testing::Random& random, int columns, int rows) {
  Image image(columns, rows);
  const double ground = std::max(0.0, random.between(-0.3, 0.6));
  for (float& value : image.values()) value = static_cast<float>(ground);
  const int shapes = 1 + random.below(6);
  for (int s = 0; s < shapes; ++s) {
    const Eigen::Vector2d a(random.between(0.0, columns), random.between(0.0, rows));
    const Eigen::Vector2d way = random.below(2) * 0.5 * columns * random.vector2();
    const double radius = random.between(1.5, way.isZero() ? 20.0 : 4.0);
    const auto light = static_cast<float>(random.between(0.1, 1.0));
    for (int r = 0; r < rows; ++r) {
      for (int c = 0; c < columns; ++c) {
        const Eigen::Vector2d from = Eigen::Vector2d(c + 0.5, r + 0.5) - a;
        const double along =
            way.isZero() ? 0.0 : std::clamp(from.dot(way) / way.squaredNorm(), 0.0, 1.0);
        if ((from - along * way).norm() < radius) image.at(c, r) = light;
      }
    }
  }
  return image;
}

DesignOptions two_levels(SurfaceModel model, const Image& picture) {
  DesignOptions options = default_design_options(model, picture);
  options.width = 12.0;
  options.focal_length = 36.0;
  options.levels = 2;
  return with_smoothness_applied(options);
}

/// False if a barrier refuses the mesh.
bool is_allowed(const DesignTask& task, const Level& level, const SurfaceMesh& mesh) {
  const LevelProblem problem = make_problem(task, level, mesh.triangle_count());
  GuidedOptimization stage(mesh, problem.setup, problem.target, problem.objective, task.executor);
  return std::isfinite(stage.value(mesh));
}

double least_area(const SurfaceMesh& mesh) {
  double least = mesh.plan_area(0);
  for (Eigen::Index f = 1; f < mesh.triangles.cols(); ++f) {
    least = std::min(least, mesh.plan_area(f));
  }
  return least;
}

TEST(LevelStart, HasNoFoldedAndNoTinyTriangleForAnyPicture) {
  int folded = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    testing::Random random(seed);
    const Image picture = random_scene(random, 46 + random.below(8), 40 + random.below(8));
    DesignOptions options =
        two_levels(random.below(2) == 0 ? SurfaceModel::kFacet : SurfaceModel::kSmooth, picture);
    options.rounds = 1 + random.below(4);
    options.iterations = 1 + random.below(20);
    const RunControl control;
    DesignTask task = make_task(picture, options, Executor::serial(), control);
    ASSERT_EQ(task.levels.size(), 2U);
    const Level fine = task.levels.back();
    task.levels.pop_back();
    Checkpoint state = first_state(task);
    DesignLog log(task, state);
    ASSERT_TRUE(run_levels(task, log, state));

    const SurfaceMesh plain = regrid(state.mesh, task.setup.lens_size, fine.grid);
    if (least_area(plain) <= 0.0) ++folded;
    const SurfaceMesh start = level_start(task, fine, state.mesh);
    EXPECT_EQ(start.grid, fine.grid);
    const double mean = task.setup.lens_size.prod() / static_cast<double>(start.triangle_count());
    EXPECT_GT(least_area(start), 10.0 * kLeastArea * mean);
    EXPECT_TRUE(is_allowed(task, fine, start));
  }
  EXPECT_GT(folded, 0) << "no picture that shows the fault";
}

TEST(LevelStart, ASplineOfASurfaceThatReflectsTotallyIsDrawnBackUntilItDoesNot) {
  const Image picture = testing::spot_picture(24, 20);
  DesignOptions options = two_levels(SurfaceModel::kSpline, picture);
  const RunControl control;
  const DesignTask task = make_task(picture, options, Executor::serial(), control);
  const Level& level = task.levels.back();
  ASSERT_TRUE(level.spline);
  const SurfaceMesh steep = testing::height_field(task.setup.lens_size, task.levels.front().grid,
                                                  [](double x, double) { return 2.0 * x; });
  const SurfaceMesh start = level_start(task, level, steep);
  EXPECT_EQ(start.grid, level.grid);
  EXPECT_TRUE(is_allowed(task, level, start));
  EXPECT_GT(start.vertices.row(2).maxCoeff() - start.vertices.row(2).minCoeff(), 1.0)
      << "no farther than it needs";
}

}  // namespace
}  // namespace lensforge
