// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/chart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "cam/check/check_job.h"
#include "cam/check/virtual_wall.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/temp_folder.h"

namespace lensforge::chart_test {
namespace {

using lensforge::testing::TempFolder;
using ::testing::HasSubstr;
using virtual_wall::Camera;
using virtual_wall::WallLight;

constexpr double kBar = 2.2;  ///< mm, beside a picture of 4 mm.

/// A chart as it is printed, on the wall beside a picture.
class ChartTest : public ::testing::Test {
 protected:
  ChartTest() { write_whole_file(folder_ / "chart.svg", chart_drawing(kBar)); }

  [[nodiscard]] WallLight::Sheet sheet(const Eigen::Vector2d& middle, double turn = 0.0) const {
    return virtual_wall::printed_chart(folder_ / "chart.svg", kBar, middle, turn);
  }
  /// With room for a chart on the right, in a room with some light.
  [[nodiscard]] static Camera camera(std::uint64_t seed) {
    Camera camera = virtual_wall::any_camera(seed);
    camera.columns = 400;
    camera.rows = 300;
    camera.away *= 1.6;
    camera.ambient += 0.02;
    camera.aim = {0.45, 0.0};
    return camera;
  }
  /// Of a bright square and charts.
  [[nodiscard]] static Image shot(const std::vector<WallLight::Sheet>& sheets,
                                  const Camera& camera) {
    constexpr int kSide = 60;
    WallLight wall{Image(kSide, kSide), {6.0, 6.0}, sheets};
    for (int k = 0; k < 20 * 20; ++k) wall.light.at(20 + k % 20, 20 + k / 20) = 1.0F;
    return virtual_wall::photograph(wall, {4.0, 4.0}, camera);
  }
  static int marks(const Image& light) {
    const auto chart = find_chart(light, "wall.jpg");
    return chart ? chart->marks() : 0;
  }

  TempFolder folder_;
};

/// At any angle, up to 30° beside the wall's normal, distorted, in dim light: the corners are those
/// of one perspective to a tenth of a pixel.
TEST_F(ChartTest, IsFoundFromAnySide) {
  for (const std::uint64_t seed : {1U, 5U}) {
    SCOPED_TRACE(seed);
    const double turn = std::numbers::pi / 3.0 * static_cast<double>(seed);
    const auto chart = find_chart(shot({sheet({4.1, 0.1}, turn)}, camera(seed)), "wall.jpg");
    ASSERT_TRUE(chart);
    EXPECT_EQ(chart->marks(), 4);
    EXPECT_LE(chart->error, 0.11);
  }
}

TEST_F(ChartTest, MarksInSightAreEnough) {
  Camera one = camera(3);
  one.aim.x() = -0.3;
  EXPECT_EQ(marks(shot({sheet({4.1, 0.1})}, one)), 2);
}

TEST_F(ChartTest, MirroredIsNone) {
  const Image light = shot({sheet({4.1, 0.1})}, camera(2));
  Image mirrored(light.columns(), light.rows());
  for (int r = 0; r < light.rows(); ++r) {
    for (int c = 0; c < light.columns(); ++c) {
      mirrored.at(c, r) = light.at(light.columns() - 1 - c, r);
    }
  }
  EXPECT_EQ(marks(light), 4);
  EXPECT_EQ(marks(mirrored), 0);
}

TEST_F(ChartTest, TwoAreRefused) {
  const Image light = shot({sheet({4.1, 0.1}), sheet({-0.3, 0.1}, 0.2)}, camera(2));
  try {
    find_chart(light, "wall.jpg");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "wall.jpg: shows two charts; leave one on the wall");
  }
}

/// A lamp that is nearer makes the picture larger; without its size it looks like a wall that is
/// nearer.
TEST_F(ChartTest, TellsTheLampsDistance) {
  const Lens lens = virtual_wall::wavy_lens();
  const CamOptions options = virtual_wall::light_by(LightModel::kRays);
  const Executor executor = Executor::cpu(2);
  virtual_wall::Fault fault;
  fault.vergence = 0.03;
  WallLight wall = virtual_wall::Workshop(lens, options, executor).light(fault);
  wall.sheets.push_back(sheet({4.1, 0.1}));
  const Image seen = virtual_wall::photograph(wall, lens.setup.image_size, camera(4));
  Photograph photo = photograph(seen, {}, "wall.jpg");
  photo.chart = find_chart(seen, "wall.jpg");
  ASSERT_TRUE(photo.chart);
  photo.chart->bar = kBar;
  const CheckResult result = check_photograph(lens, options, photo, executor, {});
  ASSERT_EQ(result.fit.found.size(), 1U) << verdict_of(result, lens, options);
  EXPECT_EQ(result.fit.found.front().deviation, Deviation::kLampDistance);
  EXPECT_NEAR(result.fit.found.front().value, fault.vergence, 0.002);
  ASSERT_TRUE(result.chart);
  EXPECT_NEAR(result.chart->width, 4.0 * (1.0 + fault.vergence), 3.0 * result.chart->error);
  EXPECT_LT(result.chart->error, 0.02);
  const nlohmann::json json = check_json(result, lens, options);
  EXPECT_EQ(json["chart"]["marks"], 4);
  EXPECT_EQ(json["chart"]["planned"], 4.0);
  EXPECT_THAT(json["verdict"], HasSubstr("by the chart the picture is 4.1"));
}

}  // namespace
}  // namespace lensforge::chart_test
