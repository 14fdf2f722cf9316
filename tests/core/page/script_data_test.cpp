// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/page/html_page.h"

namespace lensforge {
namespace {

TEST(ScriptData, NoTagCanEndTheElementThatHoldsIt) {
  const std::string text = script_json({{"name", "</script><script>alert(1)"}});
  EXPECT_EQ(text.find('<'), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(text)["name"], "</script><script>alert(1)");
}

TEST(ScriptData, NamesThatAreNoUtf8AreReplaced) {
  EXPECT_NO_THROW(nlohmann::json::parse(script_json({{"name", "\xff"}})));
}

TEST(ScriptData, PackedNumbersAreLittleEndianBetweenTheirBounds) {
  PackedNumbers numbers(2);
  EXPECT_EQ(numbers.add(-1.0, -1.0, 3.0), -1.0);
  EXPECT_EQ(numbers.add(3.0, -1.0, 3.0), 3.0);
  EXPECT_EQ(numbers.add(9.0, -1.0, 3.0), 3.0);
  EXPECT_NEAR(numbers.add(-1.0 + 4.0 * 258.0 / 65535.0, -1.0, 3.0), -1.0 + 4.0 * 258.0 / 65535.0,
              1e-12);
  EXPECT_EQ(numbers.text(), "AAD/////AgE=");  // 00 00, ff ff, ff ff, 02 01
}

TEST(ScriptData, PackedNumbersAreOffByHalfAStepAtMost) {
  for (int bytes = 1; bytes <= 3; ++bytes) {
    PackedNumbers numbers(bytes);
    const double half = 0.5 * 7.0 / (std::pow(256.0, bytes) - 1.0);
    for (int i = 0; i <= 1000; ++i) {
      const double value = -2.0 + 7.0 * i / 1000.0;
      EXPECT_NEAR(numbers.add(value, -2.0, 5.0), value, 1.000001 * half);
    }
    EXPECT_EQ(numbers.text().size(), static_cast<std::size_t>((1001 * bytes + 2) / 3 * 4));
  }
}

}  // namespace
}  // namespace lensforge
