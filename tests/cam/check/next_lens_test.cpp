// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "cam/check/check_job.h"
#include "cam/check/virtual_wall.h"
#include "core/error.h"
#include "core/temp_folder.h"

namespace lensforge::next_lens_test {
namespace {

using lensforge::testing::read_bytes;
using lensforge::testing::TempFolder;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

FoundCause found(Deviation deviation, double value, double error) {
  FoundCause cause;
  cause.deviation = deviation;
  cause.value = value;
  cause.error = error;
  return cause;
}

class NextLensTest : public ::testing::Test {
 protected:
  [[nodiscard]] NextLens next(const std::vector<FoundCause>& causes) const {
    CauseFit fit;
    fit.found = causes;
    return next_lens(fit, lens_, options_);
  }

  Lens lens_ = virtual_wall::wavy_lens();
  CamOptions options_ = virtual_wall::light_by(LightModel::kRays);
};

TEST_F(NextLensTest, TheWorkshopLearnsPolishAndPitchError) {
  options_.workshop.polish.sigma = 0.02;
  options_.workshop.process.finish.pitch_error = 0.001;
  const NextLens learnt =
      next({found(Deviation::kPolish, std::log(1.5), 0.02), found(Deviation::kPitch, 0.004, 1e-4)});
  Workshop expected = options_.workshop;
  expected.polish.sigma = 0.03;
  expected.process.finish.pitch_error = 0.005;
  EXPECT_EQ(learnt.workshop, expected);
  ASSERT_EQ(learnt.values.size(), 2U);
  EXPECT_EQ(learnt.values[0].key, "polish.sigma");
  EXPECT_NEAR(learnt.values[0].uncertainty, 6e-4, 1e-9);
  EXPECT_EQ(learnt.values[1].key, "finish.pitch_error");
  EXPECT_THAT(words_of(learnt.options), IsEmpty());
}

/// Where the wall stands and how wide the lamp is are a design's own.
TEST_F(NextLensTest, TheDesignLearnsWallAndLamp) {
  const double angle = lamp_angle(lens_.setup);
  const NextLens learnt = next({found(Deviation::kDistance, 0.03, 0.002),
                                found(Deviation::kLampSize, 3.0 * angle * angle, 1e-6)});
  EXPECT_EQ(learnt.workshop, options_.workshop);
  ASSERT_EQ(learnt.options.size(), 2U);
  EXPECT_EQ(learnt.options[0].name, "--focal");
  EXPECT_NEAR(std::stod(learnt.options[0].value), 16.0 + 0.03 * wall_distance(lens_.setup), 1e-3);
  EXPECT_TRUE(learnt.options[0].value.ends_with("mm"));
  EXPECT_EQ(learnt.options[1].name + " " + learnt.options[1].value, "--source-angle 10");
  // That of a lamp with a place is a width.
  lens_.setup.lamp = PointSource{{2.0, 2.0, -100.0}, Emission::kIsotropic};
  lens_.setup.extent.width = 0.5;
  EXPECT_EQ(words_of(next({found(Deviation::kLampSize, 3.0 * 2.5e-5, 1e-6)}).options),
            "--source-size 1mm");
}

/// A tilted wall is set straight, and what may be another cause is not designed for.
TEST_F(NextLensTest, LearnsNothingOfOtherCauses) {
  FoundCause far = found(Deviation::kDistance, 0.03, 0.002);
  far.alternatives = {Deviation::kIndex};
  const NextLens learnt =
      next({far, found(Deviation::kTiltX, 0.05, 0.002), found(Deviation::kHaze, 0.1, 0.002)});
  EXPECT_EQ(learnt.workshop, options_.workshop);
  EXPECT_THAT(learnt.values, IsEmpty());
  EXPECT_THAT(words_of(learnt.options), IsEmpty());
}

TEST_F(NextLensTest, TheWorkshopsFileKeepsItsComments) {
  const TempFolder folder;
  const std::string text = "# Anna's mill\n[polish]\nsigma = 0.02  # a guess\n";
  options_.workshop = parse_workshop(text, "mine");
  const NextLens learnt = next({found(Deviation::kPolish, std::log(1.5), 0.02)});
  write_workshop(learnt, text, "wall.jpg", folder / "shop.toml");
  const std::string once = read_bytes(folder / "shop.toml");
  EXPECT_THAT(once, HasSubstr(" to wall.jpg:\n#   polish.sigma = 0.03 +- 0.0006\n# Anna's mill\n"
                              "[polish]\nsigma = 0.03  # a guess\n"));
  EXPECT_EQ(read_workshop(folder / "shop.toml"), learnt.workshop);
  write_workshop(learnt, once, "wall.jpg", folder / "shop.toml");
  EXPECT_EQ(read_bytes(folder / "shop.toml"), once);
}

/// A photograph may name more than a workshop can have.
TEST_F(NextLensTest, AValueBeyondTheWorkshopsLimitsIsNotWritten) {
  const TempFolder folder;
  options_.workshop.process.finish.pitch_error = 0.018;
  const NextLens learnt = next({found(Deviation::kPitch, 0.004, 1e-4)});
  try {
    write_workshop(learnt, "", "wall.jpg", folder / "shop.toml");
    ADD_FAILURE() << "is written";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("finish.pitch_error"));
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "shop.toml"));
}

}  // namespace
}  // namespace lensforge::next_lens_test
