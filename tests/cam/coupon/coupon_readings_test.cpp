// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <optional>
#include <string>

#include "cam/coupon/coupon.h"
#include "core/error.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::message_of;
using ::testing::StartsWith;

CouponReadings expected() { return expected_readings(coupon_layout(CouponOptions{}), Workshop{}); }

/// A template with every reading filled in as it is expected.
std::string filled_in(std::string text = readings_template(expected())) {
  const std::string comment = "  # expected: about ";
  for (std::size_t at = text.find(comment); at != std::string::npos; at = text.find(comment)) {
    const std::size_t line = text.rfind("\n# ", at) + 1;
    text.erase(at, comment.size());
    text.erase(line, 2);
  }
  return text;
}

std::string refusal(const std::string& text) {
  return message_of<InputError>([&] { parse_readings(text, "m.toml"); });
}

TEST(CouponReadings, TheTemplateIsReadAsHavingNone) {
  EXPECT_EQ(parse_readings(readings_template(expected()), "m.toml").count(), 0);
}

TEST(CouponReadings, TheTemplateIsThatOfEarlierVersions) {
  const CouponReadings sample{
      {{40.0, Reading{39.96, 0.03}}},
      {{0.09, Reading{0.323, 0.003}}},
      {{0.06, Reading{2.26e-3, 1.13e-4}, std::nullopt, Reading{0.1, 0.015}}},
      {632.8e-6, 1.5},
      {}};
  const std::string text = readings_template(sample);
  EXPECT_EQ(text.substr(text.find("\n[light]")), R"(
[light]
wavelength_nm = 632.8
ior = 1.5

# Distance of the marks A and B, centre to centre.
[[mark]]
programmed_mm = 40
# distance_mm =   # expected: about 40
distance_uncertainty_mm = 0.03

# G1: width at the top, before polishing.
[[groove]]
depth_mm = 0.09
# width_mm =   # expected: about 0.323
width_uncertainty_mm = 0.003

# P1: height from valley to crest before and after polishing (Rz of a roughness tester
# across the passes), light of a first order over that of the middle after it.
[[pad]]
pitch_mm = 0.06
# before_um =   # expected: about 2.26
before_uncertainty_um = 0.11
# order_ratio =   # expected: about 0.1
order_ratio_uncertainty = 0.015
)");
}

TEST(CouponReadings, AFilledInTemplateIsReadAsItStands) {
  const CouponReadings wanted = expected();
  const CouponReadings read = parse_readings(filled_in(), "m.toml");
  ASSERT_EQ(read.count(), wanted.count());
  EXPECT_EQ(read.marks[0].programmed, wanted.marks[0].programmed);
  EXPECT_DOUBLE_EQ(read.light.wavelength, wanted.light.wavelength);
  for (std::size_t i = 0; i < wanted.pads.size(); ++i) {
    EXPECT_DOUBLE_EQ(read.pads[i].pitch, wanted.pads[i].pitch);
    // The template shows three digits of what is expected, and two of its uncertainty.
    EXPECT_NEAR(read.pads[i].after->value, wanted.pads[i].after->value,
                5e-3 * wanted.pads[i].after->value);
    EXPECT_NEAR(read.pads[i].after->uncertainty, wanted.pads[i].after->uncertainty,
                0.05 * wanted.pads[i].after->uncertainty);
    EXPECT_EQ(read.pads[i].orders.has_value(), wanted.pads[i].orders.has_value());
  }
  for (std::size_t i = 0; i < wanted.grooves.size(); ++i) {
    EXPECT_NEAR(read.grooves[i].width->value, wanted.grooves[i].width->value, 1e-3);
  }
}

TEST(CouponReadings, TheTemplateSaysWhatWroteIt) {
  EXPECT_THAT(readings_template(expected()), StartsWith("# Readings of a coupon, lensforge "));
}

TEST(CouponReadings, BadValuesAreNamedWithFileKeyAndRule) {
  const std::string groove = "[[groove]]\ndepth_mm = 0.09\nwidth_uncertainty_mm = 0.003\n";
  for (const char* value : {"nan", "inf", "-0.3", "0", "1e9", "\"0.3mm\"", "true"}) {
    EXPECT_THAT(refusal(groove + "width_mm = " + value),
                AllOf(StartsWith("m.toml: groove[0].width_mm: "), HasSubstr("must be")))
        << value;
  }
  EXPECT_THAT(refusal("[[groove]]\ndepth_mm = 0.09\nwidth_mm = 0.3\n"),
              HasSubstr("width_uncertainty_mm: missing: a reading needs its uncertainty"));
  EXPECT_THAT(refusal("[[groove]]\nwidth_mm = 0.3\nwidth_uncertainty_mm = 0.003\n"),
              HasSubstr("depth_mm"));
  EXPECT_THAT(refusal("[[mark]]\nprogrammed_mm = 40\ndistance_mm = 40\n"
                      "distance_uncertainty_mm = 0\n"),
              HasSubstr("mark[0].distance_uncertainty_mm: 0"));
  EXPECT_THAT(refusal("[[pad]]\npitch_mm = -0.1\n"), HasSubstr("pad[0].pitch_mm: -0.1"));
  EXPECT_THAT(refusal("[light]\nwavelength_nm = 0.532\n"), HasSubstr("light.wavelength_nm: 0.532"));
}

