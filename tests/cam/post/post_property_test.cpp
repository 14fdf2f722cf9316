// SPDX-License-Identifier: GPL-3.0-or-later
// Random paths, written in every dialect, split and whole, and read back: the motions have to be
// those of the path, to the last decimal.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "cam/post/program_writer.h"
#include "cam/post_plans.h"
#include "cam/post_random_path.h"
#include "machine/gcode/program_seal.h"

namespace lensforge {
namespace {

using Eigen::Vector3d;
using lensforge::testing::operation_of;
using lensforge::testing::post_named;
using lensforge::testing::post_text_with;
using lensforge::testing::RandomPath;
using lensforge::testing::small_ball;
using lensforge::testing::TempFolder;
using lensforge::testing::write_programs;

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kZOffset = -7.25;
constexpr double kPlunge = 77.0;  ///< Of the tool: no move of a path has it.

/// Programs read back, whole or in parts.
std::vector<GcodeMotion> motions_of(const ProgramFiles& files) {
  std::vector<GcodeMotion> motions;
  for (const WrittenProgram& file : files.files) {
    EXPECT_EQ(check_seal(file.path), true);
    const auto sink = [&](const GcodeMotion& motion, int) { motions.push_back(motion); };
    const ProgramReading reading = read_program(file.path, files.reader, sink, {});
    EXPECT_EQ(reading.seal_holds, true);
  }
  return motions;
}

/// Compares motions with the moves that they were written from.
class Comparison {
 public:
  Comparison(const ProgramSettings& settings, const std::vector<GcodeMotion>& motions)
      : settings_(settings), motions_(motions), scale_(std::pow(10.0, settings.decimals)) {}

  void run(const std::vector<PathMove>& moves) {
    for (const PathMove& move : moves) {
      const Vector3d end = placed(move.end);
      std::vector<GcodeMotion> group = motions_for(move);
      if (move.kind == MoveKind::kRapid) {
        expect_rapid(group, end);
      } else if (move.arc_axis < 0) {
        expect_straight(group, end, move.feed);
      } else {
        expect_arc(group, move);
      }
      ASSERT_EQ(units(at_read_), units(end)) << "not at the end of the move of F " << move.feed;
      at_ = end;
    }
    while (next_ < motions_.size()) ASSERT_TRUE(motions_[next_++].rapid);
  }

 private:
  [[nodiscard]] Eigen::Matrix<std::int64_t, 3, 1> units(const Vector3d& p) const {
    return {std::llround(p.x() * scale_), std::llround(p.y() * scale_),
            std::llround(p.z() * scale_)};
  }

  std::vector<GcodeMotion> motions_for(const PathMove& move) {
    std::vector<GcodeMotion> group;
    const bool rapid = move.kind == MoveKind::kRapid;
    while (next_ < motions_.size()) {
      const GcodeMotion& motion = motions_[next_];
      if (motion.rapid != rapid || (!rapid && motion.feed != move.feed)) break;
      // A feed too short to be written may stand between two rapids.
      if (rapid && started_ && units(at_read_) == units(placed(move.end))) break;
      group.push_back(motion);
      at_read_ = motion.end;
      ++next_;
    }
    return group;
  }

  void expect_rapid(const std::vector<GcodeMotion>& group, const Vector3d& end) {
    const double low = std::min(at_.z(), end.z());
    for (const GcodeMotion& motion : group) {
      EXPECT_GE(std::min(motion.start.z(), motion.end.z()), low - 1.0 / scale_);
      const bool upright = motion.start.head<2>() == motion.end.head<2>();
      EXPECT_TRUE(upright || motion.start.z() == motion.end.z());
      const double top = std::max(at_.z(), end.z()) - 1.0 / scale_;
      EXPECT_TRUE(upright || !started_ || motion.end.z() >= top);
    }
    started_ = true;
  }

  void expect_straight(const std::vector<GcodeMotion>& group, const Vector3d& end, double feed) {
    ASSERT_EQ(group.size(), units(at_) == units(end) ? 0U : 1U) << "F " << feed;
    for (const GcodeMotion& motion : group) {
      EXPECT_FALSE(motion.arc);
      EXPECT_EQ(units(motion.end), units(end));
      EXPECT_LE((motion.end - end).cwiseAbs().maxCoeff(), 0.5000001 / scale_);
    }
  }

  /// Every point of every motion lies on the circle and at its height, and the turns add up.
  void expect_arc(const std::vector<GcodeMotion>& group, const PathMove& move) {
    const int axis = move.arc_axis;
    const Vector3d centre = placed(move.centre);
    const Vector3d end = placed(move.end);
    const double radius = flat(at_ - centre, axis).norm();
    const double close = tolerance(group);
    const double wanted = sweep_of(move, centre, end);
    const bool round = radius > 4.0 * close;  // Else rounding leaves no angle to speak of.
    double turned = 0.0;
    for (const GcodeMotion& motion : group) {
      Vector3d before = motion.start;
      for (int i = 1; i <= 64; ++i) {
        const double part = i / 64.0;
        const Vector3d point =
            motion.arc ? motion.arc->at(part) : motion.start + part * (motion.end - motion.start);
        const double along = angle(flat(before - centre, axis), flat(point - centre, axis));
        turned += along;
        before = point;
        ASSERT_NEAR(flat(point - centre, axis).norm(), radius, close) << "F " << move.feed;
      }
      const double height = at_[axis] + (end[axis] - at_[axis]) * turned / wanted;
      // A turn known to `close` in position is known to close / radius in angle.
      const double rise =
          std::abs(end[axis] - at_[axis]) * 2.0 * close / (radius * std::abs(wanted));
      if (round) {
        ASSERT_NEAR(motion.end[axis], height, 1.0 / scale_ + rise) << "F " << move.feed;
      }
    }
    if (round) {
      ASSERT_NEAR(turned, wanted, 2.0 * close / radius) << move.feed;
    }
  }

