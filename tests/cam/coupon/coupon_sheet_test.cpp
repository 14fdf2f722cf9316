// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <string>

#include "cam/coupon/coupon_job.h"

namespace lensforge {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

CouponSheet sheet_of(const CouponOptions& options) {
  CouponSheet sheet;
  sheet.layout = coupon_layout(options);
  sheet.expected = expected_readings(sheet.layout, options.workshop);
  sheet.known = expected_fit(sheet.expected, options.workshop);
  sheet.tool = "T1";
  sheet.files = "coupon.ngc";
  sheet.minutes = 4.0;
  sheet.thickness = options.thickness;
  return sheet;
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

TEST(CouponSheet, HasEveryReadingThatTheTemplateHas) {
  for (const double roughness : {0.0, 10.0}) {
    CouponOptions options;
    options.workshop.polish.roughness = roughness;
    const CouponSheet sheet = sheet_of(options);
    const std::string page = coupon_sheet(sheet);
    const std::string file = readings_template(sheet.expected);
    for (const char* key :
         {"distance_mm", "width_mm", "before_um", "after_um", "order_ratio", "light_ratio"}) {
      EXPECT_EQ(count_of(page, std::string("<code>") + key + "</code>"),
                count_of(file, std::string("# ") + key + " ="))
          << key;
    }
  }
}

TEST(CouponSheet, TellsHowWellHazeWillBeKnownWhereItIsExpected) {
  CouponOptions options;
  EXPECT_THAT(coupon_sheet(sheet_of(options)), Not(HasSubstr("roughness to")));
  options.workshop.polish.roughness = 10.0;
  EXPECT_THAT(coupon_sheet(sheet_of(options)), HasSubstr("roughness to "));
}

TEST(CouponSheet, NeedsNothingFromElsewhere) {
  const std::string page = coupon_sheet(sheet_of({}));
  for (const char* foreign : {"http", "src=", "href=", "@import", "<script", "{{"}) {
    EXPECT_THAT(page, Not(HasSubstr(foreign)));
  }
}

TEST(CouponSheet, WhatTheUserNamedIsEscaped) {
  CouponSheet sheet = sheet_of({});
  sheet.tool = "<b>ball</b>";
  sheet.warnings = {"touches 'vice & jaw'"};
  const std::string page = coupon_sheet(sheet);
  EXPECT_THAT(page, HasSubstr("&lt;b&gt;ball"));
  EXPECT_THAT(page, HasSubstr("vice &amp; jaw"));
}

TEST(CouponSheet, TheDrawingNamesEveryFeatureEitherWayRound) {
  for (const PassAxis along : {PassAxis::kX, PassAxis::kY}) {
    CouponOptions options;
    options.workshop.process.finish.along = along;
    const std::string drawing = coupon_drawing(coupon_layout(options));
    for (const char* name : {"A", "B", "G1", "G2", "G3", "G4", "G5"}) {
      EXPECT_THAT(drawing, HasSubstr(std::string(">") + name + "</text>"));
    }
    for (const char* pad :
         {">P1", ">P2", ">P3", ">P4", ">P5", "0.135</text>", ">F", "A–B 40</text>"}) {
      EXPECT_THAT(drawing, HasSubstr(pad));
    }
  }
}

TEST(CouponSheet, RipplesThatNoTesterReadsAreNotAskedFor) {
  CouponOptions options;
  options.workshop.polish.sigma = 0.03;
  for (Tool& tool : options.workshop.tools) tool.diameter = 1.0;
  const CouponReadings expected = expected_readings(coupon_layout(options), options.workshop);
  EXPECT_FALSE(expected.pads.front().after.has_value()) << "0.05 µm";
  EXPECT_TRUE(expected.pads.back().after.has_value());
  EXPECT_TRUE(expected.pads.front().orders.has_value()) << "a laser tells more";
}

}  // namespace
}  // namespace lensforge
