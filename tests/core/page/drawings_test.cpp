// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/page/drawings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <regex>
#include <sstream>

namespace lensforge {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kHeight = 8.0;

OpticalSetup mirror() {
  OpticalSetup setup;
  setup.body = MirrorBody{};
  setup.lamp = ParallelLight{{0.5, 0.0, -std::sqrt(0.75)}};
  setup.image_origin = {170.0, 0.0};
  return setup;
}

OpticalSetup lit_from_a_point() {
  OpticalSetup setup;
  setup.lamp = PointSource{{50.0, 20.0, -600.0}, Emission::kIsotropic};
  return setup;
}

OpticalSetup tilted() {
  OpticalSetup setup;
  const double angle = 50.0 * std::numbers::pi / 180.0;
  setup.screen_y = {0.0, std::cos(angle), std::sin(angle)};
  return setup;
}

/// Far away and with a large picture.
OpticalSetup far_away() {
  OpticalSetup setup;
  setup.focal_length = 1e5;
  setup.image_size = {2e4, 2e4};
  return setup;
}

TEST(LightDrawing, NamesLampPartScreenAndViewerForEveryLight) {
  for (const OpticalSetup& setup :
       {OpticalSetup(), mirror(), lit_from_a_point(), tilted(), far_away()}) {
    const std::string svg = light_drawing(setup, kHeight);
    for (const char* name : {"screen</text>", "viewer</text>", "From the side", "From above"}) {
      EXPECT_THAT(svg, HasSubstr(name));
    }
    EXPECT_THAT(svg, HasSubstr(lamp_place(setup.lamp) ? ">lamp</text>" : ">parallel light</text>"));
    EXPECT_THAT(svg, HasSubstr(traits(setup.body).reflects ? ">mirror</text>" : ">lens</text>"));
    EXPECT_THAT(svg, Not(HasSubstr("nan")));
    EXPECT_THAT(svg, Not(HasSubstr("inf")));
  }
}

TEST(LightDrawing, StatesTheLightAndTheScreen) {
  EXPECT_THAT(light_drawing({}, kHeight), HasSubstr("parallel, straight onto the flat face"));
  EXPECT_THAT(light_drawing(mirror(), kHeight), HasSubstr("30° from the mirror's z axis"));
  EXPECT_THAT(light_drawing(lit_from_a_point(), kHeight),
              HasSubstr("point source at x 50, y 20, z -600 mm"));
  EXPECT_THAT(light_drawing({}, kHeight), HasSubstr("parallel to the part"));
  EXPECT_THAT(light_drawing(tilted(), kHeight), HasSubstr("tilted by 50°"));
}

TEST(LightDrawing, StatesHowWideTheSourceIs) {
  OpticalSetup sun;
  sun.extent.width = 9.3e-3;
  EXPECT_THAT(light_drawing(sun, kHeight), HasSubstr("a disc 9.3 mrad (0.53°) wide"));
  OpticalSetup lamp = lit_from_a_point();
  lamp.extent = {3.0, {1, 1, {1.0}}};
  EXPECT_THAT(light_drawing(lamp, kHeight), HasSubstr("a shape of its own 3 mm wide"));
}

TEST(LightDrawing, DistancesAreThoseFromTheMiddleOfTheUpperSide) {
  const std::string svg = light_drawing(lit_from_a_point(), kHeight);
  EXPECT_THAT(svg, HasSubstr(">292 mm</text>"));    // 300 − 8 to the screen.
  EXPECT_THAT(svg, HasSubstr(">608.7 mm</text>"));  // √(608² + 30²) to the lamp.
}

TEST(LightDrawing, TheViewerIsOnTheSideFromWhichThePictureReads) {
  OpticalSetup setup;
  EXPECT_THAT(light_drawing(setup, kHeight), HasSubstr("on the part's side of the screen"));
  setup.view = ViewSide::kRear;
  EXPECT_THAT(light_drawing(setup, kHeight), HasSubstr("behind the screen"));
}

TEST(LightDrawing, SaysWhereItIsNotToScaleAndStaysInsideItsFrame) {
  EXPECT_THAT(light_drawing({}, kHeight), HasSubstr("Drawn to scale"));
  EXPECT_THAT(light_drawing(far_away(), kHeight), HasSubstr("Not to scale"));
  for (const OpticalSetup& setup :
       {OpticalSetup(), mirror(), lit_from_a_point(), tilted(), far_away()}) {
    const std::string svg = light_drawing(setup, kHeight);
    std::smatch frame;
    ASSERT_TRUE(std::regex_search(svg, frame, std::regex("width=\"(\\d+)\" height=\"(\\d+)\"")));
    const double width = std::stod(frame[1]);
    const double height = std::stod(frame[2]);
    const std::regex point("[ML\"]([-0-9.]+),([-0-9.]+)");
    for (std::sregex_iterator it(svg.begin(), svg.end(), point), end; it != end; ++it) {
      const double x = std::stod((*it)[1]);
      const double y = std::stod((*it)[2]);
      EXPECT_TRUE(x >= 0.0 && x <= width && y >= 0.0 && y <= height) << it->str();
    }
  }
}

/// The numbers of the first polyline.
std::vector<double> first_line(const std::string& svg) {
  const std::size_t from = svg.find("points=\"") + 8;
  std::string text = svg.substr(from, svg.find('"', from) - from);
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream words(text);
  std::vector<double> numbers;
  for (double number = 0.0; words >> number;) numbers.push_back(number);
  return numbers;
}

const PlotCurve kFirst{"first", {{1.0, 0.5}, {2.0, 0.2}}};
const PlotCurve kSecond{"second", {{4.0, 0.05}}};

TEST(DecadePlot, HasALineForEveryCurveOnAScaleOfDecades) {
  const std::string svg = decade_plot({kFirst, kSecond}, "Error");
  EXPECT_THAT(svg, HasSubstr("1e-2"));
  EXPECT_THAT(svg, HasSubstr("1e0"));
  EXPECT_THAT(svg, HasSubstr("4.0 s"));
  // 0.5 and 0.2 at 1 and 2 of 4 seconds; two decades over 240 units down from 1, 800 units wide.
  const std::vector<double> line = first_line(svg);
  ASSERT_EQ(line.size(), 4U);
  EXPECT_NEAR(line[0], 270.0, 0.1);
  EXPECT_NEAR(line[1], 30.0 + 120.0 * 0.30103, 0.1);
  EXPECT_NEAR(line[2], 470.0, 0.1);
  EXPECT_NEAR(line[3], 30.0 + 120.0 * 0.69897, 0.1);
}

TEST(DecadePlot, MakesRoomForTheNamesOfManyCurves) {
  // The fifth name begins a second line, which the plot leaves free.
  const std::string svg = decade_plot({kFirst, kSecond, kSecond, kSecond, kSecond}, "Error");
  EXPECT_NEAR(first_line(svg)[1], 48.0 + 111.0 * 0.30103, 0.1);
}

TEST(DecadePlot, EscapesNamesAndLabel) {
  const std::string svg = decade_plot({{"<a>", kFirst.points}}, "\"quoted\"");
  EXPECT_THAT(svg, Not(HasSubstr("<a>")));
  EXPECT_THAT(svg, Not(HasSubstr("\"quoted\"")));
}

TEST(DecadePlot, OnePointHasNoLine) {
  EXPECT_EQ(decade_plot({}, "Error"), "");
  EXPECT_EQ(decade_plot({kSecond}, "Error"), "");
}

}  // namespace

}  // namespace lensforge