  [[nodiscard]] double tolerance(const std::vector<GcodeMotion>& group) const {
    const bool chords = !group.empty() && !group.front().arc;
    return 4.0 / scale_ + (chords ? settings_.chord_tolerance : 0.0);
  }

  static Vector3d placed(const Vector3d& point) { return point + Vector3d(0, 0, kZOffset); }

  static Eigen::Vector2d flat(const Vector3d& v, int axis) {
    return {v[(axis + 1) % 3], v[(axis + 2) % 3]};
  }

  static double angle(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
  }

  [[nodiscard]] double sweep_of(const PathMove& move, const Vector3d& centre,
                                const Vector3d& end) const {
    const Eigen::Vector2d from = flat(at_ - centre, move.arc_axis);
    const Eigen::Vector2d to = flat(end - centre, move.arc_axis);
    double sweep = (to - from).norm() < 1e-9 ? 0.0 : angle(from, to);
    if (move.clockwise && sweep >= 0.0) sweep -= kTurn;
    if (!move.clockwise && sweep <= 0.0) sweep += kTurn;
    return sweep;
  }

  const ProgramSettings& settings_;
  const std::vector<GcodeMotion>& motions_;
  double scale_;
  std::size_t next_ = 0;
  bool started_ = false;
  Vector3d at_ = Vector3d::Zero();
  Vector3d at_read_ = Vector3d::Zero();
};

ProgramPlan plan_of(const std::vector<PathMove>& moves) {
  ProgramPlan plan;
  plan.z_offset = kZOffset;
  plan.safe_z = 60.0;
  Tool tool = small_ball();
  tool.plunge = kPlunge;
  plan.operations = {operation_of("finish", tool, moves)};
  return plan;
}

std::vector<PostDescription> all_posts() {
  std::vector<PostDescription> posts;
  for (const std::string& name : builtin_posts()) posts.push_back(post_named(name));
  posts.push_back(parse_post(post_text_with("form = \"centre\"", "form = \"radius\""), "r"));
  posts.push_back(parse_post(post_text_with("form = \"centre\"", "form = \"none\""), "chords"));
  posts.push_back(parse_post(post_text_with("helix = true", "helix = false"), "flat"));
  PostDescription terse = parse_post(post_text_with("spaces = true", "spaces = false"), "terse");
  terse.trailing_zeros = false;
  terse.repeat_motion = true;
  terse.numbers = LineNumbers::kAll;
  terse.largest_number = 500;
  terse.comment_open.assign(1, ';');
  terse.comment_close.clear();
  posts.push_back(terse);
  return posts;
}

TEST(PostProperty, WhatIsReadBackIsWhatWasToBeCut) {
  for (const PostDescription& post : all_posts()) {
    for (unsigned seed = 1; seed <= 12; ++seed) {
      const TempFolder folder;
      const auto moves = RandomPath(seed).moves(400);
      ProgramSettings settings;
      settings.decimals = std::min(post.most_decimals, 3 + static_cast<int>(seed % 4));
      const ProgramFiles files = write_programs(plan_of(moves), post, settings, folder.path(), {});
      const auto motions = motions_of(files);
      Comparison(settings, motions).run(moves);
      if (::testing::Test::HasFailure()) {
        FAIL() << post.name << ", arcs " << static_cast<int>(post.arcs) << ", seed " << seed
               << ", decimals " << settings.decimals;
      }
    }
  }
}

TEST(PostProperty, PartsCutTheSamePathAsTheWhole) {
  for (const PostDescription& post : all_posts()) {
    const auto moves = RandomPath(5).moves(3500);
    ProgramSettings settings;
    settings.decimals = 4;
    const TempFolder whole_folder;
    const auto whole =
        motions_of(write_programs(plan_of(moves), post, settings, whole_folder.path(), {}));
    settings.largest_file = 1 << 16;
    const TempFolder folder;
    const ProgramFiles files = write_programs(plan_of(moves), post, settings, folder.path(), {});
    ASSERT_GT(files.files.size(), 1U);
    std::vector<GcodeMotion> parts;
    int number = 0;
    for (const WrittenProgram& file : files.files) {
      EXPECT_EQ(file.path.stem(), std::string("finish_").append(std::to_string(++number)));
      EXPECT_LE(std::filesystem::file_size(file.path), settings.largest_file);
      EXPECT_EQ(check_seal(file.path), true);
      bool first = true;
      GcodeMotion last;
      read_program(file.path, files.reader,
                   [&](const GcodeMotion& motion, int) {
                     EXPECT_TRUE(!first || (motion.rapid && motion.end.z() == 60.0));
                     first = false;
                     last = motion;
                     if (!motion.rapid && motion.feed != kPlunge) parts.push_back(motion);
                   },
                   {});
      EXPECT_TRUE(last.rapid && last.end.z() == 60.0);
    }
    std::size_t next = 0;
    for (const GcodeMotion& motion : whole) {
      if (motion.rapid) continue;
      ASSERT_LT(next, parts.size());
      const GcodeMotion& part = parts[next++];
      ASSERT_EQ(motion.start, part.start) << "line " << part.line;
      ASSERT_EQ(motion.end, part.end);
      ASSERT_EQ(motion.feed, part.feed);
      ASSERT_EQ(motion.arc.has_value(), part.arc.has_value());
      if (!motion.arc) continue;
      ASSERT_EQ(motion.arc->centre, part.arc->centre);
      ASSERT_EQ(motion.arc->sweep, part.arc->sweep);
    }
    EXPECT_EQ(next, parts.size());
  }
}

}  // namespace
}  // namespace lensforge
