// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/paper_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace lensforge::bench {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

RowChoice small_choice() {
  RowChoice choice;
  choice.fixtures = "pictures";
  return choice;
}

PaperResult made(const PaperRow& row, double mae) {
  PaperResult result;
  result.row = row;
  const nlohmann::json metrics = {{"mae", mae}, {"ssim", 0.9}};
  result.lens = {{"pixels", {512, 512}},
                 {"grid", {641, 737}},
                 {"lens_size", {100.0, 100.0}},
                 {"image_size", {100.0, 100.0}},
                 {"focal_length", 300.0},
                 {"model", "facet"},
                 {"metrics", {{"facet", metrics}, {"smooth", metrics}}}};
  return result;
}

TEST(PaperRows, LogoHasThePapersSettings) {
  RowChoice choice = small_choice();
  choice.only = {"logo"};
  const std::vector<PaperRow> rows = choose_rows(choice);
  ASSERT_FALSE(rows.empty());
  EXPECT_EQ(rows.front().name, "logo");
  EXPECT_EQ(rows.front().pixels, 512);
  EXPECT_EQ(rows.front().paper.mae, 1.029);
}

TEST(PaperRows, PixelsOnlyShrinkAndOptionsReachEveryDesign) {
  RowChoice choice = small_choice();
  choice.most_pixels = 300;
  choice.more_options = {"--quality", "draft"};
  for (const PaperRow& row : choose_rows(choice)) {
    EXPECT_LE(row.pixels, 300) << row.name;
    EXPECT_EQ(row.options.back(), "draft") << row.name;
  }
}

TEST(PaperRows, NamesOfFoldersDiffer) {
  std::vector<std::string> names;
  for (const PaperRow& row : choose_rows(small_choice())) names.push_back(row.name);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::adjacent_find(names.begin(), names.end()), names.end());
}

TEST(PaperRows, PointSourcesAndMirrorsAreDesignedButNotTraced) {
  RowChoice choice = small_choice();
  choice.only = {"butterfly-point", "relief-mirror", "city-point"};
  const std::vector<PaperRow> rows = choose_rows(choice);
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].picture, "pictures/butterfly.png");
  EXPECT_EQ(rows[0].paper.mae, 1.586);
  EXPECT_EQ(rows[1].paper.mae, 0.0);
  EXPECT_EQ(rows[2].paper.traced_ssim, 0.938);
  for (const PaperRow& row : rows) EXPECT_FALSE(row.is_traced());
}

TEST(PaperReport, SettingsStandBesideThePapersError) {
  RowChoice choice = small_choice();
  choice.only = {"logo"};
  const std::string text = paper_report({made(choose_rows(choice).front(), 0.0015)}, "a machine");
  EXPECT_THAT(text, HasSubstr("| logo (SIGGRAPH) |"));
  EXPECT_THAT(text, HasSubstr("512² |"));
  EXPECT_THAT(text, HasSubstr("641×737 |"));
  EXPECT_THAT(text, HasSubstr("1.500 |"));
  EXPECT_THAT(text, HasSubstr("1.029 |"));
  EXPECT_THAT(text, HasSubstr("Machine: a machine\n"));
  EXPECT_THAT(text, Not(HasSubstr("Fig. 10")));
}

TEST(PaperReport, AVariantThatTheProgramRefusesIsNotAvailable) {
  RowChoice choice = small_choice();
  choice.only = {"ablation-logo"};
  std::vector<PaperResult> results;
  for (const PaperRow& row : choose_rows(choice)) results.push_back(made(row, 0.002));
  results.front().status = PaperResult::Status::kRefused;
  results.front().message = "no such option";
  const std::string text = paper_report(results, "");
  EXPECT_THAT(text, HasSubstr("| logo, MAE ×10⁻³ |     not available |"));
  EXPECT_THAT(text, HasSubstr("ablation-logo-no-transport: no such option"));
  EXPECT_THAT(text, HasSubstr(" 2.000 |"));
}

}  // namespace
}  // namespace lensforge::bench
