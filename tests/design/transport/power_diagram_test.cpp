// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/power_diagram.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <optional>
#include <stop_token>
#include <vector>

#include "core/error.h"
#include "design/test_setups.h"
#include "design/transport_scenes.h"

namespace lensforge::power_diagram_test {
namespace {

using testing::Random;

PowerDiagram diagram_of(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& weights) {
  return {sites, weights, spatial_order(sites), std::stop_token()};
}

std::optional<PowerDiagram> reweighted(const PowerDiagram& diagram,
                                       const Eigen::VectorXd& weights) {
  return diagram.reweighted(weights, spatial_order(diagram.sites()), Executor::serial());
}

/// Sites 1 apart; every four neighbours lie on a circle.
Eigen::Matrix2Xd square_grid(int columns, int rows) {
  Eigen::Matrix2Xd sites(2, columns * rows);
  for (int i = 0; i < columns * rows; ++i) sites.col(i) = Eigen::Vector2d(i % columns, i / columns);
  return sites;
}

/// Weights of a random convex potential: every site keeps its cell.
Eigen::VectorXd convex_weights(const Eigen::Matrix2Xd& sites, Random& random) {
  const double a = random.between(0.1, 3.0);
  const double b = random.between(0.1, 3.0);
  const double c = random.between(-0.5, 0.5) * std::sqrt(a * b);
  const Eigen::Vector2d shift = 5.0 * random.vector2();
  return Eigen::VectorXd::NullaryExpr(sites.cols(), [&](Eigen::Index i) {
    const Eigen::Vector2d x = sites.col(i);
    const double psi = 0.5 * (a * x.x() * x.x() + b * x.y() * x.y()) + c * x.x() * x.y() +
                       shift.dot(x) + 0.01 * std::exp(0.1 * x.x());
    return x.squaredNorm() - 2.0 * psi;
  });
}

void expect_same_edges(const PowerDiagram& diagram, const PowerDiagram& expected) {
  const std::vector<DualEdge> edges = diagram.dual_edges(100.0, Executor::serial());
  const std::vector<DualEdge> others = expected.dual_edges(100.0, Executor::serial());
  ASSERT_EQ(edges.size(), others.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    ASSERT_EQ(edges[e].left, others[e].left);
    ASSERT_EQ(edges[e].right, others[e].right);
    ASSERT_EQ(edges[e].from, others[e].from);
    ASSERT_EQ(edges[e].to, others[e].to);
  }
}

/// Flips from diagram to diagram and compares each with one built from scratch.
void expect_flips_to_agree(const Eigen::Matrix2Xd& sites,
                           const std::vector<Eigen::VectorXd>& weights) {
  PowerDiagram diagram = diagram_of(sites, Eigen::VectorXd::Zero(sites.cols()));
  ASSERT_TRUE(diagram.hidden().empty());
  for (const Eigen::VectorXd& w : weights) {
    std::optional<PowerDiagram> next = reweighted(diagram, w);
    const PowerDiagram rebuilt = diagram_of(sites, w);
    ASSERT_EQ(next.has_value(), rebuilt.hidden().empty());
    if (!next) continue;
    expect_same_edges(*next, rebuilt);
    diagram = std::move(*next);
  }
}

std::vector<Eigen::VectorXd> convex_and_back(const Eigen::Matrix2Xd& sites, Random& random) {
  std::vector<Eigen::VectorXd> weights;
  weights.reserve(5);
  for (int round = 0; round < 4; ++round) weights.push_back(convex_weights(sites, random));
  weights.emplace_back(Eigen::VectorXd::Zero(sites.cols()));
  return weights;
}

TEST(RegularTriangulation, FlippedIsAsRebuiltOnRandomSites) {
  Random random(31);
  for (int round = 0; round < 8; ++round) {
    const Eigen::Matrix2Xd sites =
        testing::random_sites(4 + random.below(900), {20, 20}, 0.2, random);
    expect_flips_to_agree(sites, convex_and_back(sites, random));
  }
}

TEST(RegularTriangulation, FlippedIsAsRebuiltWhereSitesLieOnCirclesAndLines) {
  Random random(32);
  for (const auto& [columns, rows] : {std::pair{2, 2}, {2, 9}, {7, 5}, {30, 30}}) {
    const Eigen::Matrix2Xd sites = square_grid(columns, rows);
    expect_flips_to_agree(sites, convex_and_back(sites, random));
    // Integer weights: heights are equal or in one plane, to the bit.
    std::vector<Eigen::VectorXd> weights;
    weights.reserve(20);
    for (int round = 0; round < 20; ++round) {
      weights.emplace_back(Eigen::VectorXd::NullaryExpr(
          sites.cols(), [&] { return 0.25 * random.below(round % 3 + 2); }));
    }
    expect_flips_to_agree(sites, weights);
  }
}

TEST(RegularTriangulation, FlippedIsAsRebuiltOnFacesOfAGrid) {
  Random random(33);
  const Eigen::Matrix2Xd sites = testing::face_sites(24, 48);
  expect_flips_to_agree(sites, convex_and_back(sites, random));
}

TEST(RegularTriangulation, GivesNothingExactlyWhereASiteIsHidden) {
  Random random(34);
  int hiding = 0;
  for (int round = 0; round < 400; ++round) {
    const Eigen::Matrix2Xd sites = testing::random_sites(3 + random.below(12), {8, 8}, 0.0, random);
    const Eigen::VectorXd weights = Eigen::VectorXd::NullaryExpr(
        sites.cols(), [&] { return random.between(0.0, round % 2 == 0 ? 1.0 : 6.0); });
    const PowerDiagram start = diagram_of(sites, Eigen::VectorXd::Zero(sites.cols()));
    const PowerDiagram rebuilt = diagram_of(sites, weights);
    const std::optional<PowerDiagram> flipped = reweighted(start, weights);
    ASSERT_EQ(flipped.has_value(), rebuilt.hidden().empty());
    if (flipped) {
      expect_same_edges(*flipped, rebuilt);
    } else {
      ++hiding;
    }
  }
  EXPECT_GT(hiding, 50);
  EXPECT_LT(hiding, 350);
}

TEST(RegularTriangulation, RaisesSitesThatWouldBeHidden) {
  Random random(38);
  int raised = 0;
  for (int round = 0; round < 100; ++round) {
    const Eigen::Matrix2Xd sites = round % 4 == 0
                                       ? square_grid(4 + random.below(5), 4 + random.below(5))
                                       : testing::random_sites(50, {8, 8}, 0.0, random);
    const auto count = static_cast<int>(sites.cols());
    const Eigen::VectorXd weights =
        Eigen::VectorXd::NullaryExpr(count, [&] { return random.between(0.0, 2.0); });
    const PowerDiagram start = diagram_of(sites, Eigen::VectorXd::Zero(count));
    const auto shown =
        start.reweighted(weights, spatial_order(sites), Executor::serial(), 100 * count);
    ASSERT_TRUE(shown);
    EXPECT_GE((shown->weights() - weights).minCoeff(), 0.0);
    const PowerDiagram rebuilt = diagram_of(sites, shown->weights());
    EXPECT_TRUE(rebuilt.hidden().empty());
    expect_same_edges(*shown, rebuilt);
    const PowerDiagram asked = diagram_of(sites, weights);
    EXPECT_EQ(shown->weights() == weights, asked.hidden().empty());
    for (const int i : asked.hidden()) EXPECT_GT(shown->weights()[i], weights[i]);
    raised += static_cast<int>(asked.hidden().size());
  }
  EXPECT_GT(raised, 100);
}

TEST(RegularTriangulation, RaisesNoMoreOftenThanAllowed) {
  Eigen::Matrix2Xd sites(2, 4);
  sites << 0, 4, 0, 1, 0, 0, 4, 1;
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(4);
  weights[3] = -30.0;
  const PowerDiagram start = diagram_of(sites, Eigen::VectorXd::Zero(4));
  EXPECT_FALSE(start.reweighted(weights, spatial_order(sites), Executor::serial(), 0));
  const auto shown = start.reweighted(weights, spatial_order(sites), Executor::serial(), 1);
  ASSERT_TRUE(shown);
  // Heights 0, 16 and 16: the plane passes the site at 8; the site's height was 2, so 6 below.
  EXPECT_NEAR(shown->weights()[3], 2.0 - (8.0 - 0.5 * 6.0), 1e-14);
}

TEST(RegularTriangulation, ComesBackFromHiddenSitesAndFromALine) {
  Random random(35);
  const Eigen::Matrix2Xd sites = testing::random_sites(60, {8, 8}, 0.0, random);
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(60);
  weights[17] = -100.0;
  const PowerDiagram hiding = diagram_of(sites, weights);
  ASSERT_EQ(hiding.hidden(), std::vector<int>{17});
  const std::optional<PowerDiagram> back = reweighted(hiding, Eigen::VectorXd::Zero(60));
  ASSERT_TRUE(back);
  expect_same_edges(*back, diagram_of(sites, Eigen::VectorXd::Zero(60)));
  EXPECT_FALSE(reweighted(hiding, weights));

  const Eigen::Matrix2Xd line = square_grid(9, 1);
  const PowerDiagram strips = diagram_of(line, Eigen::VectorXd::Zero(9));
  const Eigen::VectorXd moved =
      Eigen::VectorXd::NullaryExpr(9, [&] { return random.between(0, 1); });
  const std::optional<PowerDiagram> other = reweighted(strips, moved);
  ASSERT_TRUE(other);
  expect_same_edges(*other, diagram_of(line, moved));
}

TEST(RegularTriangulation, FlippedCellsAreThoseCutFromHalfPlanes) {
  Random random(36);
  const Eigen::Matrix2Xd sites = testing::random_sites(80, {9, 7}, 0.1, random);
  const SummedDensity density(Image(9, 7, 1.0F), 63.0);
  PowerDiagram diagram = diagram_of(sites, Eigen::VectorXd::Zero(80));
  for (int round = 0; round < 5; ++round) {
    const std::optional<PowerDiagram> next = reweighted(diagram, convex_weights(sites, random));
    ASSERT_TRUE(next);
    const PowerCells cells = testing::measure_cells(*next, density, Executor::serial());
    for (Eigen::Index i = 0; i < 80; ++i) {
      const testing::Polygon cell = testing::power_cell(sites, next->weights(), i, 9, 7);
      EXPECT_NEAR(cells.area[static_cast<std::size_t>(i)],
                  static_cast<double>(testing::signed_area(cell)), 1e-11);
    }
    diagram = *next;
  }
}

TEST(RegularTriangulation, FlippedIsTheSameOnOneAndTwoThreads) {
  Random random(37);
  const Eigen::Matrix2Xd sites = testing::random_sites(5000, {64, 64}, 0.0, random);
  const std::vector<int> order = spatial_order(sites);
  const PowerDiagram start = diagram_of(sites, Eigen::VectorXd::Zero(5000));
  const Eigen::VectorXd weights = convex_weights(sites, random);
  const auto one = start.reweighted(weights, order, Executor::cpu(1));
  const auto two = start.reweighted(weights, order, Executor::cpu(2));
  ASSERT_TRUE(one && two);
  expect_same_edges(*one, *two);
}

TEST(RegularTriangulation, StopsWhileItFlips) {
  std::stop_source stop;
  const Eigen::Matrix2Xd sites = testing::face_sites(20, 16);
  const PowerDiagram diagram = diagram_of(sites, Eigen::VectorXd::Zero(sites.cols()));
  stop.request_stop();
  EXPECT_THROW(
      static_cast<void>(diagram.reweighted(diagram.weights(), spatial_order(sites),
                                           Executor::serial().with_stop(stop.get_token()))),
      Interrupted);
}

TEST(PowerTest, TiesGoOneWaySeenFromEitherSide) {
  const Eigen::Matrix2Xd sites = square_grid(6, 6);
  const Eigen::VectorXd weights = Eigen::VectorXd::Zero(36);
  const PowerTest test(sites, weights);
  for (int row = 0; row < 5; ++row) {
    for (int column = 0; column < 5; ++column) {
      const int a = 6 * row + column;
      const int b = a + 1;
      const int c = b + 6;
      const int d = a + 6;
      // One of a square's diagonals stays: a c has to go if and only if b d stays.
      EXPECT_EQ(test.is_below(a, b, c, d), test.is_below(c, d, a, b));
      EXPECT_EQ(test.is_below(b, c, d, a), test.is_below(d, a, b, c));
      EXPECT_NE(test.is_below(a, b, c, d), test.is_below(b, c, d, a));
    }
  }
}

TEST(PowerTest, TellsHeightsApartThatRoundTogether) {
  Eigen::Matrix2Xd sites(2, 4);
  sites << 0.1, 1.1, 1.1, 0.1, 0.3, 0.3, 1.3, 1.3;
  Eigen::VectorXd weights = Eigen::VectorXd::Constant(4, 1000.0);
  // One unit in the last place of the weight moves the site above or below the plane.
  weights[3] = std::nextafter(1000.0, 2000.0);
  EXPECT_TRUE(PowerTest(sites, weights).is_below(0, 1, 2, 3));
  weights[3] = std::nextafter(1000.0, 0.0);
  EXPECT_FALSE(PowerTest(sites, weights).is_below(0, 1, 2, 3));
}

}  // namespace
}  // namespace lensforge::power_diagram_test
