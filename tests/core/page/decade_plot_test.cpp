// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "core/page/drawings.h"

namespace lensforge {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

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
