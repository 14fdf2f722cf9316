// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/spline/spline_nodes.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/spline/sample_splines.h"
#include "design/finite_difference.h"
#include "design/random_input.h"

namespace lensforge {
namespace {

using testing::Random;
using testing::sample_spline;

constexpr int kSamples = 2;

struct Looked {
  Eigen::Matrix3Xd positions;
  Eigen::Matrix3Xd normals;
};

SplineNodesOn<Executor> nodes_of(const ControlNet& net, int samples, const Executor& executor) {
  const Eigen::Vector2i cells = net.cells();
  return {plain_basis(cells.x(), even_points(cells.x(), samples)),
          plain_basis(cells.y(), even_points(cells.y(), samples)), executor};
}

Looked look(SplineNodesOn<Executor>& nodes, const Eigen::Matrix3Xd& points) {
  const Eigen::Index count = Eigen::Index{nodes.shape().columns} * nodes.shape().rows;
  Looked looked{Eigen::Matrix3Xd(3, count), Eigen::Matrix3Xd(3, count)};
  nodes.look(points.data(), looked.positions.data(), looked.normals.data());
  return looked;
}

TEST(SplineNodes, AreThoseOfTheControlNet) {
  const ControlNet net = sample_spline();
  for (const int samples : {1, 2, 3}) {
    SplineNodesOn<Executor> nodes = nodes_of(net, samples, Executor::cpu(2));
    const SampledSurface expected = spline_nodes(net, samples);
    ASSERT_EQ(nodes.shape(), expected.mesh.grid);
    const Looked looked = look(nodes, net.points);
    EXPECT_LT((looked.positions - expected.mesh.vertices).cwiseAbs().maxCoeff(), 1e-13);
    EXPECT_LT((looked.normals - expected.normals).cwiseAbs().maxCoeff(), 1e-13);
  }
}

/// Of a random sum of positions and normals against central differences.
double adjoint_error(SplineNodesOn<Executor>& nodes, const ControlNet& net) {
  const Looked at = look(nodes, net.points);
  Random random(5);
  Looked weights = at;
  for (double& w : weights.positions.reshaped()) w = random.between(-1.0, 1.0);
  for (double& w : weights.normals.reshaped()) w = random.between(-1.0, 1.0);
  const testing::Scalar weighed = [&](const Eigen::VectorXd& x) {
    const Looked looked = look(nodes, x.reshaped(3, net.points.cols()));
    return looked.positions.cwiseProduct(weights.positions).sum() +
           looked.normals.cwiseProduct(weights.normals).sum();
  };
  Eigen::Matrix3Xd gradient(3, net.points.cols());
  look(nodes, net.points);
  nodes.look_adjoint(weights.positions.data(), weights.normals.data(), gradient.data());
  return testing::plateau_error(gradient.reshaped(), weighed, net.points.reshaped(), 1e-3);
}

TEST(SplineNodes, AdjointEqualsCentralDifferences) {
  const ControlNet net = sample_spline();
  SplineNodesOn<Executor> nodes = nodes_of(net, kSamples, Executor::serial());
  EXPECT_LT(adjoint_error(nodes, net), 1e-9);
}

TEST(SplineNodes, AdjointOfMadeNodesEqualsCentralDifferences) {
  const ControlNet net = sample_spline();
  const Eigen::Vector2i cells = net.cells();
  const MadeBy made{0.6, true, 0.9, 0.2, 1.5};
  const auto basis = [&](int axis) {
    return made_basis({axis, cells[axis], net.points.row(axis).maxCoeff()},
                      even_points(cells[axis], kSamples), made);
  };
  SplineNodesOn<Executor> nodes(basis(0), basis(1), Executor::serial());
  EXPECT_LT(adjoint_error(nodes, net), 1e-9);
}

}  // namespace
}  // namespace lensforge
