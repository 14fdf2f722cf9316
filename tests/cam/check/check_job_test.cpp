// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/check_job.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "cam/check/virtual_wall.h"
#include "core/temp_folder.h"

namespace lensforge::check_job_test {
namespace {

using lensforge::testing::read_bytes;
using lensforge::testing::TempFolder;
using ::testing::HasSubstr;
using virtual_wall::Fault;

/// What `check` says of a virtual photograph.
class CheckJob : public ::testing::Test {
 protected:
  [[nodiscard]] CheckResult check(const Fault& fault, std::uint64_t seed) const {
    virtual_wall::Camera camera = virtual_wall::any_camera(seed);
    camera.yaw *= 0.5;
    const virtual_wall::Workshop workshop(lens_, options_, executor_);
    const Image seen =
        virtual_wall::photograph(workshop.light(fault), lens_.setup.image_size, camera);
    return check_photograph(lens_, options_, photograph(seen, {}, "wall.jpg"), executor_, {});
  }

  Lens lens_ = virtual_wall::wavy_lens();
  CamOptions options_ = virtual_wall::light_by(LightModel::kRays);
  Executor executor_ = Executor::cpu(2);
};

TEST_F(CheckJob, NamesNothingWhereNothingIsWrong) {
  const CheckResult result = check({}, 3);
  EXPECT_TRUE(result.part) << result.fault;
  EXPECT_TRUE(result.fit.found.empty()) << verdict_of(result, lens_, options_);
  // The photograph is that of the forecast, not of the even target.
  EXPECT_LT(result.to_forecast.metrics.mae, 0.02);
  EXPECT_GT(result.to_target.metrics.mae, 2.0 * result.to_forecast.metrics.mae);
  // It would have shown a lamp of twice the width.
  const double angle = lamp_angle(lens_.setup);
  EXPECT_LT(result.fit.errors[index_of(Deviation::kLampSize)], angle * angle);
}

TEST_F(CheckJob, NamesTheLampAndWritesIt) {
  Fault fault;
  fault.lamp = 1.0;
  const CheckResult result = check(fault, 4);
  ASSERT_FALSE(result.fit.found.empty());
  const FoundCause& lamp = result.fit.found.front();
  ASSERT_EQ(lamp.deviation, Deviation::kLampSize) << verdict_of(result, lens_, options_);
  const double angle = lamp_angle(lens_.setup);
  EXPECT_NEAR(std::sqrt(angle * angle + lamp.value), 2.0 * angle, 0.15 * 2.0 * angle);
  EXPECT_LT(result.fit.residual, 0.7 * result.fit.unexplained);
  const TempFolder folder;
  EXPECT_EQ(write_check(result, lens_, options_, folder.path()).size(), kCheckFiles.size());
  const auto json = nlohmann::json::parse(read_bytes(folder / check_file::kJson));
  EXPECT_EQ(json["causes"][0]["cause"], "lamp_size");
  EXPECT_NEAR(json["causes"][0]["planned"], 5.0, 1e-9);
  EXPECT_EQ(json["measured"]["lamp_size"]["unit"], "mrad");
  EXPECT_THAT(read_bytes(folder / check_file::kReport), HasSubstr("Likeliest: the lamp is"));
}

/// To first order they are the same: seven degrees are enough for what they differ by.
TEST_F(CheckJob, TellsTheTiltOfThePartFromTheWalls) {
  Fault fault;
  fault.part_tilt_y = 0.12;
  const CheckResult result = check(fault, 4);
  ASSERT_EQ(result.fit.found.size(), 1U) << verdict_of(result, lens_, options_);
  const FoundCause& tilt = result.fit.found.front();
  EXPECT_EQ(tilt.deviation, Deviation::kPartTiltY) << verdict_of(result, lens_, options_);
  EXPECT_NEAR(tilt.value, 0.12, 0.01);
  EXPECT_TRUE(tilt.alternatives.empty());
}

/// Waves blur by three quarters of a pixel, which rays have to explain by something.
TEST_F(CheckJob, DiffractionIsNoFault) {
  lens_.setup.extent.width = 0.0;
  options_.light = LightModel::kWaves;
  const CheckResult result = check({}, 3);
  EXPECT_TRUE(result.by_waves);
  EXPECT_TRUE(result.fit.found.empty()) << verdict_of(result, lens_, options_);
  EXPECT_LT(result.fit.systematic, kMostSystematic);
}

/// A ball so far off that its scallops have little in common with what the derivatives tell.
TEST_F(CheckJob, NamesABallThatIsFarOffWhereScallopsShow) {
  options_.workshop.process.finish.pitch = 0.12;
  Fault fault;
  fault.ball = 0.2;
  const CheckResult result = check(fault, 4);
  ASSERT_EQ(result.fit.found.size(), 1U) << verdict_of(result, lens_, options_);
  EXPECT_EQ(result.fit.found.front().deviation, Deviation::kBall);
  EXPECT_NEAR(result.fit.found.front().value, 0.2, 0.006);
  EXPECT_LT(result.fit.systematic, kMostSystematic);
}

TEST_F(CheckJob, TellsWhereNoCauseExplainsWhatIsSeen) {
  CheckResult result;
  result.fit.systematic = 0.9 * kMostSystematic;
  EXPECT_EQ(verdict_of(result, lens_, options_), "Nothing is wrong that shows in this photograph");
  result.fit.systematic = 0.0333;
  EXPECT_THAT(verdict_of(result, lens_, options_), HasSubstr("no cause explains: 0.0333 of"));
  result.fit.found = {{Deviation::kDistance, 0.05, 0.005, 100.0, {}}};
  EXPECT_THAT(verdict_of(result, lens_, options_),
              HasSubstr("move it nearer; that does not explain all, 0.0333 of"));
}

/// Each in the words of the one who has to mend it.
TEST_F(CheckJob, WordsSayWhatToDo) {
  const auto words = [&](Deviation deviation, double value) {
    FoundCause cause;
    cause.deviation = deviation;
    cause.value = value;
    cause.error = 0.1 * std::abs(value);
    return words_of(cause, lens_, options_);
  };
  EXPECT_EQ(words(Deviation::kDistance, 0.05),
            "the wall is 0.80 ± 0.08 mm too far: move it nearer");
  EXPECT_THAT(words(Deviation::kTiltX, 0.1), HasSubstr("move its upper edge nearer"));
  EXPECT_THAT(words(Deviation::kPartTiltX, 0.1), HasSubstr("turn its lower edge towards the wall"));
  EXPECT_THAT(words(Deviation::kPartTiltY, 0.1), HasSubstr("turn its left edge towards the wall"));
  EXPECT_THAT(words(Deviation::kBacklash, 0.02), HasSubstr("has 20 ± 2 µm of backlash: let"));
  EXPECT_THAT(words(Deviation::kBacklash, -0.02), HasSubstr("let the controller compensate less"));
  EXPECT_THAT(words(Deviation::kLampDistance, 0.1), HasSubstr("instead of far away"));
  EXPECT_THAT(words(Deviation::kPolish, 0.3), HasSubstr("polish less"));
  EXPECT_THAT(words(Deviation::kHaze, 0.1), HasSubstr("10.0 ± 1.0 % of the light"));
}

}  // namespace
}  // namespace lensforge::check_job_test
