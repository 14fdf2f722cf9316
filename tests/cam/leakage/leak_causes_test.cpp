// SPDX-License-Identifier: GPL-3.0-or-later
// Whole cuts of a small lens, from the plan to the light, in which one cause of leaking after the
// other is made smaller.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "cam/cam.h"
#include "cam/cam_meshes.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::TempFolder;

/// Waves with a groove, whose light leaves a gap on the wall.
Lens grooved_lens() {
  Lens lens;
  lens.model = SurfaceModel::kSmooth;
  lens.setup.lens_size = {1.0, 0.6};
  lens.setup.image_size = {3.0, 1.5};
  lens.setup.image_origin = {-1.0, -0.45};
  lens.setup.pixels = {40, 20};
  lens.setup.focal_length = 8.0;
  lens.surface = testing::grid_mesh(21, 13, 1.0, 0.6, [](double x, double y) {
    return 6.0 + 0.15 * std::abs(x - 0.53 + 0.2 * y) + 0.01 * std::sin(4.0 * x) * std::cos(5.0 * y);
  });
  lens.target = Image(40, 20, 1.0F);
  return lens;
}

/// Fine in everything, polished by nothing.
CamOptions fine() {
  CamOptions options;
  options.surface = SurfaceModel::kFacet;
  options.workshop.process.rough.enabled = false;
  options.workshop.process.semi.enabled = false;
  options.workshop.process.finish.pitch = 0.03;
  options.workshop.polish.sigma = 0.0;
  options.sample_spacing = 0.01;
  options.remedies = false;
  return options;
}

double part_of(const std::string& cause, const CamOptions& options) {
  const TempFolder folder;
  const LeakageResult leakage =
      make_cut(grooved_lens(), options, folder.path(), Executor::cpu(2), {}).report.leakage;
  double sum = 0.0;
  double wanted = NAN;
  for (const CausePart& part : leakage.parts) {
    sum += part.leakage;
    if (part.cause == cause) wanted = part.leakage;
  }
  EXPECT_NEAR(sum, leakage.part().quality.leakage, 1e-12);
  return wanted;
}

/// Each of `sizes` has to leave less of the cause's part than three quarters of what the one before
/// leaves.
void expect_vanishing(const std::string& cause, const std::vector<double>& sizes,
                      const std::function<void(CamOptions&, double)>& set) {
  std::vector<double> parts;
  for (const double size : sizes) {
    CamOptions options = fine();
    set(options, size);
    parts.push_back(std::abs(part_of(cause, options)));
  }
  for (std::size_t i = 1; i < parts.size(); ++i) {
    EXPECT_LT(parts[i], 0.75 * parts[i - 1]) << cause << " " << sizes[i];
  }
}

TEST(LeakCauses, CreaseRoundingVanishesWithTheBall) {
  expect_vanishing(leak_cause::kCrease, {0.4, 0.2, 0.1}, [](CamOptions& o, double diameter) {
    o.workshop.tools.back() = resized(o.workshop.tools.back(), diameter);
  });
}

TEST(LeakCauses, ScallopsVanishWithThePitch) {
  expect_vanishing(leak_cause::kScallop, {0.06, 0.02}, [](CamOptions& o, double pitch) {
    o.workshop.process.finish.pitch = pitch;
    o.sample_spacing = pitch / 6.0;
  });
}

TEST(LeakCauses, ChordsVanishWithTheTolerances) {
  expect_vanishing(leak_cause::kChord, {0.004, 0.001}, [](CamOptions& o, double tolerance) {
    o.workshop.process.finish.tolerance = tolerance;
    o.workshop.process.finish.slope_tolerance = 2.0 * tolerance;
    o.decimals = 6;
  });
}

/// Unpolished, nodes on the ridges between rows fall to either side by rounding. With five
/// decimals, as with four, directions are aimed at more coarsely (aimed_slope()), which leaves
/// little to round.
TEST(LeakCauses, DecimalsVanishWithTheLastDigit) {
  expect_vanishing(leak_cause::kDecimals, {4, 6}, [](CamOptions& o, double decimals) {
    o.decimals = static_cast<int>(decimals);
    o.sample_spacing = 0.005;
    o.workshop.polish.sigma = 0.02;
  });
}

TEST(LeakCauses, PolishVanishesWithItsGaussian) {
  expect_vanishing(leak_cause::kPolish, {0.08, 0.02},
                   [](CamOptions& o, double sigma) { o.workshop.polish.sigma = sigma; });
}

}  // namespace
}  // namespace lensforge
