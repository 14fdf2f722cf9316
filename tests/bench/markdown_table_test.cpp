// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/markdown_table.h"

#include <gtest/gtest.h>

#include <limits>

namespace lensforge::bench {
namespace {

TEST(MarkdownTable, ColumnsLineUpThoughCharactersTakeSeveralBytes) {
  MarkdownTable table({"Image", "MAE"});
  table.add({"256²", "1.5"});
  table.add({"a longer name", "–"});
  EXPECT_EQ(table.text(),
            "| Image         | MAE |\n"
            "| ------------- | --: |\n"
            "| 256²          | 1.5 |\n"
            "| a longer name |   – |\n");
}

TEST(MarkdownTable, CellsLeftOutStayEmpty) {
  MarkdownTable table({"a", "b", "c"});
  table.add({"x"});
  EXPECT_EQ(table.text(), "| a | b | c |\n| - | : | : |\n| x |   |   |\n");
}

TEST(MarkdownTable, ANumberThatIsNoneIsADash) {
  EXPECT_EQ(decimals(1.0 / 3.0, 3), "0.333");
  EXPECT_EQ(decimals(std::numeric_limits<double>::quiet_NaN(), 3), "–");
}

}  // namespace
}  // namespace lensforge::bench
