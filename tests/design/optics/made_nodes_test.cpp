// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cstddef>
#include <utility>
#include <vector>

#include "core/spline/sample_splines.h"
#include "design/finite_difference.h"
#include "design/random_input.h"
#include "design/spline/made_surface.h"

namespace lensforge {
namespace {

using testing::Random;

constexpr int kSamples = 2;
/// With 25 × 17 cells of its grid, so that no node lies where its average begins to count other
/// samples: there it steps by 1e-8.
constexpr MadeBy kMade{0.8, false, 0.8, 0.05, 3.0};

/// What look() gives, as one vector: positions, then slopes.
struct Looked {
  Eigen::Matrix3Xd positions;
  Eigen::Matrix3Xd normals;
};

Looked looked(MadeNodes& nodes, const Eigen::Matrix3Xd& points) {
  const Eigen::Index count = Eigen::Index{nodes.shape().columns} * nodes.shape().rows;
  Looked result{Eigen::Matrix3Xd(3, count), Eigen::Matrix3Xd(3, count)};
  nodes.look(points.data(), result.positions.data(), result.normals.data());
  return result;
}

MadeNodes nodes_of(const ControlNet& net, const Executor& executor = Executor::serial()) {
  return {net.shape, {15.0, 10.0}, kSamples, kMade, executor};
}

TEST(MadeNodes, AreTheMadeSurfaceAboveTheNodes) {
  const ControlNet net = testing::sample_spline();
  MadeNodes nodes = nodes_of(net);
  const SampledSurface expected = made_nodes(net, kMade, kSamples, Executor::serial());
  for (int call = 0; call < 2; ++call) {  // The second one knows where samples lie.
    const Looked found = looked(nodes, net.points);
    EXPECT_LE((found.positions - expected.mesh.vertices).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LE((found.normals - expected.normals).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(MadeNodes, AdjointEqualsCentralDifferences) {
  const ControlNet net = testing::sample_spline();
  MadeNodes nodes = nodes_of(net);
  Looked bar = looked(nodes, net.points);
  Random random(5);
  for (double& b : bar.positions.reshaped()) b = random.between(-1.0, 1.0);
  for (double& b : bar.normals.topRows(2).reshaped()) b = random.between(-1.0, 1.0);
  bar.normals.row(2).setZero();  // Normals are (−slope, 1).
  Eigen::Matrix3Xd gradient(3, net.points.cols());
  nodes.look_adjoint(bar.positions.data(), bar.normals.data(), gradient.data());
  const testing::Scalar value = [&](const Eigen::VectorXd& x) {
    const Looked at = looked(nodes, x.reshaped(3, net.points.cols()));
    return at.positions.cwiseProduct(bar.positions).sum() +
           at.normals.cwiseProduct(bar.normals).sum();
  };
  for (const auto& [first, count] : {std::pair{2, 1}, {0, 2}, {0, 3}}) {
    Eigen::Matrix3Xd direction = Eigen::Matrix3Xd::Zero(3, net.points.cols());
    for (int j = 0; j < net.shape.rows; ++j) {
      for (int i = 0; i < net.shape.columns; ++i) {
        Eigen::Vector3d d = random.vector3();
        if (i == 0 || i + 1 == net.shape.columns) d.x() = 0.0;
        if (j == 0 || j + 1 == net.shape.rows) d.y() = 0.0;
        direction.col(j * net.shape.columns + i).segment(first, count) = d.segment(first, count);
      }
    }
    const double expected = gradient.cwiseProduct(direction).sum();
    std::vector<double> errors;
    for (const double step : {1e-2, 1e-3, 1e-4}) {
      errors.push_back(std::fabs(
          testing::directional_slope(value, net.points.reshaped(), direction.reshaped(), step) /
              expected -
          1.0));
    }
    EXPECT_LE(testing::plateau_error(errors), 1e-5) << first << ' ' << count;
  }
}

TEST(MadeNodes, ThreadCountDoesNotChangeABit) {
  const ControlNet net = testing::sample_spline();
  MadeNodes one = nodes_of(net);
  MadeNodes two = nodes_of(net, Executor::cpu(2));
  const Looked a = looked(one, net.points);
  const Looked b = looked(two, net.points);
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.normals, b.normals);
  Eigen::Matrix3Xd by_one(3, net.points.cols());
  Eigen::Matrix3Xd by_two = by_one;
  one.look_adjoint(a.positions.data(), a.normals.data(), by_one.data());
  two.look_adjoint(a.positions.data(), a.normals.data(), by_two.data());
  EXPECT_EQ(by_one, by_two);
}

}  // namespace
}  // namespace lensforge
