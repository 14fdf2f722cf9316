// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <stop_token>
#include <string>
#include <vector>

#include "cam/cam.h"
#include "cam/cam_meshes.h"
#include "cam/small_cuts.h"
#include "core/error.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::coarse;
using lensforge::testing::message_of;
using lensforge::testing::read_bytes;
using lensforge::testing::small_lens;
using lensforge::testing::TempFolder;
using ::testing::HasSubstr;

CutChoices parse(const std::vector<std::string>& words) {
  return parse_choices(words, "--compare");
}

TEST(CutCompare, RanksEveryCombinationAsTheCutItselfTells) {
  const Lens lens = small_lens();
  const TempFolder folder;
  const CutComparison result =
      compare_cuts(lens, coarse(), parse({"tool=0.4,0.3", "pitch=0.1,0.2"}), folder.path(),
                   Executor::cpu(2), {});
  ASSERT_TRUE(result.complete);
  ASSERT_EQ(result.ranking.size(), 4U);
  for (std::size_t i = 1; i < 4; ++i) {
    EXPECT_LE(result.ranking[i - 1].leakage, result.ranking[i].leakage);
  }
  EXPECT_EQ(folder.file_count(), 1U);
  EXPECT_THAT(read_bytes(result.page), HasSubstr("tool 0.3 mm, pitch 0.2 mm"));

  CamOptions alone = coarse();
  alone.workshop.process.rough.enabled = false;
  alone.workshop.process.semi.enabled = false;
  alone.workshop.process.finish.pitch = 0.1;
  const TempFolder other;
  const ReportData report = make_cut(lens, alone, other.path(), Executor::cpu(2), {}).report;
  for (const ReportChoice& choice : result.ranking) {
    if (choice.choice != "tool 0.4 mm, pitch 0.1 mm") continue;
    EXPECT_DOUBLE_EQ(choice.leakage, report.leakage.part().quality.leakage);
    EXPECT_DOUBLE_EQ(choice.hours, report.minutes() / 60.0);
  }
}

/// Both ways of finishing: the smaller ball alone, and a larger one with it.
TEST(CutCompare, ALargerBallIsAChoice) {
  const TempFolder folder;
  const CutComparison result = compare_cuts(small_lens(8.0, 7.0), coarse(), parse({"large=0,4"}),
                                            folder.path(), Executor::cpu(2), {});
  ASSERT_EQ(result.ranking.size(), 2U);
  const bool first = result.ranking[0].choice.ends_with("larger ball T4");
  EXPECT_NE(first, result.ranking[1].choice.ends_with("larger ball T4"));
  const ReportChoice& two = result.ranking[first ? 0 : 1];
  const ReportChoice& one = result.ranking[first ? 1 : 0];
  EXPECT_GT(two.hours, 0.0);
  EXPECT_NE(two.hours, one.hours);
}

TEST(CutCompare, TheQuickestThatReachesTheGoalIsRecommended) {
  const TempFolder folder;
  const auto compare = [&](const std::string& goal) {
    return compare_cuts(small_lens(), coarse(), parse({"pitch=0.05,0.1,0.3", goal}), folder.path(),
                        Executor::cpu(2), {});
  };
  const CutComparison all = compare("mae=1");
  const auto quickest = std::min_element(
      all.ranking.begin(), all.ranking.end(),
      [](const ReportChoice& a, const ReportChoice& b) { return a.hours < b.hours; });
  for (const ReportChoice& choice : all.ranking) {
    EXPECT_EQ(choice.chosen, choice.choice == quickest->choice) << choice.choice;
  }
  EXPECT_THAT(all.advice, HasSubstr(quickest->choice + " reaches MAE 1"));
  EXPECT_THAT(read_bytes(all.page), HasSubstr("recommended"));
  const CutComparison none = compare("mae=1e-9");
  EXPECT_THAT(none.advice, HasSubstr("none reaches MAE 1e-09"));
  for (const ReportChoice& choice : none.ranking) EXPECT_FALSE(choice.chosen);
}

