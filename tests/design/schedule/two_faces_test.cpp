// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/two_faces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <stop_token>
#include <string>
#include <variant>
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

  /// A design that is stopped at its report of this number, counted from 1.
  [[nodiscard]] DesignResult design_until(int report) const {
    std::stop_source stop;
    int seen = 0;
    return design({stop.get_token(), [&](const Progress&) {
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

void expect_equal(const DesignResult& result, const DesignResult& whole) {
  ASSERT_EQ(result.status, Status::kDone);
  EXPECT_EQ(result.lens.spline->points, whole.lens.spline->points);
  const auto front = [](const DesignResult& design) {
    return std::get<HeightFront>(design.lens.setup.front.value()).spline->grid().heights;
  };
  EXPECT_EQ(front(result), front(whole));
  EXPECT_EQ(result.lens.render, whole.lens.render);
  EXPECT_EQ(result.lens.second->render, whole.lens.second->render);
  EXPECT_EQ(timeless(result.convergence), timeless(whole.convergence));
}

TEST(TwoFaceDesign, StoppedAnywhereAndResumedGiveTheSameBits) {
  for (const bool from_planes : {false, true}) {
    Pair pair = from_planes ? crossing_pair() : near_pair();
    int reports = 0;
    const DesignResult whole = pair.design({{}, [&](const Progress&) { ++reports; }});
    ASSERT_EQ(whole.status, Status::kDone);
    const TempFolder folder;
    pair.options.checkpoint = folder / "checkpoint";
    // The first report is that of transport, the last that of rendering.
    for (const int report : {1, reports / 3, 2 * reports / 3, reports - 1, reports}) {
      SCOPED_TRACE(report);
      pair.options.resume = false;
      const DesignResult part = pair.design_until(report);
      EXPECT_EQ(part.status, Status::kInterrupted);
      EXPECT_EQ(part.fingerprint, whole.fingerprint);
      const Checkpoint saved = read_checkpoint(pair.options.checkpoint);
      EXPECT_EQ(saved.transporting, report == 1);
      EXPECT_EQ(saved.from_planes, from_planes && report > 1);
      pair.options.resume = true;
      expect_equal(pair.design(), whole);
    }
  }
}

TEST(TwoFaceDesign, AreSavedRoundByRound) {
  Pair pair = near_pair();
  const TempFolder folder;
  pair.options.checkpoint = folder / "checkpoint";
  std::vector<int> rounds;
  const DesignResult whole =
      pair.design({{}, [&](const Progress& progress) {
                     if (!progress.detail.starts_with("MAE")) return;
                     rounds.push_back(read_checkpoint(pair.options.checkpoint).round);
                   }});
  ASSERT_EQ(rounds.size(), whole.convergence.size());
  for (std::size_t i = 0; i < rounds.size(); ++i) EXPECT_EQ(rounds[i], whole.convergence[i].round);
  EXPECT_EQ(rounds.back(), 1);
  EXPECT_EQ(read_checkpoint(pair.options.checkpoint).level, 1);
}

TEST(TwoFaceDesign, ResumeRefusesAnotherSecondPictureAndFacesOfNoLens) {
  Pair pair = near_pair();
  const TempFolder folder;
  pair.options.checkpoint = folder / "checkpoint";
  ASSERT_EQ(pair.design_until(4).status, Status::kInterrupted);
  const Checkpoint good = read_checkpoint(pair.options.checkpoint);
  const auto refusal = [&](const Checkpoint& changed) {
    write_checkpoint(changed, pair.options.checkpoint);
    return message_of<InputError>([&] { (void)pair.design(); });
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

/// Resuming would fail again.
TEST(TwoFaceDesign, ThatAreRefusedLeaveNoCheckpoint) {
  Pair pair = near_pair();
  const TempFolder folder;
  pair.options.checkpoint = folder / "checkpoint";
  // Light at 40° from the axis does not meet a screen that is turned by 60°.
  pair.options.light.source = SourceKind::kPoint;
  pair.options.light.source_position = Eigen::Vector3d(6.0, 6.0, -10.0);
  pair.options.second.tilt = {60.0, 0.0};
  EXPECT_THAT(message_of<InputError>([&] { (void)pair.design(); }), HasSubstr("--second-tilt 0,0"));
  EXPECT_EQ(folder.file_count(), 0U);
}

}  // namespace
}  // namespace lensforge::two_faces
