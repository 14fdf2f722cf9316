// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/image/picture_refusal.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// Takes all of kSvgSeconds with librsvg 2.54; 2.60 gives up within seconds.
TEST(SvgLimit, ADrawingWithoutEndIsARefusalInOneLine) {
  const testing::TempFolder folder;
  testing::write_bytes(folder / "a.svg",
                       "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 8 4'>"
                       "<text y='4' font-family='DejaVu Sans'>" +
                           std::string(2'000'000, 'x') + "</text></svg>");
  EXPECT_THAT(testing::picture_refusal(folder / "a.svg"),
              AllOf(HasSubstr("cannot be drawn: the program that draws SVG"),
                    HasSubstr("use fewer or simpler elements")));
}

}  // namespace
}  // namespace lensforge
