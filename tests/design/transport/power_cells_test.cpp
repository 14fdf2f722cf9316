// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stop_token>
#include <string>
#include <vector>

#include "core/error.h"
#include "design/finite_difference.h"
#include "design/test_setups.h"
#include "design/transport_scenes.h"

namespace lensforge {
namespace {

using testing::cell_moments;
using testing::measure_cells;
using testing::Random;
using testing::transport_energy;

PowerDiagram diagram_of(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& weights) {
  return {sites, weights, spatial_order(sites), std::stop_token()};
}

Eigen::VectorXd random_weights(Eigen::Index count, double size, Random& random) {
  return Eigen::VectorXd::NullaryExpr(count, [&] { return random.between(-size, size); });
}

/// Largest difference of masses and moments from those of cells cut by hand, in units of the total.
double worst_difference(const PowerDiagram& diagram, const SummedDensity& density) {
  const Executor executor = Executor::serial();
  const PowerCells cells = measure_cells(diagram, density, executor);
  const std::vector<Moments> moments = cell_moments(diagram, density, executor);
  const double size = std::max(density.columns(), density.rows());
  double worst = 0.0;
  for (Eigen::Index i = 0; i < diagram.sites().cols(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const testing::Polygon cell = testing::power_cell(diagram.sites(), diagram.weights(), i,
                                                      density.columns(), density.rows());
    const Moments slow = testing::slow_moments(cell, density);
    EXPECT_NEAR(cells.area[k], static_cast<double>(testing::signed_area(cell)),
                1e-12 * size * size);
    worst = std::max(
        {worst, std::fabs(cells.mass[k] - slow.mass), std::fabs(moments[k].mass - slow.mass),
         std::fabs(moments[k].x - slow.x) / size, std::fabs(moments[k].y - slow.y) / size,
         std::fabs(moments[k].second - slow.second) / (size * size)});
  }
  return worst / density.total();
}

TEST(PowerCells, AgreeWithCellsCutFromHalfPlanesAndPixels) {
  Random random(3);
  double worst = 0.0;
  for (int round = 0; round < 12; ++round) {
    const int columns = 3 + random.below(12);
    const int rows = 3 + random.below(12);
    const Image picture = testing::random_picture(columns, rows, round % 3 == 0 ? -0.5 : 0.0, 5);
    Image clipped = picture;
    for (float& v : clipped.values()) v = std::max(v, 0.0F);
    const SummedDensity density(clipped, 7.0);
    const Eigen::Matrix2Xd sites =
        testing::random_sites(1 + random.below(40), {columns, rows}, round % 2, random);
    const double size = round % 4 == 0 ? 0.0 : 0.3 * columns * rows / 40.0 * (1 + round);
    worst = std::max(
        worst,
        worst_difference(diagram_of(sites, random_weights(sites.cols(), size, random)), density));
  }
  RecordProperty("worst", std::to_string(worst));
  EXPECT_LT(worst, 1e-13);
}

TEST(PowerCells, OfSitesOnALineAreStrips) {
  const SummedDensity density(testing::random_picture(9, 6, 0.1, 8), 1.0);
  Random random(4);
  for (const Eigen::Vector2d& along :
       {Eigen::Vector2d(1, 0), Eigen::Vector2d(0.5, 0.25), Eigen::Vector2d(0, -0.5)}) {
    Eigen::Matrix2Xd sites(2, 7);
    for (Eigen::Index i = 0; i < 7; ++i) {
      sites.col(i) = Eigen::Vector2d(1.0, 3.0) + static_cast<double>(i) * along;
    }
    EXPECT_LT(worst_difference(diagram_of(sites, random_weights(7, 0.3, random)), density), 1e-13);
  }
}

TEST(PowerCells, OfARegularGridCoverItsCorners) {
  // All vertices lie on pixel corners, four cells meet in each, and borders run along the pixels'.
  Eigen::Matrix2Xd sites(2, 36);
  const Eigen::Vector2d half(0.5, 0.5);
  for (int i = 0; i < 36; ++i) sites.col(i) = Eigen::Vector2d(i % 6, i / 6) - half;
  const SummedDensity density(testing::random_picture(4, 4, 0.1, 9), 1.0);
  EXPECT_LT(worst_difference(diagram_of(sites, Eigen::VectorXd::Zero(36)), density), 1e-13);
}

TEST(PowerCells, OfATurnedGridReachThePicturesBorder) {
  // Sites of a side lie on a line up to rounding: triangles of the hull have areas around 0.
  const SummedDensity density(testing::random_picture(8, 8, 0.1, 8), 1.0);
  double worst = 0.0;
  for (int turn = 1; turn <= 40; ++turn) {
    const Eigen::Rotation2Dd rotation(0.07 * turn);
    Eigen::Matrix2Xd sites(2, 36);
    for (int i = 0; i < 36; ++i) {
      sites.col(i) =
          Eigen::Vector2d(4.0, 4.0) + rotation * Eigen::Vector2d(i % 6 - 2.5, i / 6 - 2.5);
    }
    worst =
        std::max(worst, worst_difference(diagram_of(sites, Eigen::VectorXd::Zero(36)), density));
  }
  EXPECT_LT(worst, 1e-13);
}

TEST(PowerCells, ASingleSiteHoldsEverything) {
  const SummedDensity density(testing::random_picture(5, 4, 0.1, 2), 3.0);
  for (const Eigen::Vector2d& site : {Eigen::Vector2d(2, 2), Eigen::Vector2d(-40, 90)}) {
    const PowerDiagram diagram = diagram_of(site, Eigen::VectorXd::Zero(1));
    EXPECT_NEAR(measure_cells(diagram, density, Executor::serial()).mass[0], 3.0, 1e-14);
  }
}

TEST(PowerCells, HiddenSitesHoldNothing) {
  Random random(6);
  Eigen::Matrix2Xd sites = testing::random_sites(30, {8, 8}, 0.0, random);
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(30);
  weights[11] = -100.0;
  const PowerDiagram diagram = diagram_of(sites, weights);
  EXPECT_EQ(diagram.hidden(), std::vector<int>{11});
  const SummedDensity density(Image(8, 8, 1.0F), 1.0);
  EXPECT_EQ(measure_cells(diagram, density, Executor::serial()).mass[11], 0.0);
}

/// ∂mass/∂w as a dense matrix.
Eigen::MatrixXd newton_matrix(const PowerDiagram& diagram, const SummedDensity& density) {
  testing::MeasuredDiagram measured(diagram, density, Executor::serial());
  measured.cells();
  const std::vector<EdgeMeasure> edges = measured.stage.edge_measures(measured.edges);
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(diagram.sites().cols(), diagram.sites().cols());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const int left = measured.edges.edges[e].left;
    const int right = measured.edges.edges[e].right;
    matrix(left, right) -= edges[e].coupling;
    matrix(right, left) -= edges[e].coupling;
    matrix(left, left) += edges[e].coupling;
    matrix(right, right) += edges[e].coupling;
  }
  return matrix;
}

TEST(PowerCells, NewtonMatrixIsTheDerivativeOfTheMasses) {
  Random random(7);
  const SummedDensity density(testing::random_picture(10, 7, 0.0, 4), 5.0);
  const Eigen::Matrix2Xd sites = testing::random_sites(25, {10, 7}, 0.3, random);
  const Eigen::VectorXd weights = random_weights(25, 0.5, random);
  const Eigen::MatrixXd matrix = newton_matrix(diagram_of(sites, weights), density);
  double worst = 0.0;
  for (Eigen::Index i = 0; i < 25; ++i) {
    const auto mass = [&](const Eigen::VectorXd& w) {
      return measure_cells(diagram_of(sites, w), density, Executor::serial())
          .mass[static_cast<std::size_t>(i)];
    };
    for (const double step : {1e-5, 5e-6}) {
      const Eigen::VectorXd expected = testing::numeric_gradient(mass, weights, step);
      worst = std::max(worst, (expected - matrix.row(i).transpose()).cwiseAbs().maxCoeff());
    }
  }
  RecordProperty("worst", std::to_string(worst));
  // A vertex that crosses a pixel border within the difference causes a kink.
  EXPECT_LT(worst, 1e-4 * matrix.cwiseAbs().maxCoeff());
}

TEST(PowerCells, EnergyGradientIsTheMassError) {
  Random random(8);
  const SummedDensity density(testing::random_picture(9, 9, 0.0, 11), 2.0);
  const Eigen::Matrix2Xd sites = testing::random_sites(20, {9, 9}, 0.2, random);
  const Eigen::VectorXd weights = random_weights(20, 0.5, random);
  const Eigen::VectorXd wanted = Eigen::VectorXd::Constant(20, 0.1);
  const auto energy = [&](const Eigen::VectorXd& w) {
    const PowerDiagram diagram = diagram_of(sites, w);
    return transport_energy(diagram, cell_moments(diagram, density, Executor::serial()), wanted);
  };
  const PowerCells cells = measure_cells(diagram_of(sites, weights), density, Executor::serial());
  const Eigen::Map<const Eigen::VectorXd> mass(cells.mass.data(), 20);
  EXPECT_LT(testing::plateau_error(mass - wanted, energy, weights, 1e-3), 1e-6);
}

TEST(PowerCells, AreTheSameOnOneAndTwoThreads) {
  const SummedDensity density(testing::logo_picture(64), 1.0);
  Random random(9);
  const Eigen::Matrix2Xd sites = testing::random_sites(5000, {64, 64}, 0.1, random);
  const PowerDiagram diagram = diagram_of(sites, random_weights(5000, 0.5, random));
  testing::MeasuredDiagram one(diagram, density, Executor::cpu(1));
  testing::MeasuredDiagram two(diagram, density, Executor::cpu(2));
  EXPECT_EQ(one.cells().mass, two.cells().mass);
  const std::vector<EdgeMeasure> expected = one.stage.edge_measures(one.edges);
  const std::vector<EdgeMeasure> edges = two.stage.edge_measures(two.edges);
  ASSERT_EQ(edges.size(), expected.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    ASSERT_EQ(edges[e].coupling, expected[e].coupling);
  }
}

TEST(PowerDiagram, StopsWhileItInserts) {
  std::stop_source stop;
  stop.request_stop();
  const Eigen::Matrix2Xd sites = testing::face_sites(20, 16);
  EXPECT_THROW(PowerDiagram(sites, Eigen::VectorXd::Zero(sites.cols()), spatial_order(sites),
                            stop.get_token()),
               Interrupted);
}

TEST(PowerDiagram, PlacesPointsInTrianglesAndOnTheHull) {
  Eigen::Matrix2Xd sites(2, 4);
  sites << 0, 4, 4, 0, 0, 0, 4, 4;
  const PowerDiagram diagram = diagram_of(sites, Eigen::VectorXd::Zero(4));
  Eigen::Matrix2Xd points(2, 3);
  points << 1, 9, -3, 2, 1, -5;
  const auto places = diagram.locate(points, testing::numbers(3));
  Eigen::Matrix2Xd expected(2, 3);
  expected << 1, 4, 0, 2, 1, 0;
  for (std::size_t k = 0; k < 3; ++k) {
    Eigen::Vector2d at = Eigen::Vector2d::Zero();
    for (std::size_t j = 0; j < 3; ++j) {
      at += places[k].share[static_cast<Eigen::Index>(j)] * sites.col(places[k].sites[j]);
    }
    EXPECT_LT((at - expected.col(static_cast<Eigen::Index>(k))).norm(), 1e-14);
    EXPECT_NEAR(places[k].share.sum(), 1.0, 1e-15);
  }
}

}  // namespace
}  // namespace lensforge
