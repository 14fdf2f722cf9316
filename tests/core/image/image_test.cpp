// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/image.h"

#include <gtest/gtest.h>

#include "core/image/transfer.h"

namespace lensforge {
namespace {

TEST(Image, ValuesAreStoredRowByRowFromTheTop) {
  Image image(3, 2, 0.25F);
  image.at(2, 1) = 7.0F;
  EXPECT_EQ(image.values().size(), 6U);
  EXPECT_EQ(image.values()[5], 7.0F);
  EXPECT_EQ(image.values()[0], 0.25F);
}

TEST(Image, ADefaultImageIsEmpty) {
  EXPECT_TRUE(Image().empty());
  EXPECT_EQ(Image().total(), 0.0);
}

TEST(Image, TotalIsSummedInDoublePrecision) {
  // In single precision the sum would stick at 2^24.
  EXPECT_EQ(Image(5000, 4000, 1.0F).total(), 20'000'000.0);
}

TEST(Image, EncodedValuesAreClippedToTheDisplay) {
  Image image(4, 1);
  image.at(0, 0) = -1.0F;
  image.at(1, 0) = 0.5F;
  image.at(2, 0) = 1.0F;
  image.at(3, 0) = 9.0F;
  EXPECT_EQ(encoded_values(image),
            (std::vector<double>{0.0, encode(0.5), encode(1.0), encode(1.0)}));
}

}  // namespace
}  // namespace lensforge
