// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/proposal/proposal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "core/error.h"

namespace lensforge {
namespace {

/// A bright disc with soft edges on grey.
Image disc(int side) {
  Image image(side, side);
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      const double x = (column + 0.5) / side - 0.5;
      const double y = (row + 0.5) / side - 0.5;
      image.at(column, row) = x * x + y * y < 0.09 ? 0.9F : 0.2F;
    }
  }
  return image;
}

ProposalWish wish_for(const std::string& lamp) {
  ProposalWish wish;
  set_lamp(wish.design.light, lamp);
  return wish;
}

double minutes_of(const std::vector<OperationMinutes>& operations, const std::string& name) {
  for (const OperationMinutes& one : operations) {
    if (one.name == name) return one.minutes;
  }
  return 0.0;
}

TEST(Proposal, ASourceOfTwiceTheWidthShowsHalfAsManyPixels) {
  const int narrow = sharp_pixels(wish_for("led:3mm@600mm"), {256, 256});
  const int wide = sharp_pixels(wish_for("led:6mm@600mm"), {256, 256});
  EXPECT_NEAR(narrow, 2 * wide, 2);
  // The lamp's image: 3 mm × 300 mm / 600 mm, 1.5 mm of 100.
  EXPECT_NEAR(narrow, 66, 3);
}

TEST(Proposal, DiffractionLimitsALaser) {
  // √(λ f) = √(532e-6 × 300) mm = 0.4 mm of 100.
  EXPECT_NEAR(sharp_pixels(wish_for("laser"), {256, 256}), 250, 5);
}

TEST(Proposal, TimesAreThoseOfALongCut) {
  // A 256² portrait on 100 mm, as cam times its programs: 39.9, 77.8 and 343.9 minutes.
  const std::vector<OperationMinutes> times =
      operation_times(CamOptions(), {100.0, 100.0}, 11.2, 5.6);
  EXPECT_NEAR(minutes_of(times, "rough"), 39.9, 0.25 * 39.9);
  EXPECT_NEAR(minutes_of(times, "semi"), 77.8, 0.03 * 77.8);
  EXPECT_NEAR(minutes_of(times, "finish"), 343.9, 0.02 * 343.9);
}

TEST(Proposal, HoursLimitTheWidth) {
  ProposalWish wish = wish_for("laser");
  wish.hours = 0.5;
  wish.design.pixels = 16;
  wish.pixelled = true;
  const std::vector<Proposal> proposals = propose(disc(32), wish, Executor::cpu(), {});
  ASSERT_FALSE(proposals.empty());
  const Proposal& first = proposals.front();
  EXPECT_LT(first.design.width, 30.0);
  EXPECT_GT(first.design.width, 10.0);
  EXPECT_LE(first.forecast.minutes(), 33.0);
  EXPECT_EQ(first.design.pixels, 16);
  EXPECT_GT(first.forecast.sharp_pixels, 16);
  EXPECT_GT(first.forecast.mae, 0.0);
  EXPECT_DOUBLE_EQ(first.forecast.contrast, 0.0);  // The picture has no dark pixel.
  EXPECT_GE(first.forecast.sheet, first.design.thickness + first.forecast.relief);
  for (const Proposal& other : proposals) EXPECT_GT(other.forecast.sheet, 0.0);
}

TEST(Proposal, ATrialIsLitAsTheLensIs) {
  ProposalWish wish;
  wish.sized = wish.pixelled = true;
  wish.design.width = 10.0;
  wish.design.focal_length = 40.0;
  wish.design.pixels = 128;
  wish.design.rounds = 1;  // Both are the same whatever the trial's quality.
  wish.design.light.source = SourceKind::kPoint;
  wish.design.light.source_distance = 30.0;
  const Image picture = disc(128);
  const Executor executor = Executor::cpu();
  const double expected = propose(picture, wish, executor, {}).front().forecast.relief;
  wish.design.light.source_distance = 0.0;
  wish.design.light.source_position = Eigen::Vector3d(5.0, 5.0, -30.0);
  EXPECT_DOUBLE_EQ(propose(picture, wish, executor, {}).front().forecast.relief, expected);
}

ProposalWish print_wish(int pixels) {
  ProposalWish wish;
  wish.cut.part = PartKind::kPrint;
  wish.sized = wish.pixelled = true;
  wish.design.width = 30.0;
  wish.design.focal_length = 90.0;
  wish.design.pixels = pixels;
  return wish;
}

TEST(Proposal, AFilmLimitsAPrint) {
  ProposalWish wish = print_wish(16);
  wish.design.width = 100.0;
  // 2.35 × 0.3 mm of 100; what steps spread is no limit.
  EXPECT_NEAR(sharp_pixels(wish, {256, 256}), 141, 1);
}

TEST(Proposal, ThinnerLayersShowMoreOfAPicture) {
  ProposalWish wish = print_wish(24);
  const Image picture = disc(24);
  const auto first = [&](double layer) {
    wish.cut.workshop.printer.layer = layer;
    return propose(picture, wish, Executor::cpu(), {}).front().forecast;
  };
  const ProposalForecast coarse = first(0.05);
  const ProposalForecast fine = first(0.01);
  ASSERT_TRUE(coarse.print && fine.print);
  EXPECT_FALSE(coarse.waves);
  EXPECT_GT(coarse.print->steps_mae, 2.0 * fine.print->steps_mae);
  // What the film alone leaves is the same.
  EXPECT_NEAR(coarse.mae - coarse.print->steps_mae, fine.mae - fine.print->steps_mae, 1e-12);
  EXPECT_GT(coarse.print->terraces.share, fine.print->terraces.share);
  EXPECT_NEAR(static_cast<double>(fine.print->run.layers),
              5.0 * static_cast<double>(coarse.print->run.layers), 5.0);
  EXPECT_DOUBLE_EQ(coarse.minutes(), coarse.print->run.minutes);
}

TEST(Proposal, APrintKeepsToTheBedAndTheHours) {
  ProposalWish wish = print_wish(16);
  wish.cut.workshop.printer.bed = {20.0, 25.0, 100.0};
  EXPECT_THROW((void)propose(disc(32), wish, Executor::cpu(), {}), InputError);
  wish.sized = false;
  wish.design.focal_length = 300.0;
  EXPECT_EQ(propose(disc(32), wish, Executor::cpu(), {}).front().design.width, 20.0);
  wish.hours = 0.6;
  const Proposal quick = propose(disc(32), wish, Executor::cpu(), {}).front();
  EXPECT_LT(quick.design.width, 20.0);
}

TEST(Proposal, ContradictionsAreRefused) {
  ProposalWish wish = wish_for("led:3mm@600mm");
  wish.design.light.source_position = Eigen::Vector3d(0.0, 0.0, -100.0);
  EXPECT_THROW((void)propose(disc(32), wish, Executor::cpu(), {}), InputError);
}

}  // namespace
}  // namespace lensforge
