// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/sampling_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "cam/cam_job.h"
#include "cam/cam_meshes.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::grid_mesh;
using lensforge::testing::TempFolder;

FinishGround ground_of(const Eigen::Vector2d& size) {
  return {{Eigen::Vector2d(0.0, 0.0), size}, 0.2, 0.0};
}

CamOptions with_pitch(double pitch) {
  CamOptions options;
  options.workshop.process.rough.enabled = false;
  options.workshop.process.semi.enabled = false;
  options.workshop.process.finish.pitch = pitch;
  options.remedies = false;
  return options;
}

/// How many nodes lie between two passes.
double nodes_between(const GridWindow& grid, const RasterPlan& plan) {
  const int across = 1 - plan.options.along;
  return plan.pitch / grid.spacing[across];
}

TEST(SamplingGrid, HasAWholeEvenNumberOfNodesAPassAndOneOnEachRim) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> side(2.0, 120.0);
  std::uniform_real_distribution<double> pitch(0.01, 0.2);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector2d size(side(random), side(random));
    CamOptions options = with_pitch(pitch(random));
    options.workshop.process.finish.cross = i % 2 == 0;
    const GridWindow grid = sampling_grid(options, ground_of(size), size);
    for (const RasterPlan& plan : finish_rasters(options, ground_of(size))) {
      const double nodes = nodes_between(grid, plan);
      EXPECT_NEAR(std::remainder(nodes, 2.0), 0.0, 1e-9) << nodes;
      EXPECT_GE(nodes, 2.0 - 1e-9);
    }
    EXPECT_LE(grid.spacing.maxCoeff(), sample_spacing(options) * (1.0 + 1e-12));
    EXPECT_NEAR(grid.x(grid.columns - 1), size.x(), 1e-12 * size.x());
    EXPECT_NEAR(grid.y(grid.rows - 1), size.y(), 1e-12 * size.y());
  }
}

/// A lens as gentle as a designed one: light moves by a few pixels.
Lens gentle_lens() {
  constexpr double kSide = 3.0;
  constexpr int kPixels = 16;
  Lens lens;
  lens.setup.lens_size = lens.setup.image_size = {kSide, kSide};
  lens.setup.pixels = {kPixels, kPixels};
  lens.setup.focal_length = 75.0;
  lens.surface = grid_mesh(25, 25, kSide, kSide, [](double x, double y) {
    constexpr double kTurn = 2.0 * std::numbers::pi;
    return 6.0 + 0.0016 * std::sin(kTurn * x / 1.9 + 0.4) * std::cos(kTurn * y / 2.3) +
           0.05 * std::sin(kTurn * (x + y) / 40.0);
  });
  lens.target = Image(kPixels, kPixels, 1.0F);
  return lens;
}

ReportData cut(const CamOptions& options) {
  const TempFolder folder;
  return make_cut(gentle_lens(), options, folder.path(), Executor::cpu(2), {}).report;
}

class Pitches : public ::testing::TestWithParam<double> {};

/// At 0.045 mm and 0.01 mm between nodes the leakage was twice what it is.
TEST_P(Pitches, HalfTheSpacingPredictsTheSame) {
  CamOptions options = with_pitch(GetParam());
  const ReportData as_is = cut(options);
  options.sample_spacing = 0.5 * sample_spacing(options);
  const ReportData finer = cut(options);
  const PictureQuality& a = as_is.leakage.part().quality;
  const PictureQuality& b = finer.leakage.part().quality;
  EXPECT_NEAR(a.leakage / b.leakage, 1.0, 0.03);
  EXPECT_NEAR(a.metrics.mae / b.metrics.mae, 1.0, 0.03);
  EXPECT_LT(std::abs(as_is.sampling.leakage), 0.05 * b.leakage);
}

INSTANTIATE_TEST_SUITE_P(SamplingGrid, Pitches,
                         ::testing::Values(0.03, 0.036, 0.045, 0.05, 0.06, 0.07, 0.08));

TEST(SamplingGrid, TheErrorOfACoarseGridIsEstimated) {
  CamOptions options = with_pitch(0.1);
  options.polish.sigma = 0.02;
  options.sample_spacing = 0.018;
  const ReportData coarse = cut(options);
  options.sample_spacing = 0.003;
  const double error =
      cut(options).leakage.part().quality.leakage - coarse.leakage.part().quality.leakage;
  EXPECT_GT(coarse.sampling.leakage / error, 0.4);
  EXPECT_LT(coarse.sampling.leakage / error, 2.5);
}

}  // namespace
}  // namespace lensforge
