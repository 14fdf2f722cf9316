// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/two_faces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/temp_folder.h"
#include "design/design.h"
#include "design/schedule/checkpoint.h"
#include "design/test_setups.h"

namespace lensforge::two_faces {
namespace {

using ::testing::HasSubstr;
using testing::message_of;
using testing::TempFolder;

using Status = DesignResult::Status;

/// Two pictures of 8², and options of a lens for them.
struct Pair {
  Image first = testing::spot_picture(8, 8);
  DesignOptions options;

  explicit Pair(Image second) {
    options.model = SurfaceModel::kSpline;
    options.width = options.thickness = 12.0;
    options.focal_length = 30.0;
    options.pixels = 8;
    options.iterations = 3;
    options.second.file = "second.png";
    options.second.focal_length = 120.0;
    options.second.picture = std::make_shared<const Image>(std::move(second));
  }

  [[nodiscard]] DesignResult design(const RunControl& control = {}) const {
    return design_lens(first, options, Executor::serial(), control);
  }

  /// The design's faces alone, without the pictures that they make.
  [[nodiscard]] TwoFaceResult shape(const RunControl& control = {}) const {
    const DesignTask task = make_task(first, options, Executor::serial(), control);
    return shape_two_faces(task, *options.second.picture);
  }

  /// Faces whose design is stopped at its report of this number, counted from 1.
  [[nodiscard]] TwoFaceResult shape_until(int report) const {
    std::stop_source stop;
    int seen = 0;
    return shape({stop.get_token(), [&](const Progress&) {
                    if (++seen == report) stop.request_stop();
                  }});
  }
};

/// Light that faces can be found for by transport, and light that has to cross the lens.
Pair near_pair() { return Pair(Image(8, 8, 0.5F)); }
Pair crossing_pair() {
  Image second(8, 8, 0.02F);
  for (int r = 0; r < 8; ++r) second.at(7, r) = 1.0F;
  return Pair(std::move(second));
}

std::string timeless(std::vector<ConvergenceRow> rows) {
  for (ConvergenceRow& row : rows) row.seconds = 0.0;
  return convergence_csv(rows);
}

TEST(TwoFaceDesign, StoppedAnywhereAndResumedGivesTheSameBits) {
  for (const bool from_planes : {false, true}) {
    Pair pair = from_planes ? crossing_pair() : near_pair();
    int reports = 0;
    const TwoFaceResult whole = pair.shape({{}, [&](const Progress&) { ++reports; }});
    ASSERT_TRUE(whole.done);
    const TempFolder folder;
    pair.options.checkpoint = folder / "checkpoint";
    // The first report is that of transport, the others are those of iterations.
    for (const int report : {1, 2, 2 * reports / 3, reports}) {
      SCOPED_TRACE(report);
      pair.options.resume = false;
      const TwoFaceResult part = pair.shape_until(report);
      EXPECT_FALSE(part.done);
      EXPECT_EQ(part.fingerprint, whole.fingerprint);
      const Checkpoint saved = read_checkpoint(pair.options.checkpoint);
      EXPECT_EQ(saved.transporting, report == 1);
      EXPECT_EQ(saved.from_planes, from_planes && report > 1);
      pair.options.resume = true;
      const TwoFaceResult resumed = pair.shape();
      EXPECT_TRUE(resumed.done);
      EXPECT_EQ(resumed.faces.exit, whole.faces.exit);
      EXPECT_EQ(resumed.faces.front, whole.faces.front);
      EXPECT_EQ(timeless(resumed.convergence), timeless(whole.convergence));
    }
  }
}

TEST(TwoFaceDesign, StoppedWhileTheFinishedLensIsRenderedItResumes) {
  Pair pair = near_pair();
  const TempFolder folder;
  pair.options.checkpoint = folder / "checkpoint";
  std::stop_source stop;
  const auto stop_at_the_end = [&](const Progress& progress) {
    if (progress.detail == "rendering the lens") stop.request_stop();
  };
  const DesignResult part = pair.design({stop.get_token(), stop_at_the_end});
  EXPECT_EQ(part.status, Status::kInterrupted);
  EXPECT_EQ(part.message, "interrupted");
  pair.options.resume = true;
  const DesignResult resumed = pair.design();
  EXPECT_EQ(resumed.status, Status::kDone);
  EXPECT_EQ(resumed.lens.spline->points, part.lens.spline->points);
  EXPECT_EQ(resumed.convergence.size(), part.convergence.size());
}

TEST(TwoFaceDesign, AreSavedRoundByRound) {
  Pair pair = near_pair();
  const TempFolder folder;
  pair.options.checkpoint = folder / "checkpoint";
  std::vector<int> rounds;
  const auto look = [&](const Progress& progress) {
    if (!progress.detail.starts_with("MAE")) return;
    rounds.push_back(read_checkpoint(pair.options.checkpoint).round);
  };
  const TwoFaceResult whole = pair.shape({{}, look});
  ASSERT_EQ(rounds.size(), whole.convergence.size());
  for (std::size_t i = 0; i < rounds.size(); ++i) EXPECT_EQ(rounds[i], whole.convergence[i].round);
  EXPECT_EQ(rounds.back(), 1);
  EXPECT_EQ(read_checkpoint(pair.options.checkpoint).level, 1);
}

TEST(TwoFaceDesign, ResumeRefusesAnotherSecondPictureAndFacesOfNoLens) {
  Pair pair = near_pair();
  const TempFolder folder;
  pair.options.checkpoint = folder / "checkpoint";
  ASSERT_FALSE(pair.shape_until(4).done);
  const Checkpoint good = read_checkpoint(pair.options.checkpoint);
  const auto refusal = [&](const Checkpoint& changed) {
    write_checkpoint(changed, pair.options.checkpoint);
    return message_of<InputError>([&] { (void)pair.shape(); });
  };
  pair.options.resume = true;
  Checkpoint bulging = good;
  bulging.mesh.vertices(1, bulging.mesh.vertices.cols() - 2) += 0.1;
  EXPECT_THAT(refusal(bulging), HasSubstr("faces of no lens: "));
  Checkpoint folded = good;
  folded.round = 1;
  folded.front(4, 4) += 5.0;
  EXPECT_THAT(refusal(folded), HasSubstr("faces of no lens: the barriers"));
  Checkpoint half = good;
  half.front.resize(0, 0);
  EXPECT_THAT(refusal(half), HasSubstr("holds no front"));
  pair.options.second.picture = std::make_shared<const Image>(8, 8, 0.4F);
  EXPECT_THAT(refusal(good), HasSubstr("another picture or other options"));
}

}  // namespace
}  // namespace lensforge::two_faces
