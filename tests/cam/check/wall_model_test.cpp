// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/wall_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "cam/check/virtual_wall.h"

namespace lensforge::wall_model_test {
namespace {

using virtual_wall::Fault;

constexpr int kFine = 5;

/// Light of the lens's pixels, those beside its picture included, of a picture with `fine` times
/// as many and `margin` of the lens's pixels around.
Eigen::VectorXd in_pixels(const Image& picture, int margin, int fine, int pixels) {
  constexpr int kAround = 2;
  const int side = pixels + 2 * kAround;
  Eigen::VectorXd light = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(side) * side);
  for (int r = 0; r < side * fine; ++r) {
    for (int c = 0; c < side * fine; ++c) {
      const int around = (margin - kAround) * fine;
      light[(r / fine) * side + c / fine] +=
          picture.at(c + around, r + around) / (1.0 * fine * fine);
    }
  }
  return light;
}

struct FaultCase {
  std::string name;
  Fault fault;
  Deviation deviation;
  double value = 0.0;
};

std::vector<FaultCase> fault_cases(const Lens& lens) {
  std::vector<FaultCase> cases;
  const auto add = [&](const char* name, double Fault::*what, double by, Deviation d,
                       double value) {
    Fault fault;
    fault.*what = by;
    cases.push_back({name, fault, d, value});
  };
  const double lamp = lamp_angle(lens.setup);
  add("distance", &Fault::distance, 0.03, Deviation::kDistance, 0.03);
  add("tilt about x", &Fault::tilt_x, 0.2, Deviation::kTiltX, 0.2);
  add("tilt about y", &Fault::tilt_y, -0.2, Deviation::kTiltY, -0.2);
  add("part's tilt about x", &Fault::part_tilt_x, 0.15, Deviation::kPartTiltX, 0.15);
  add("part's tilt about y", &Fault::part_tilt_y, -0.15, Deviation::kPartTiltY, -0.15);
  add("lamp", &Fault::lamp, 0.5, Deviation::kLampSize, 1.25 * lamp * lamp);
  add("index", &Fault::index, 0.01, Deviation::kIndex, 0.01 / (lens.setup.ior - 1.0));
  add("polish", &Fault::sigma, 0.35, Deviation::kPolish, std::log(1.35));
  add("ball", &Fault::ball, 0.3, Deviation::kBall, 0.3);
  add("pitch error", &Fault::pitch_error, 0.005, Deviation::kPitch, 0.005);
  add("backlash", &Fault::backlash, 0.01, Deviation::kBacklash, 0.01);
  add("haze", &Fault::haze, 0.12, Deviation::kHaze, 0.12);
  return cases;
}

/// Without a camera: what a fault changes on the virtual wall, and what the model says of it. The
/// lamp is another on either side: a convolution here, many points there.
TEST(WallModel, FollowsEveryFault) {
  const Lens lens = virtual_wall::wavy_lens();
  const CamOptions options = virtual_wall::light_by(LightModel::kRays);
  const Executor executor = Executor::cpu(2);
  const virtual_wall::Workshop workshop(lens, options, executor);
  const WallModel model(lens, options, kFine, executor, {});
  ASSERT_TRUE(model.has_part()) << model.fault();
  const int pixels = lens.setup.pixels.x();
  const auto wall = [&](const Fault& fault) {
    const Image light = workshop.light(fault).light;
    return in_pixels(light, (light.columns() / virtual_wall::kFine - pixels) / 2,
                     virtual_wall::kFine, pixels);
  };
  const auto predicted = [&](const Deviations& deviations) {
    return in_pixels(model.picture(deviations), model.margin(), kFine, pixels);
  };
  const Eigen::VectorXd even = wall({});
  const Eigen::VectorXd forecast = predicted(Deviations::Zero());
  EXPECT_LT((even - forecast).norm(), 0.01 * even.norm());
  for (const FaultCase& one : fault_cases(lens)) {
    Deviations deviations = Deviations::Zero();
    deviations[index_of(one.deviation)] = one.value;
    const Eigen::VectorXd change = wall(one.fault) - even;
    const Eigen::VectorXd model_change = predicted(deviations) - forecast;
    EXPECT_GT(change.norm(), 0.003 * even.norm()) << one.name;
    EXPECT_LT((model_change - change).norm(), 0.15 * change.norm()) << one.name;
  }
}

}  // namespace
}  // namespace lensforge::wall_model_test
