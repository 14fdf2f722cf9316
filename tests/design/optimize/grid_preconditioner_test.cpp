// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/optimize/grid_preconditioner.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <numbers>
#include <vector>

#include "design/random_input.h"

namespace lensforge {
namespace {

using testing::Random;

constexpr GridShape kShape{7, 6};
constexpr int kVertices = 42;
constexpr double kAspect = 0.87;

/// The preconditioner on the CPU, by Eigen's vectors.
class GridPreconditioner : private GridPreconditionerOn<Executor> {
 public:
  using GridPreconditionerOn<Executor>::GridPreconditionerOn;
  using GridPreconditionerOn<Executor>::set_reach;
  using GridPreconditionerOn<Executor>::xy;
  using GridPreconditionerOn<Executor>::z;

  void apply(const Eigen::VectorXd& g, Eigen::VectorXd& r) { apply_power(g, 1.0, r); }
  void apply_root(const Eigen::VectorXd& g, Eigen::VectorXd& r) { apply_power(g, 0.5, r); }

 private:
  void apply_power(const Eigen::VectorXd& g, double exponent, Eigen::VectorXd& r) {
    r.resize(g.size());
    const auto size = static_cast<std::size_t>(g.size());
    GridPreconditionerOn<Executor>::apply({g.data(), size}, exponent, {r.data(), size});
  }
};

/// x held on the left and right, y on the lower and upper border, as on a lens.
Eigen::Matrix3Xd movable() {
  Eigen::Matrix3Xd result = Eigen::Matrix3Xd::Ones(3, kVertices);
  for (int v = 0; v < kVertices; ++v) {
    if (v % 7 == 0 || v % 7 == 6) result(0, v) = 0.0;
    if (v < 7 || v >= 35) result(1, v) = 0.0;
  }
  return result;
}

class GridPreconditionerTest : public ::testing::Test {
 protected:
  GridPreconditionerTest() : preconditioner_(kShape, kAspect, movable(), Executor::serial()) {
    preconditioner_.xy = {.scale = 0.7, .floor = 0.25, .power = 1.0, .growth = 0.6};
    preconditioner_.z = {.scale = 3.0, .floor = 0.05, .power = 2.0, .growth = 0.0};
  }

  Eigen::VectorXd apply(const Eigen::VectorXd& g) {
    Eigen::VectorXd r;
    preconditioner_.apply(g, r);
    return r;
  }
  Eigen::VectorXd apply_root(const Eigen::VectorXd& g) {
    Eigen::VectorXd r;
    preconditioner_.apply_root(g, r);
    return r;
  }
  Eigen::MatrixXd matrix() {
    Eigen::MatrixXd p(3 * kVertices, 3 * kVertices);
    for (Eigen::Index i = 0; i < p.cols(); ++i) {
      p.col(i) = apply(Eigen::VectorXd::Unit(p.cols(), i));
    }
    return p;
  }

