// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "cam/cam.h"
#include "cam/cam_meshes.h"
#include "cam/plan/finishing.h"
#include "core/temp_folder.h"

namespace lensforge::sampling_test {
namespace {

using lensforge::testing::grid_mesh;
using lensforge::testing::TempFolder;

CamOptions with_pitch(double pitch) {
  CamOptions options;
  options.workshop.process.rough.enabled = false;
  options.workshop.process.semi.enabled = false;
  options.workshop.process.finish.pitch = pitch;
  options.remedies = false;
  return options;
}

/// A lens as gentle as a designed one: light moves by a few pixels.
Lens gentle_lens() {
  constexpr double kSide = 2.0;
  constexpr int kPixels = 12;
  Lens lens;
  lens.setup.lens_size = lens.setup.image_size = {kSide, kSide};
  lens.setup.pixels = {kPixels, kPixels};
  lens.setup.focal_length = 75.0;
  lens.surface = grid_mesh(17, 17, kSide, kSide, [](double x, double y) {
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

/// With sums that do not tell where crests run, the leakage at 0.045 mm moves by 12 %.
TEST_P(Pitches, HalfTheSpacingPredictsTheSame) {
  CamOptions options = with_pitch(GetParam());
  const ReportData as_is = cut(options);
  const FinishGround ground = unknown_ground(options, gentle_lens().setup);
  options.sample_spacing = 0.5 * sample_spacing(options, passes_on_lens(options, ground));
  const ReportData finer = cut(options);
  const PictureQuality& a = as_is.leakage.part().quality;
  const PictureQuality& b = finer.leakage.part().quality;
  EXPECT_NEAR(a.leakage / b.leakage, 1.0, 0.03);
  EXPECT_NEAR(a.metrics.mae / b.metrics.mae, 1.0, 0.03);
  EXPECT_NEAR(as_is.sampling.leakage, b.leakage - a.leakage, 0.01 * b.leakage);
}

INSTANTIATE_TEST_SUITE_P(Sampling, Pitches,
                         ::testing::Values(0.03, 0.036, 0.045, 0.05, 0.06, 0.07, 0.08));

TEST(Sampling, TheErrorOfACoarseGridIsEstimated) {
  CamOptions options = with_pitch(0.1);
  options.workshop.polish.sigma = 0.02;
  options.sample_spacing = 0.018;
  const ReportData coarse = cut(options);
  options.sample_spacing = 0.006;
  const double error =
      cut(options).leakage.part().quality.leakage - coarse.leakage.part().quality.leakage;
  EXPECT_GT(coarse.sampling.leakage / error, 0.4);
  EXPECT_LT(coarse.sampling.leakage / error, 2.5);
}

}  // namespace
}  // namespace lensforge::sampling_test
