// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "core/image/color.h"
#include "core/image/transfer.h"

namespace lensforge {
namespace {

using Curve = ColorSpace::Curve;

TEST(ColorSpace, KnowsOpenImageIoNamesInAnyCase) {
  EXPECT_EQ(parse_color_space("sRGB")->curve, Curve::kSrgb);
  EXPECT_EQ(parse_color_space("linear")->curve, Curve::kLinear);
  EXPECT_EQ(parse_color_space("Linear")->curve, Curve::kLinear);
  EXPECT_EQ(parse_color_space("scene_linear")->curve, Curve::kLinear);
  EXPECT_EQ(parse_color_space("Rec709")->curve, Curve::kRec709);
  EXPECT_EQ(*parse_color_space("Gamma2.2"), (ColorSpace{Curve::kGamma, 2.2}));
  EXPECT_EQ(*parse_color_space("GammaCorrected1.8"), (ColorSpace{Curve::kGamma, 1.8}));
  EXPECT_EQ(parse_color_space("Gamma1.0")->curve, Curve::kLinear);
}

TEST(ColorSpace, OtherNamesAreUnknown) {
  for (const char* name : {"", "AdobeRGB", "Gamma", "Gammax", "Gamma2.2x", "Gamma-1", "Gamma0"}) {
    EXPECT_FALSE(parse_color_space(name).has_value()) << name;
  }
}

TEST(ColorSpace, EveryCurveKeepsBlackAndWhite) {
  for (const ColorSpace& space :
       {ColorSpace{Curve::kLinear, 1.0}, ColorSpace{Curve::kSrgb, 1.0},
        ColorSpace{Curve::kRec709, 1.0}, ColorSpace{Curve::kGamma, 2.2}}) {
    EXPECT_EQ(to_linear(0.0, space), 0.0);
    EXPECT_NEAR(to_linear(1.0, space), 1.0, 1e-12);
  }
}

TEST(ColorSpace, CurvesFollowTheirStandards) {
  EXPECT_EQ(to_linear(0.5, {Curve::kLinear, 1.0}), 0.5);
  EXPECT_EQ(to_linear(0.5, {Curve::kSrgb, 1.0}), decode(0.5));
  EXPECT_DOUBLE_EQ(to_linear(0.5, {Curve::kGamma, 2.2}), std::pow(0.5, 2.2));
  // BT.709: V = 1.099 L^0.45 − 0.099, and 4.5 L below L = 0.018.
  EXPECT_NEAR(to_linear(1.099 * std::pow(0.3, 0.45) - 0.099, {Curve::kRec709, 1.0}), 0.3, 1e-12);
  EXPECT_NEAR(to_linear(0.045, {Curve::kRec709, 1.0}), 0.01, 1e-12);
}

}  // namespace
}  // namespace lensforge