  GridPreconditioner preconditioner_;
};

Eigen::VectorXd random_vector(std::uint64_t seed) {
  Random random(seed);
  Eigen::VectorXd g(3 * kVertices);
  for (double& x : g) x = random.between(-1.0, 1.0);
  return g;
}

TEST_F(GridPreconditionerTest, IsSymmetric) {
  const Eigen::MatrixXd p = matrix();
  EXPECT_LT((p - p.transpose()).cwiseAbs().maxCoeff(), 1e-12 * p.cwiseAbs().maxCoeff());
}

TEST_F(GridPreconditionerTest, IsPositiveDefiniteOnMovableCoordinates) {
  const Eigen::MatrixXd p = matrix();
  const Eigen::VectorXd free = movable().reshaped();
  std::vector<int> kept;
  for (int i = 0; i < static_cast<int>(free.size()); ++i) {
    if (free[i] != 0.0) kept.push_back(i);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(p(kept, kept));
  EXPECT_GT(solver.eigenvalues().minCoeff(), 1e-3);
}

TEST_F(GridPreconditionerTest, HeldCoordinatesStayZeroAndAreNotRead) {
  const Eigen::VectorXd free = movable().reshaped();
  Eigen::VectorXd g = random_vector(1);
  const Eigen::VectorXd r = apply(g);
  for (Eigen::Index i = 0; i < g.size(); ++i) {
    if (free[i] == 0.0) {
      EXPECT_EQ(r[i], 0.0);
      g[i] = 1e3;
    }
  }
  EXPECT_EQ(apply(g), r);
  EXPECT_EQ((apply_root(g).array() * (1.0 - free.array())).abs().maxCoeff(), 0.0);
}

TEST_F(GridPreconditionerTest, RootTwiceIsTheWholeForHeights) {
  Eigen::VectorXd g = random_vector(2);
  // The root's square is the whole only where nothing is held in between, as for the heights.
  for (Eigen::Index i = 0; i < g.size(); ++i) {
    if (i % 3 != 2) g[i] = 0.0;
  }
  EXPECT_LT((apply_root(apply_root(g)) - apply(g)).norm(), 1e-12 * apply(g).norm());
}

/// A cosine of `i` half waves across and `j` along in coordinate k. The operator is symmetric in
/// plain sums, its cosines carry the roots of the end weights.
Eigen::VectorXd cosine_mode(int k, int i, int j) {
  Eigen::VectorXd g = Eigen::VectorXd::Zero(3 * kVertices);
  for (int v = 0; v < kVertices; ++v) {
    const int c = v % 7;
    const int r = v / 7;
    const double ends = (c == 0 || c == 6 ? 0.5 : 1.0) * (r == 0 || r == 5 ? 0.5 : 1.0);
    g[3 * v + k] = std::sqrt(ends) * std::cos(std::numbers::pi * i * c / 6.0) *
                   std::cos(std::numbers::pi * j * r / 5.0);
  }
  return g;
}

/// Eigenvalue of the grid Laplacian, by the difference of neighbours.
double cosine_eigenvalue(int i, int j) {
  return 2.0 - 2.0 * std::cos(std::numbers::pi * i / 6.0) +
         (2.0 - 2.0 * std::cos(std::numbers::pi * j / 5.0)) / (kAspect * kAspect);
}

TEST_F(GridPreconditionerTest, HeightsAreTheInverseBiharmonicOperator) {
  // On a cosine the operator is a number: s / (μ + λ)².
  const Eigen::VectorXd g = cosine_mode(2, 2, 1);
  const double expected = 3.0 / std::pow(0.05 + cosine_eigenvalue(2, 1), 2);
  EXPECT_LT((apply(g) - expected * g).norm(), 1e-13);
}

TEST_F(GridPreconditionerTest, GrowthDampsEveryCosineByItsEigenvalue) {
  for (const double power : {1.0, 1.5, 2.0}) {
    preconditioner_.z = {.scale = 3.0, .floor = 0.05, .power = power, .growth = 0.4};
    // The lowest mode's factor magnifies rounding in all others.
    const double tolerance = 1e-14 * 3.0 / std::pow(0.05, power);
    for (int i = 0; i < 7; ++i) {
      for (int j = 0; j < 6; ++j) {
        const Eigen::VectorXd g = cosine_mode(2, i, j);
        const double lambda = cosine_eigenvalue(i, j);
        const double expected = 3.0 / std::pow(0.05 + lambda, power) / (1.0 + 0.4 * lambda);
        EXPECT_LT((apply(g) - expected * g).norm(), tolerance * g.norm());
        EXPECT_LT((apply_root(g) - std::sqrt(expected) * g).norm(), tolerance * g.norm());
      }
    }
  }
}

TEST_F(GridPreconditionerTest, GrowthOfTheShiftsIsTheirOwn) {
  GridPreconditioner free(kShape, kAspect, Eigen::Matrix3Xd::Ones(3, kVertices),
                          Executor::serial());
  free.xy = preconditioner_.xy;
  free.z = preconditioner_.z;
  for (int k = 0; k < 2; ++k) {
    const Eigen::VectorXd g = cosine_mode(k, 3, 4);
    const double lambda = cosine_eigenvalue(3, 4);
    Eigen::VectorXd r;
    free.apply(g, r);
    EXPECT_LT((r - 0.7 / (0.25 + lambda) / (1.0 + 0.6 * lambda) * g).norm(), 1e-13);
  }
}

TEST_F(GridPreconditionerTest, CoordinatesDoNotMix) {
  for (int k = 0; k < 3; ++k) {
    Eigen::VectorXd g = Eigen::VectorXd::Zero(3 * kVertices);
    g[3 * 17 + k] = 1.0;
    const Eigen::VectorXd r = apply(g);
    for (Eigen::Index i = 0; i < r.size(); ++i) {
      EXPECT_EQ(i % 3 == k || r[i] == 0.0, true) << i;
    }
    EXPECT_GT(r[3 * 17 + k], 0.0);
  }
}

TEST_F(GridPreconditionerTest, ThreadCountDoesNotChangeABit) {
  GridPreconditioner parallel(kShape, kAspect, movable(), Executor::cpu(2));
  parallel.xy = preconditioner_.xy;
  parallel.z = preconditioner_.z;
  Eigen::VectorXd r;
  parallel.apply(random_vector(3), r);
  EXPECT_EQ(r, apply(random_vector(3)));
}

TEST_F(GridPreconditionerTest, ReachScalesBothSides) {
  const Eigen::VectorXd g = random_vector(21);
  Random random(5);
  Eigen::Matrix3Xd reach(3, kVertices);
  for (double& factor : reach.reshaped()) factor = random.between(0.1, 2.0);
  const auto scaled = [&](const Eigen::VectorXd& v) {
    return Eigen::VectorXd(v.cwiseProduct(reach.reshaped()));
  };
  const Eigen::VectorXd expected = scaled(apply(scaled(g)));
  preconditioner_.set_reach(reach);
  EXPECT_LT((apply(g) - expected).norm(), 1e-12 * expected.norm());
}

constexpr GridShape kGrid{40, 23};
constexpr int kNodes = kGrid.columns * kGrid.rows;

TEST(Levelling, LeavesEvenCurvatureAlone) {
  const Eigen::ArrayXd factors = levelling_factors(Eigen::VectorXd::Constant(kNodes, 7.3), kGrid);
  EXPECT_LT((factors - 1.0).abs().maxCoeff(), 1e-12);
}

/// Curvature goes with the square of reach: halves of 4 and 1 (squares 16 and 1) want 1 : 2.
TEST(Levelling, EvensOutTwoHalves) {
  Eigen::VectorXd squares = Eigen::VectorXd::Ones(kNodes);
  for (int v = 0; v < kNodes; ++v) {
    if (v % kGrid.columns < kGrid.columns / 2) squares[v] = 16.0;
  }
  const Eigen::ArrayXd factors = levelling_factors(squares, kGrid);
  const double left = factors[0];
  const double right = factors[kNodes - 1];
  EXPECT_NEAR(right / left, 2.0, 1e-12);
  EXPECT_LT(left, 1.0);
  EXPECT_GT(right, 1.0);
}

TEST(Levelling, FollowsMeansOverTheNeighbourhood) {
  testing::Random random(3);
  Eigen::VectorXd squares(kNodes);
  for (double& square : squares) square = random.between(0.5, 2.0);
  Eigen::ArrayXd wanted(kNodes);
  for (int r = 0; r < kGrid.rows; ++r) {
    for (int c = 0; c < kGrid.columns; ++c) {
      double sum = 0.0;
      int count = 0;
      for (int v = 0; v < kNodes; ++v) {
        const int far = std::max(std::abs(v % kGrid.columns - c), std::abs(v / kGrid.columns - r));
        if (far > kLevellingRadius) continue;
        sum += squares[v];
        ++count;
      }
      wanted[r * kGrid.columns + c] = -0.25 * std::log(sum / count);
    }
  }
  const Eigen::ArrayXd expected = (wanted - wanted.mean()).exp();
  EXPECT_LT((levelling_factors(squares, kGrid) - expected).abs().maxCoeff(), 1e-12);
}

TEST(Levelling, StaysWithinItsBoundWhereNothingIsFelt) {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(kNodes);
  squares.head(10 * kGrid.columns).setConstant(1e9);
  const Eigen::ArrayXd factors = levelling_factors(squares, kGrid);
  EXPECT_DOUBLE_EQ(factors.maxCoeff(), kMaxLevelling);
  EXPECT_DOUBLE_EQ(factors.minCoeff(), 1.0 / kMaxLevelling);
}

}  // namespace

}  // namespace lensforge
