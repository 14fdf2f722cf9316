// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "design/flux/flux_triangle.h"
#include "design/random_triangles.h"

namespace lensforge {
namespace {

using testing::kColumns;
using testing::kRows;
using testing::Random;

std::vector<EdgePiece> pieces_of(const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
  std::vector<EdgePiece> pieces;
  walk_edge(p, q, kColumns, kRows, [&](const EdgePiece& e) { pieces.push_back(e); });
  return pieces;
}

/// Ends of random edges: anywhere around the picture, now and then on the pixel grid.
Eigen::Vector2d random_end(Random& random) {
  const double reach = random.below(4) == 0 ? 200.0 : 6.0;
  Eigen::Vector2d p(random.between(-reach, kColumns + reach),
                    random.between(-reach, kRows + reach));
  for (int k = 0; k < 2; ++k) {
    if (random.below(4) == 0) p[k] = std::round(p[k]);
  }
  return p;
}

template <class Check>
void for_random_edges(const Check& check) {
  Random random(11);
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector2d p = random_end(random);
    const Eigen::Vector2d q = random_end(random);
    SCOPED_TRACE(::testing::Message() << p.transpose() << " -> " << q.transpose());
    check(p, q, pieces_of(p, q));
    if (::testing::Test::HasFailure()) return;
  }
}

/// Length, as a share of the edge, of its part in low ≤ x ≤ high and 0 ≤ y ≤ kRows.
long double share_within(const Eigen::Vector2d& p, const Eigen::Vector2d& q, long double low,
                         long double high) {
  long double first = 0.0L;
  long double last = 1.0L;
  const auto cut = [&](long double from, long double delta, long double least, long double most) {
    if (delta == 0.0L) {
      if (from < least || from > most) last = -1.0L;
      return;
    }
    const long double a = (least - from) / delta;
    const long double b = (most - from) / delta;
    first = std::max(first, std::min(a, b));
    last = std::min(last, std::max(a, b));
  };
  cut(p.x(), static_cast<long double>(q.x()) - p.x(), low, high);
  cut(p.y(), static_cast<long double>(q.y()) - p.y(), 0.0L, kRows);
  return std::max(0.0L, last - first);
}

TEST(EdgeWalk, PiecesLieInTheirPixels) {
  for_random_edges([](const auto&, const auto&, const std::vector<EdgePiece>& pieces) {
    for (const EdgePiece& e : pieces) {
      ASSERT_TRUE(e.row >= 0 && e.row < kRows && e.column >= -1 && e.column < kColumns);
      ASSERT_TRUE(std::min(e.y0, e.y1) >= e.row && std::max(e.y0, e.y1) <= e.row + 1);
      if (e.column < 0) continue;
      EXPECT_GE(std::min(e.x0, e.x1), e.column - 1e-12);
      EXPECT_LE(std::max(e.x0, e.x1), e.column + 1 + 1e-12);
      EXPECT_LE(e.s0, e.s1);
    }
  });
}

TEST(EdgeWalk, NeighbouringPiecesShareTheirEnds) {
  for_random_edges([](const auto&, const auto&, const std::vector<EdgePiece>& pieces) {
    for (std::size_t i = 1; i < pieces.size(); ++i) {
      const EdgePiece& before = pieces[i - 1];
      const EdgePiece& after = pieces[i];
      ASSERT_EQ(before.y1, after.y0);
      if (before.column < 0 || after.column < 0) continue;
      EXPECT_EQ(before.x1, after.x0);
      EXPECT_EQ(before.s1, after.s0);
      EXPECT_EQ(std::abs(before.column - after.column) + std::abs(before.row - after.row), 1);
    }
  });
}

TEST(EdgeWalk, PiecesEndWhereTheirParametersSay) {
  for_random_edges(
      [](const Eigen::Vector2d& p, const Eigen::Vector2d& q, const std::vector<EdgePiece>& pieces) {
        const double tolerance = 1e-15 * ((q - p).norm() + p.norm() + 1.0);
        for (const EdgePiece& e : pieces) {
          if (e.column < 0) continue;
          EXPECT_NEAR(e.x1, p.x() + e.s1 * (q.x() - p.x()), 8.0 * tolerance);
          EXPECT_NEAR(e.y1, p.y() + e.s1 * (q.y() - p.y()), 8.0 * tolerance);
        }
      });
}

TEST(EdgeWalk, PiecesCoverThePartInThePicture) {
  for_random_edges(
      [](const Eigen::Vector2d& p, const Eigen::Vector2d& q, const std::vector<EdgePiece>& pieces) {
        double covered = 0.0;
        for (const EdgePiece& e : pieces) covered += e.column < 0 ? 0.0 : e.s1 - e.s0;
        EXPECT_NEAR(covered, static_cast<double>(share_within(p, q, 0.0L, kColumns)), 1e-12);
      });
}

TEST(EdgeWalk, LeftPiecesCoverTheRowsLeftOfThePicture) {
  for_random_edges(
      [](const Eigen::Vector2d& p, const Eigen::Vector2d& q, const std::vector<EdgePiece>& pieces) {
        if (p.x() == 0.0 && q.x() == 0.0) return;  // On the border: either side is right.
        double rise = 0.0;
        for (const EdgePiece& e : pieces) rise += e.column < 0 ? e.y1 - e.y0 : 0.0;
        const double share = static_cast<double>(share_within(p, q, -1e9L, 0.0L));
        EXPECT_NEAR(rise, share * (q.y() - p.y()), 1e-11);
      });
}

TEST(EdgeWalk, VisitsNoMorePiecesThanPromised) {
  for_random_edges(
      [](const Eigen::Vector2d& p, const Eigen::Vector2d& q, const std::vector<EdgePiece>& pieces) {
        const double columns = std::fabs(std::floor(p.x()) - std::floor(q.x()));
        const double rows = std::fabs(std::floor(p.y()) - std::floor(q.y()));
        EXPECT_LE(static_cast<double>(pieces.size()), columns + rows + 3.0);
      });
}

TEST(EdgeWalk, EdgesOutsideGiveNoPieces) {
  EXPECT_TRUE(pieces_of({2.0, -3.0}, {9.0, -0.5}).empty());
  EXPECT_TRUE(pieces_of({2.0, kRows + 0.5}, {9.0, kRows + 4.0}).empty());
  EXPECT_TRUE(pieces_of({kColumns + 0.5, 1.0}, {kColumns + 9.0, 8.0}).empty());
}

}  // namespace
}  // namespace lensforge
