// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/laplacian.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "design/random_input.h"

namespace lensforge {
namespace {

using testing::Random;

/// A grid cut by dark bands, in which weights are `decades` orders of magnitude smaller.
WeightedGraph grid_graph(int side, double decades, Random& random) {
  WeightedGraph graph;
  graph.nodes = side * side;
  const double dark = std::pow(10.0, -decades);
  for (int r = 0; r < side; ++r) {
    for (int c = 0; c < side; ++c) {
      const int i = r * side + c;
      const bool in_band = (r / 7) % 5 == 1 || (c / 9) % 4 == 2;
      const auto weight = [&] { return (in_band ? dark : 1.0) * random.between(0.3, 3.0); };
      if (c + 1 < side) graph.edges.push_back({i, i + 1, weight()});
      if (r + 1 < side) graph.edges.push_back({i, i + side, weight()});
    }
  }
  return graph;
}

Eigen::VectorXd laplacian_times(const WeightedGraph& graph, const Eigen::VectorXd& x) {
  Eigen::VectorXd y = Eigen::VectorXd::Zero(x.size());
  for (const WeightedGraph::Edge& e : graph.edges) {
    const double flow = e.weight * (x[e.a] - x[e.b]);
    y[e.a] += flow;
    y[e.b] -= flow;
  }
  return y;
}

Eigen::VectorXd random_right(Eigen::Index count, Random& random) {
  Eigen::VectorXd right =
      Eigen::VectorXd::NullaryExpr(count, [&] { return random.between(-1.0, 1.0); });
  right.array() -= right.mean();
  return right;
}

TEST(LaplacianSolver, MeetsTheEquation) {
  Random random(1);
  const WeightedGraph graph = grid_graph(30, 3.0, random);
  const Eigen::VectorXd right = random_right(graph.nodes, random);
  const Eigen::VectorXd x = LaplacianFactor(graph).solve(right);
  EXPECT_LT((laplacian_times(graph, x) - right).norm(), 1e-7 * right.norm());
}

TEST(LaplacianSolver, LoosePartsDoNotMatter) {
  WeightedGraph graph;
  graph.nodes = 5;
  graph.edges = {{0, 1, 2.0}, {2, 3, 1e-3}};  // two pairs and a node without any tie
  Eigen::VectorXd right(5);
  right << 1.0, -1.0, 1.0, -1.0, 0.0;
  const Eigen::VectorXd x = LaplacianFactor(graph).solve(right);
  ASSERT_TRUE(x.allFinite());
  EXPECT_NEAR(x[0] - x[1], 0.5, 1e-6);
  EXPECT_NEAR(x[2] - x[3], 1000.0, 1e-3);
}

TEST(Multigrid, MeetsTheEquationWhateverTheContrast) {
  Random random(2);
  for (const double decades : {0.0, 3.0, 6.0}) {
    const WeightedGraph graph = grid_graph(150, decades, random);
    const Eigen::VectorXd right = random_right(graph.nodes, random);
    const MultigridSolution solution =
        solve_by_multigrid(graph, right, {1e-6, 100}, Executor::cpu(2));
    const double residual = (laplacian_times(graph, solution.x) - right).norm() / right.norm();
    EXPECT_LT(residual, 1e-5) << decades;
    EXPECT_LT(solution.iterations, 40) << decades;
    RecordProperty("iterations_" + std::to_string(static_cast<int>(decades)), solution.iterations);
  }
}

TEST(Multigrid, AgreesWithTheFactorisation) {
  Random random(3);
  const WeightedGraph graph = grid_graph(80, 2.0, random);
  const Eigen::VectorXd right = random_right(graph.nodes, random);
  Eigen::VectorXd direct = LaplacianFactor(graph).solve(right);
  Eigen::VectorXd iterated = solve_by_multigrid(graph, right, {1e-10, 200}, Executor::serial()).x;
  direct.array() -= direct.mean();
  iterated.array() -= iterated.mean();
  EXPECT_LT((direct - iterated).norm(), 1e-6 * direct.norm());
}

TEST(Multigrid, IsTheSameOnOneAndTwoThreads) {
  Random random(4);
  const WeightedGraph graph = grid_graph(120, 3.0, random);
  const Eigen::VectorXd right = random_right(graph.nodes, random);
  EXPECT_EQ(solve_by_multigrid(graph, right, {}, Executor::cpu(1)).x,
            solve_by_multigrid(graph, right, {}, Executor::cpu(2)).x);
}

TEST(Multigrid, NothingComesFromNothing) {
  Random random(5);
  const WeightedGraph graph = grid_graph(50, 1.0, random);
  const MultigridSolution solution =
      solve_by_multigrid(graph, Eigen::VectorXd::Zero(graph.nodes), {}, Executor::serial());
  EXPECT_EQ(solution.x, Eigen::VectorXd::Zero(graph.nodes));
}

}  // namespace
}  // namespace lensforge
