// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text/option_field.h"

#include <gmock/gmock.h>

#include <limits>
#include <optional>

#include "core/error.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using testing::message_of;
using ::testing::StrEq;

enum class Side { kLeft, kRight };

struct Toy {
  bool arcs = true;
  int count = 3;
  double depth = 0.5;
  std::optional<Side> side;
  struct Inner {
    std::string name = "a";
  } inner;
};

const OptionTable<Toy>& toy_fields() {
  using R = Row<Toy>;
  static const OptionTable<Toy> table{
      R::without("--no-arcs", &Toy::arcs, "no arcs"),
      R::whole("--count", &Toy::count, Limits::zero_or(2, 9), "how many"),
      R::length("--depth", &Toy::depth, Limits::above(0, 1), "how deep"),
      R::word<std::optional<Side>>("--side", &Toy::side,
                                   {{"none", std::nullopt}, {"left", Side::kLeft}}, "where"),
      R::text(
          "--name", [](auto& o) -> auto& { return o.inner.name; }, "NAME", "what")};
  return table;
}

TEST(OptionField, RowsReadAndWriteTheirMember) {
  Toy toy;
  const nlohmann::json values[] = {true, 5, 0.25, "left", "b"};
  for (std::size_t i = 0; i < toy_fields().size(); ++i) {
    EXPECT_NE(toy_fields()[i].get(toy), values[i]) << i;
    toy_fields()[i].set(toy, values[i]);
    EXPECT_EQ(toy_fields()[i].get(toy), values[i]) << i;
  }
  EXPECT_FALSE(toy.arcs);
  EXPECT_EQ(toy.side, Side::kLeft);
  EXPECT_THAT(toy.inner.name, StrEq("b"));
}

TEST(OptionField, LimitsHoldWhatTheirRuleSays) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(Limits::zero_or(2, 9).hold(0) && Limits::zero_or(2, 9).hold(9));
  EXPECT_FALSE(Limits::zero_or(2, 9).hold(1) || Limits::zero_or(2, 9).hold(nan));
  EXPECT_FALSE(Limits::above(0, 1).hold(0));
  EXPECT_TRUE(Limits::between(0, 1).hold(0));
  EXPECT_THAT(Limits::zero_or(2, 9).rule(), StrEq("0, or 2 to 9"));
  EXPECT_THAT(Limits::above(0, 1e7).rule(), StrEq("above 0, at most 1e+07"));
  EXPECT_THAT(Limits::at_least(4).rule(), StrEq("at least 4"));
}

TEST(OptionField, ANumberOutsideItsLimitsIsNamedWithValueAndRule) {
  Toy toy;
  require_limits(toy_fields(), toy);
  toy.depth = 0.0;
  EXPECT_THAT(message_of<InputError>([&] { require_limits(toy_fields(), toy); }),
              StrEq("--depth 0: must be above 0, at most 1 mm"));
  toy.depth = 1.0;
  toy.count = 1;
  EXPECT_THAT(message_of<InputError>([&] { require_limits(toy_fields(), toy); }),
              StrEq("--count 1: must be 0, or 2 to 9"));
}

}  // namespace
}  // namespace lensforge
