// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "cam/post/post_description.h"

namespace lensforge {
namespace {

std::string coordinate(std::int64_t units, int decimals, const PostDescription& post) {
  std::string text;
  append_coordinate(text, units, decimals, post);
  return text;
}

const PostDescription kPlain;

TEST(PostText, CoordinatesAreExactWithoutExponentOrNegativeZero) {
  EXPECT_EQ(coordinate(0, 4, kPlain), "0.0000");
  EXPECT_EQ(coordinate(-1, 4, kPlain), "-0.0001");
  EXPECT_EQ(coordinate(15000, 4, kPlain), "1.5000");
  EXPECT_EQ(coordinate(-7, 0, kPlain), "-7");
  std::mt19937_64 engine(1);
  for (int i = 0; i < 2000; ++i) {
    const int decimals = static_cast<int>(engine() % 7);
    const auto units = static_cast<std::int64_t>(engine() % 20'000'000'000) - 10'000'000'000;
    const std::string text = coordinate(units, decimals, kPlain);
    ASSERT_EQ(text.find_first_not_of("-.0123456789"), std::string::npos) << text;
    ASSERT_EQ(std::llround(std::stod(text) * std::pow(10.0, decimals)), units) << text;
  }
}

TEST(PostText, ADialectMayDropZerosAndKeepThePoint) {
  PostDescription post;
  post.trailing_zeros = false;
  EXPECT_EQ(coordinate(15000, 4, post), "1.5");
  EXPECT_EQ(coordinate(100000, 4, post), "10");
  EXPECT_EQ(coordinate(0, 4, post), "0");
  EXPECT_EQ(coordinate(100, 0, post), "100");
  post.whole_with_point = true;
  EXPECT_EQ(coordinate(100000, 4, post), "10.");
  EXPECT_EQ(coordinate(100, 0, post), "100.");
  EXPECT_EQ(feed_text(post, 500.0), "500.");
  EXPECT_EQ(feed_text(post, 0.00001), "0.001");
}

TEST(PostText, LinesWithNothingToSayAreLeftOut) {
  const PlaceholderTexts texts{{"tool", "3"}, {"dwell", ""}};
  EXPECT_EQ(fill_line("T{tool} M6", texts), "T3 M6");
  EXPECT_EQ(fill_line("M5", texts), "M5");
  EXPECT_FALSE(fill_line("G4 P{dwell}", texts));
  EXPECT_FALSE(fill_line("{coolant}", texts));
}

TEST(PostText, CommentsCannotBreakTheProgram) {
  PostDescription post;
  EXPECT_EQ(comment_line(post, "job: a (b) c"), "(job: a _b_ c)");
  EXPECT_EQ(comment_line(post, "what?! ~x\nM3"), "(what__ _x_M3)");
  EXPECT_EQ(comment_line(post, "caf\xc3\xa9"), "(caf__)");
  EXPECT_EQ(comment_line(post, std::string(200, 'x')).size(), 80U);
  EXPECT_EQ(padded_comment_line(post, "a").size(), 80U);
  post.comment_open.assign(1, ';');
  post.comment_close.clear();
  post.upper_case_comments = true;
  EXPECT_EQ(comment_line(post, "a;b"), ";A;B");
}

}  // namespace
}  // namespace lensforge