TEST(CutCompare, SlopeTolerancesAreChoices) {
  const TempFolder folder;
  const CutComparison result = compare_cuts(small_lens(), coarse(), parse({"slope=3e-5,0.001"}),
                                            folder.path(), Executor::cpu(2), {});
  ASSERT_EQ(result.ranking.size(), 2U);
  EXPECT_THAT(result.ranking[0].choice, HasSubstr("slope tolerance 3e-05"));
  EXPECT_LT(result.ranking[0].leakage, result.ranking[1].leakage);
  EXPECT_TRUE(result.advice.empty());
}

TEST(CutCompare, StoppedLeavesNothing) {
  const TempFolder folder;
  std::stop_source source;
  const RunControl control(source.get_token(), [&](const Progress& progress) {
    if (progress.stage.starts_with("choice 2/2")) source.request_stop();
  });
  const CutComparison result = compare_cuts(small_lens(), coarse(), parse({"pitch=0.1,0.2"}),
                                            folder.path(), Executor::serial(), control);
  EXPECT_FALSE(result.complete);
  EXPECT_EQ(result.ranking.size(), 1U);
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(CutCompare, APageThatOthersWroteIsReplacedOnlyByForce) {
  const TempFolder folder;
  lensforge::testing::write_bytes(folder / kComparePage, "mine");
  CamOptions options = coarse();
  const auto compare = [&] {
    compare_cuts(small_lens(), options, parse({"pitch=0.2"}), folder.path(), Executor::cpu(2), {});
  };
  EXPECT_THAT(message_of<InputError>(compare), HasSubstr("compare.html"));
  EXPECT_EQ(read_bytes(folder / kComparePage), "mine");
  options.force = true;
  compare();
  options.force = false;
  EXPECT_NO_THROW(compare());
}

TEST(CutCompare, BadChoicesAreNamedWithValueAndRule) {
  const auto refusal = [](const std::vector<std::string>& words) {
    return message_of<InputError>([&] { parse(words); });
  };
  EXPECT_THAT(refusal({"feed=3"}), HasSubstr("--compare: feed=3 is not tool="));
  EXPECT_THAT(refusal({"tool"}), HasSubstr("--compare: tool is not"));
  EXPECT_THAT(refusal({"tool="}), HasSubstr("--compare tool"));
  EXPECT_THAT(refusal({"tool=0.3,,0.4"}), HasSubstr("--compare tool"));
  EXPECT_THAT(refusal({"pitch=0.1,wide"}), HasSubstr("--compare pitch"));
  EXPECT_THAT(refusal({"pitch=0"}), HasSubstr("--compare pitch: 0 is not above 0"));
  EXPECT_THAT(refusal({"pitch=-0.1"}), HasSubstr("--compare pitch"));
  EXPECT_THAT(refusal({"pitch=0.1,0.1"}), HasSubstr("0.1 is given twice"));
  EXPECT_THAT(refusal({"large=0,-1"}), HasSubstr("--compare large: -1 is no tool's number"));
  EXPECT_THAT(refusal({"large=4,4"}), HasSubstr("4 is given twice"));
  EXPECT_THAT(refusal({"pitch=0.1", "pitch=0.2"}), HasSubstr("pitch is given twice"));
  EXPECT_THAT(refusal({"tool=1,2,3,4,5,6,7,8,9", "pitch=1,2,3,4,5,6,7,8"}),
              HasSubstr("72 combinations are more than 64"));
}

/// Before the first combination is planned.
TEST(CutCompare, ChoicesThatCannotBeCutAreRefusedAtOnce) {
  const TempFolder folder;
  const std::string message = message_of<InputError>([&] {
    compare_cuts(small_lens(), coarse(), parse({"tool=0.4,2"}), folder.path(), Executor::serial(),
                 {});
  });
  EXPECT_THAT(message, HasSubstr("--tool-diameter 2"));
  EXPECT_EQ(folder.file_count(), 0U);
}

}  // namespace
}  // namespace lensforge
