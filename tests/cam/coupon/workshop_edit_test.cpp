// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include "cam/coupon/coupon_fit.h"

namespace lensforge {
namespace {

/// The workshop of a file with other values of what a coupon tells.
Workshop changed(const std::string& text) {
  Workshop shop = parse_workshop(text, "shop.toml");
  shop.polish.sigma = 0.027;
  shop.process.finish.pitch_error = -0.00125;
  return shop;
}

Workshop with_ball(Workshop shop, double diameter) {
  for (Tool& tool : shop.tools) {
    if (tool.number == shop.process.finish.tool) tool.diameter = diameter;
  }
  return shop;
}

TEST(WorkshopEdit, NumbersAreReplacedWhereTheyStand) {
  const std::string text =
      "# Anna's mill, σ by eye\n[polish]  # felt wheel\n  sigma=0.03# to be measured\n"
      "rim_depth = 0\n\n[finish]\npitch_error = 1e-3\npitch = 0.05  # fine\n";
  EXPECT_EQ(edited_workshop(text, changed(text)),
            "# Anna's mill, σ by eye\n[polish]  # felt wheel\n  sigma=0.027# to be measured\n"
            "rim_depth = 0\n\n[finish]\npitch_error = -0.00125\npitch = 0.05  # fine\n");
}

TEST(WorkshopEdit, OrderAndFloorAreReplacedToo) {
  const std::string text = "[polish]\norder = 2  # felt\nsigma = 0.03\n";
  Workshop shop = parse_workshop(text, "shop.toml");
  shop.polish.order = 4;
  shop.polish.floor = 0.05;
  EXPECT_EQ(edited_workshop(text, shop),
            "[polish]\nfloor = 0.05\norder = 4  # felt\nsigma = 0.03\n");
}

TEST(WorkshopEdit, RoughnessAndCorrelationAreReplacedToo) {
  const std::string text = "[polish]\nroughness = 3  # felt\nsigma = 0.03\n";
  Workshop shop = parse_workshop(text, "shop.toml");
  shop.polish.roughness = 12.5;
  shop.polish.correlation = 7.0;
  EXPECT_EQ(edited_workshop(text, shop),
            "[polish]\ncorrelation = 7\nroughness = 12.5  # felt\nsigma = 0.03\n");
}

TEST(WorkshopEdit, KeysAndTablesThatAreMissingAreAdded) {
  const std::string text = "[finish]  # raster\npitch = 0.05";
  EXPECT_EQ(
      edited_workshop(text, changed(text)),
      "[finish]  # raster\npitch_error = -0.00125\npitch = 0.05\n\n[polish]\nsigma = 0.027\n");
  const std::string last = "[polish]\nsigma = 0.03\n[finish]";
  EXPECT_EQ(edited_workshop(last, changed(last)),
            "[polish]\nsigma = 0.027\n[finish]\npitch_error = -0.00125\n");
  EXPECT_EQ(edited_workshop("", changed("")),
            "[polish]\nsigma = 0.027\n\n[finish]\npitch_error = -0.00125\n");
}

TEST(WorkshopEdit, TheFinishingToolsDiameterIsTheOneThatChanges) {
  const std::string text = "# mine\n" + workshop_toml({}) + "# end\n";
  const Workshop to = with_ball(changed(text), 0.413);
  const std::optional<std::string> edited = edited_workshop(text, to);
  ASSERT_TRUE(edited.has_value());
  EXPECT_EQ(parse_workshop(*edited, "edited"), to);
  EXPECT_TRUE(edited->starts_with("# mine\n") && edited->ends_with("# end\n"));
  EXPECT_THAT(*edited, ::testing::HasSubstr("diameter = 0.413  # mm"));
}

TEST(WorkshopEdit, AFileWithoutToolsCannotStateAnotherBall) {
  const std::string text = "[finish]\npitch = 0.05\n";
  EXPECT_EQ(edited_workshop(text, with_ball(changed(text), 0.41)), std::nullopt);
}

TEST(WorkshopEdit, OtherWaysToWriteItAreFollowedOrLeft) {
  for (const std::string text :
       {"polish = { sigma = 0.03, rim_depth = 0 }\n", "polish.sigma = 0.03\n",
        "\"polish\".sigma = 0.0_3\n", "[polish]\r\nsigma = 3e-2\r\n", "polish.rim_depth = 0.0\n"}) {
    const Workshop to = changed(text);
    const std::optional<std::string> edited = edited_workshop(text, to);
    // A table that was begun with a dotted key cannot be opened again.
    ASSERT_EQ(edited.has_value(), text != "polish.rim_depth = 0.0\n") << text;
    EXPECT_EQ(parse_workshop(edited.value_or(workshop_toml(to)), "edited"), to) << text;
  }
}

TEST(WorkshopEdit, NothingChangesWhereNothingDoes) {
  const std::string text = "[polish]\nsigma = 3e-2 # as it is\n";
  EXPECT_EQ(edited_workshop(text, parse_workshop(text, "shop.toml")), text);
}

}  // namespace
}  // namespace lensforge