/// What a workshop with a roughness asks for.
CouponReadings rough_expected() {
  Workshop shop;
  shop.polish.roughness = 10.0;
  return expected_readings(coupon_layout(CouponOptions{}), shop);
}

TEST(CouponReadings, HazeIsReadAsItStands) {
  const CouponReadings wanted = rough_expected();
  const CouponReadings read = parse_readings(filled_in(readings_template(wanted)), "m.toml");
  ASSERT_EQ(read.haze.size(), 4U);
  EXPECT_EQ(read.count(), wanted.count());
  for (std::size_t i = 0; i < read.haze.size(); ++i) {
    EXPECT_DOUBLE_EQ(read.haze[i].place.angle, wanted.haze[i].place.angle);
    EXPECT_DOUBLE_EQ(read.haze[i].place.solid_angle, wanted.haze[i].place.solid_angle);
    ASSERT_TRUE(wanted.haze[i].ratio && read.haze[i].ratio);
    EXPECT_NEAR(read.haze[i].ratio->value, wanted.haze[i].ratio->value,
                5e-3 * wanted.haze[i].ratio->value);
  }
}

/// A workshop that does not know its roughness is told where to measure.
TEST(CouponReadings, HazeIsAskedForWhereItIsNotKnown) {
  const CouponReadings asked = expected();
  ASSERT_EQ(asked.haze.size(), 4U);
  const std::string text = readings_template(asked);
  EXPECT_THAT(text, HasSubstr("[[haze]]\nangle_deg = 1.4\nsolid_angle_sr = 2.8e-05\n"
                              "# light_ratio =\n# light_ratio_uncertainty =\n"));
  const CouponReadings read = parse_readings(text, "m.toml");
  EXPECT_EQ(read.haze.size(), 4U);
  EXPECT_FALSE(read.haze[0].ratio.has_value());
}

TEST(CouponReadings, BadHazeIsNamedWithFileKeyAndRule) {
  const auto haze = [&](const std::string& angle, const std::string& solid_angle,
                        const std::string& ratio, const std::string& more = "") {
    return refusal("[[haze]]\nangle_deg = " + angle + "\nsolid_angle_sr = " + solid_angle +
                   "\nlight_ratio = " + ratio + "\n" +
                   (more.empty() ? "light_ratio_uncertainty = 1e-6\n" : more));
  };
  for (const char* angle : {"0", "-2", "61", "nan", "\"2\""}) {
    EXPECT_THAT(haze(angle, "3e-5", "1e-5"), HasSubstr("m.toml: haze[0].angle_deg: ")) << angle;
  }
  for (const char* extent : {"0", "28", "inf"}) {
    EXPECT_THAT(haze("2", extent, "1e-5"), HasSubstr("haze[0].solid_angle_sr: ")) << extent;
  }
  for (const char* ratio : {"0", "-1e-5", "1.2", "nan"}) {
    EXPECT_THAT(haze("2", "3e-5", ratio), HasSubstr("haze[0].light_ratio: ")) << ratio;
  }
  EXPECT_THAT(
      haze("2", "2.8e-5", "0.01"),
      HasSubstr("m.toml: haze[0].light_ratio: 0.01: must be at most 0.00269 at this angle"));
  EXPECT_THAT(haze("2", "3e-5", "1e-5", "light_ratio_uncertainty = 0\n"),
              HasSubstr("haze[0].light_ratio_uncertainty: 0"));
  EXPECT_THAT(haze("2", "3e-5", "1e-5", "\n"), HasSubstr("a reading needs its uncertainty"));
  EXPECT_THAT(haze("2", "3e-5", "1e-5", "ratio = 1\n"), HasSubstr("haze[0]"));
  EXPECT_THAT(refusal("[[haze]]\nangle_deg = 2\n"), HasSubstr("solid_angle_sr"));
}

TEST(CouponReadings, WhatItDoesNotKnowIsRefused) {
  EXPECT_THAT(refusal("[[pad]]\npitch_mm = 0.1\nafter_mm = 0.001\n"),
              HasSubstr("pad[0].after_mm: 0.001: a file of readings: unknown key"));
  EXPECT_THAT(refusal("[polish]\nsigma = 0.03\n"), HasSubstr("polish"));
  EXPECT_THAT(refusal("[[pad]\n"), HasSubstr("not TOML"));
  EXPECT_THAT(refusal("pad = 3\n"), HasSubstr("pad: 3: must be an array"));
}

TEST(CouponReadings, AreLimitedInNumber) {
  std::string text;
  for (int i = 0; i < 101; ++i) text += "[[groove]]\ndepth_mm = 0.1\n";
  EXPECT_THAT(refusal(text), HasSubstr("at most 100"));
}

}  // namespace
}  // namespace lensforge
