// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <optional>

#include "app/frame/console.h"

namespace lensforge::app {
namespace {

Progress at(double done, double total = 100.0) { return {"cut", done, total, ""}; }

TEST(ProgressLine, NamesStageShareDetailTimeAndTimeLeft) {
  const Progress progress{"design", 57.9, 100.0, "MAE 0.01"};
  EXPECT_EQ(progress_line(progress, 34.9, 25.0, 0), "design  57 %  MAE 0.01  0:34, 0:25 left");
  EXPECT_EQ(progress_line(progress, 34.9, std::nullopt, 0), "design  57 %  MAE 0.01  0:34");
  EXPECT_EQ(progress_line(at(50.0), 61.0, 3600.0, 4), "cut  [##..] 50 %  1:01, 60:00 left");
}

TEST(ProgressLine, RoundsTheTimeLeft) {
  EXPECT_EQ(progress_line(at(50.0), 9.0, 59.6, 0), "cut  50 %  0:09, 1:00 left");
  EXPECT_EQ(progress_line(at(50.0), 9.0, 0.2, 0), "cut  50 %  0:09, 0:00 left");
}

TEST(ProgressLine, WithoutATotalHasNoShare) {
  EXPECT_EQ(progress_line(at(5.0, 0.0), 2.0, std::nullopt, 8), "cut  0:02");
}

TEST(StagePace, DividesTheRestByThePaceSoFar) {
  StagePace pace;
  pace.take(at(0.0), 10.0);
  pace.take(at(20.0), 20.0);
  ASSERT_TRUE(pace.left(20.0));
  EXPECT_DOUBLE_EQ(*pace.left(20.0), 40.0);
  EXPECT_DOUBLE_EQ(*pace.left(25.0), 35.0) << "it counts down between reports";
  pace.take(at(60.0), 30.0);
  EXPECT_DOUBLE_EQ(*pace.left(30.0), 20.0 * 40.0 / 60.0);
}

TEST(StagePace, IsUnknownAtTheStart) {
  StagePace pace;
  EXPECT_FALSE(pace.left(0.0));
  pace.take(at(0.0), 0.0);
  EXPECT_FALSE(pace.left(60.0)) << "no work";
  pace.take(at(30.0), 2.9);
  EXPECT_FALSE(pace.left(2.9)) << "too soon";
  pace.take(at(31.0), 3.1);
  EXPECT_TRUE(pace.left(3.1));
  StagePace slow;
  slow.take(at(0.0), 0.0);
  slow.take(at(0.9), 50.0);
  EXPECT_FALSE(slow.left(50.0)) << "less than a percent";
  slow.take(at(1.1), 60.0);
  EXPECT_TRUE(slow.left(60.0));
}

TEST(StagePace, IsUnknownWithoutATotalAndOnceItIsReached) {
  StagePace open;
  for (int i = 0; i < 20; ++i) open.take(at(i, 0.0), i);
  EXPECT_FALSE(open.left(20.0));
  StagePace done;
  for (int i = 0; i <= 100; ++i) done.take(at(i), i);
  EXPECT_FALSE(done.left(100.0));
}

TEST(StagePace, IsNeverNegative) {
  StagePace pace;
  pace.take(at(0.0), 0.0);
  pace.take(at(50.0), 10.0);
  EXPECT_GT(pace.left(19.9).value_or(0.0), 0.0);
  EXPECT_FALSE(pace.left(20.1)) << "the pace has turned out wrong";
}

TEST(StagePace, CountsFromWhenWorkAdvances) {
  StagePace pace;
  for (int second = 0; second <= 100; ++second) pace.take(at(40.0), second);
  pace.take(at(50.0), 110.0);
  ASSERT_TRUE(pace.left(110.0));
  EXPECT_DOUBLE_EQ(*pace.left(110.0), 50.0);
}

TEST(StagePace, BeginsAnewWithAnotherStageAnotherTotalAndLessWork) {
  for (const Progress& next :
       {Progress{"polish", 60.0, 100.0, ""}, at(60.0, 90.0), Progress{"cut", 10.0, 100.0, ""}}) {
    StagePace pace;
    pace.take(at(0.0), 0.0);
    pace.take(at(50.0), 50.0);
    ASSERT_TRUE(pace.left(50.0));
    pace.take(next, 51.0);
    EXPECT_FALSE(pace.left(51.0)) << next.stage << ' ' << next.total;
  }
}

}  // namespace
}  // namespace lensforge::app
