// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/temp_folder.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

using testing::message_of;

TEST(NumberList, ReadsNumbersBetweenCommas) {
  EXPECT_EQ(parse_numbers("50, -1.5e2 ,0", "--at", 3), (std::vector<double>{50.0, -150.0, 0.0}));
}

TEST(NumberList, ReadsBackWhatItWrites) {
  const std::vector<double> numbers{0.1, -1e-300, 600.0};
  EXPECT_EQ(parse_numbers(numbers_text(numbers), "--at", 3), numbers);
}

TEST(NumberList, RefusesAnotherCountAndWhatIsNoNumber) {
  for (const char* text : {"", "1", "1,2,3", "1,", ",1", "1,nan", "1,inf", "1,2x", "1;2"}) {
    EXPECT_THAT(message_of<InputError>([&] { parse_numbers(text, "--at", 2); }),
                ::testing::StartsWith("--at "))
        << text;
  }
}

}  // namespace
}  // namespace lensforge
