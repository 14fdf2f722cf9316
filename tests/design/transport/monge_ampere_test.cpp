// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stop_token>
#include <string>

#include "design/random_input.h"
#include "design/test_setups.h"
#include "design/transport/mesh_fit.h"

namespace lensforge {
namespace {

MongeAmpereOptions thorough() {
  MongeAmpereOptions options;
  options.tolerance = 1e-6;
  options.max_iterations = 4000;
  options.floor = 1e-9;
  return options;
}

MongeAmpereResult solve(const Image& picture, const MongeAmpereOptions& options) {
  return solve_monge_ampere(picture, options, RunControl());
}

/// Brightness 1 + slope·(2x − 1) along a side of unit length.
constexpr double kRamp = 0.6;

Image ramp(int columns, int rows, bool across) {
  Image image(columns, rows);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const double x = across ? (c + 0.5) / columns : (r + 0.5) / rows;
      image.at(c, r) = static_cast<float>(1.0 + kRamp * (2.0 * x - 1.0));
    }
  }
  return image;
}

/// Where the monotone rearrangement sends x: the share of light below y equals x,
/// (1 − k) y + k y² = x.
double rearranged(double x) {
  const double b = 1.0 - kRamp;
  return (-b + std::sqrt(b * b + 4.0 * kRamp * x)) / (2.0 * kRamp);
}

TEST(MongeAmpere, ARampIsRearrangedMonotonely) {
  double worst = 0.0;
  for (const bool across : {true, false}) {
    const Image picture = across ? ramp(48, 20, true) : ramp(20, 48, false);
    const MongeAmpereResult map = solve(picture, thorough());
    ASSERT_TRUE(map.converged);
    for (Eigen::Index i = 0; i < map.displacement.cols(); ++i) {
      const double x = static_cast<double>(across ? i % map.columns : i / map.columns) / 48.0;
      const Eigen::Vector2d move = map.displacement.col(i);
      worst =
          std::max(worst, std::fabs((across ? move.x() : move.y()) - 48.0 * (rearranged(x) - x)));
      ASSERT_NEAR(across ? move.y() : move.x(), 0.0, 1e-6);
    }
  }
  RecordProperty("worst_pixels", std::to_string(worst));
  // The border pixel's density is taken as constant up to the border; displacements reach 3.6.
  EXPECT_LT(worst, 0.04);
}

TEST(MongeAmpere, UniformLightStaysWhereItIs) {
  const MongeAmpereResult map = solve(Image(24, 16, 0.3F), {});
  EXPECT_TRUE(map.converged);
  EXPECT_EQ(map.columns, 25);
  EXPECT_EQ(map.rows, 17);
  ASSERT_EQ(map.displacement.cols(), 25 * 17);
  EXPECT_LT(map.displacement.cwiseAbs().maxCoeff(), 1e-12);
}

TEST(MongeAmpere, NothingCrossesTheBorder) {
  const MongeAmpereResult map = solve(testing::spot_picture(30, 22), {});
  for (int r = 0; r < map.rows; ++r) {
    EXPECT_EQ(map.displacement(0, r * map.columns), 0.0);
    EXPECT_EQ(map.displacement(0, r * map.columns + map.columns - 1), 0.0);
  }
  for (int c = 0; c < map.columns; ++c) {
    EXPECT_EQ(map.displacement(1, c), 0.0);
    EXPECT_EQ(map.displacement(1, (map.rows - 1) * map.columns + c), 0.0);
  }
}

/// Signed area of a cell of nodes after the map.
double mapped_area(const MongeAmpereResult& map, int c, int r) {
  const auto at = [&](int column, int row) -> Eigen::Vector2d {
    return Eigen::Vector2d(column, row) + map.displacement.col(row * map.columns + column);
  };
  const Eigen::Vector2d p = at(c + 1, r + 1) - at(c, r);
  const Eigen::Vector2d q = at(c, r + 1) - at(c + 1, r);
  return 0.5 * (p.x() * q.y() - p.y() * q.x());
}

TEST(MongeAmpere, CellsShrinkAsThePictureIsBright) {
  const Image picture = testing::spot_picture(40, 32);
  const MongeAmpereResult map = solve(picture, thorough());
  ASSERT_TRUE(map.converged);
  const double mean = picture.total() / (40.0 * 32.0);
  double worst = 0.0;
  for (int r = 1; r < 31; ++r) {
    for (int c = 1; c < 39; ++c) {
      const Eigen::Vector2d centre =
          Eigen::Vector2d(c + 0.5, r + 0.5) +
          0.25 * (map.displacement.col(r * 41 + c) + map.displacement.col(r * 41 + c + 1) +
                  map.displacement.col(r * 41 + c + 41) + map.displacement.col(r * 41 + c + 42));
      const auto density = static_cast<double>(
          picture.at(static_cast<int>(centre.x()), static_cast<int>(centre.y())));
      worst = std::max(worst, std::fabs(mapped_area(map, c, r) * density / mean - 1.0));
    }
  }
  RecordProperty("worst_ratio", std::to_string(worst));
  EXPECT_LT(worst, 0.15);
}

TEST(MongeAmpere, BlackPixelsGiveFiniteMonotoneMaps) {
  Image picture(32, 32);
  for (int r = 10; r < 22; ++r) {
    for (int c = 10; c < 22; ++c) picture.at(c, r) = 1.0F;
  }
  const MongeAmpereResult map = solve(picture, {});
  EXPECT_TRUE(map.displacement.allFinite());
  const Eigen::Vector2d corner_cell = map.displacement.col(33 * 8 + 8);
  EXPECT_GT(corner_cell.x(), 1.0);
  EXPECT_GT(corner_cell.y(), 1.0);
}

TEST(MongeAmpere, ReportsThatItHasNotConverged) {
  MongeAmpereOptions options = thorough();
  options.max_iterations = 3;
  const MongeAmpereResult map = solve(testing::spot_picture(30, 22), options);
  EXPECT_FALSE(map.converged);
  EXPECT_EQ(map.iterations, 3);
  EXPECT_GT(map.last_change, options.tolerance);
}

TEST(MongeAmpere, EndsAtOnceWhenAskedToStop) {
  std::stop_source stop;
  int reports = 0;
  const RunControl control(stop.get_token(), [&](const Progress& p) {
    EXPECT_EQ(p.done, ++reports);
    if (reports == 2) stop.request_stop();
  });
  const MongeAmpereResult map =
      solve_monge_ampere(testing::spot_picture(30, 22), thorough(), control);
  EXPECT_TRUE(map.stopped);
  EXPECT_FALSE(map.converged);
  EXPECT_EQ(map.iterations, 2);
}

TEST(MongeAmpere, TwoByTwoPixelsAreEnough) {
  Image picture(2, 2, 0.5F);
  picture.at(0, 0) = 1.0F;
  const MongeAmpereResult map = solve(picture, {});
  EXPECT_TRUE(map.displacement.allFinite());
  EXPECT_LT(map.displacement(0, 4), 0.0);
  EXPECT_LT(map.displacement(1, 4), 0.0);
}

}  // namespace
}  // namespace lensforge
