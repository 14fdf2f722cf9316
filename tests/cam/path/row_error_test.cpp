// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "cam/path/row_profile.h"
#include "cam/row_certificate.h"

namespace lensforge {
namespace {

using Eigen::Vector2d;
using lensforge::testing::certify_row;

constexpr double kTolerance = 2e-4;       // mm
constexpr double kSlopeTolerance = 4e-3;  // Of moves over waves as below.

double wave(double u) { return 0.01 * std::sin(3.0 * u) + 0.002 * std::sin(17.0 * u); }

/// Nodes a micrometre apart over 4 mm.
RowProfile wavy_profile() {
  RowProfile profile;
  for (int i = 0; i <= 4000; ++i) {
    profile.u.push_back(1e-3 * i);
    profile.z.push_back(wave(profile.u.back()));
  }
  profile.joints = profile.u;
  return profile;
}

/// To the curve's height at `to`, straight or by an arc through the curve's middle.
RowMove move_along(const Vector2d& from, double to, bool arc) {
  RowMove move{{to, wave(to)}};
  const Vector2d middle(0.5 * (from.x() + to), wave(0.5 * (from.x() + to)));
  const Vector2d half = 0.5 * (move.end - from);
  const Vector2d up(-half.y(), half.x());
  const double bow = up.normalized().dot(middle - from);
  if (!arc || std::abs(bow) < 1e-9) return move;
  move.arc = true;
  move.cap = bow > 0.0;
  const double out = 0.5 * (half.squaredNorm() / bow - bow);
  move.centre = 0.5 * (from + move.end) - out * up.normalized();
  return move;
}

/// A drop curve that jumps where one move ends and the next begins is off on one side of it.
TEST(RowError, CountsAJumpBetweenTwoMoves) {
  RowProfile profile;
  profile.u = {0.0, 1.0, 1.0, 2.0};
  profile.z = {0.0, 0.0, 0.01, 0.01};
  const PathCertificate certificate =
      certify_row(profile, {0.0, 0.0}, std::vector{RowMove{{1.0, 0.0}}, RowMove{{2.0, 0.01}}});
  EXPECT_NEAR(certificate.gouge.value, 0.01, 1e-4);
  EXPECT_GT(certificate.slope.value, 1.0);
}

/// add_within() looks as it goes, and turn() and is_close() at the whole.
TEST(RowError, AddsWhatIsWithinItsTolerancesAndNothingElse) {
  const RowProfile profile = wavy_profile();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> length(0.004, 0.12);
  RowError error(profile);
  Vector2d at(0.1, wave(0.1));
  int added = 0;
  int refused = 0;
  while (at.x() < 3.8) {
    const RowMove move = move_along(at, at.x() + length(random), random() % 2 == 0);
    const std::size_t settled = error.size();
    const bool within = error.add_within(at, move, kTolerance, kSlopeTolerance);
    error.resize(settled);
    error.add(at, move);
    EXPECT_EQ(within,
              error.is_close(settled, kTolerance) && error.turn(settled) <= kSlopeTolerance);
    const double turn = error.turn(settled);
    EXPECT_EQ(error.turn(settled, turn), turn);
    const double enough = error.turn(settled, 0.3 * turn);
    EXPECT_TRUE(enough > 0.3 * turn && enough <= turn) << enough << " of " << turn;
    if (within || refused > 10 * added) {
      at = move.end;
    } else {
      error.resize(settled);
    }
    ++(within ? added : refused);
  }
  EXPECT_GT(added, 20);
  EXPECT_GT(refused, 20);
}

TEST(RowError, AddsNothingBehindABluntEnd) {
  const RowProfile profile = wavy_profile();
  RowError error(profile);
  const Vector2d start(1.0, wave(1.0));
  const Vector2d end(1.05, wave(1.05));
  // A tent 1 micrometre over its ends, the second side as short as a stretch.
  const Vector2d top(1.045, wave(1.045) + 1e-3);
  error.add(start, RowMove{top});
  EXPECT_FALSE(error.is_blunt(top, 0.1));
  error.add(top, RowMove{end});
  ASSERT_TRUE(error.is_blunt(end, 0.1));
  const std::size_t settled = error.size();
  for (double to = 1.06; to < 1.3; to += 0.01) {
    for (const bool arc : {false, true}) {
      EXPECT_FALSE(error.add_within(end, move_along(end, to, arc), 1.0, 0.1)) << to;
      error.resize(settled);
    }
  }
}

}  // namespace
}  // namespace lensforge
