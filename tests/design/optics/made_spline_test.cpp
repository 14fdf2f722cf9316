// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/optics/made_spline.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/surface/cubic_spline.h"

namespace lensforge {
namespace {

constexpr double kWidth = 1.5;
constexpr double kHeight = 1.0;
constexpr MadeBy kMade{0.045, true, 0.2, 0.03, 0.0, 1.0};

/// A bumpy spline over an even grid with knots 0.05 mm apart.
ControlNet even_net() {
  ControlNet net{{33, 23}, Eigen::Matrix3Xd(3, 33 * 23)};
  for (int j = 0; j < 23; ++j) {
    for (int i = 0; i < 33; ++i) {
      const double x = greville_point(i, 30) * kWidth / 30;
      const double y = greville_point(j, 20) * kHeight / 20;
      net.points.col(j * 33 + i) << x, y, 5.0 + 1e-3 * std::sin(15.0 * x) * std::cos(12.0 * y);
    }
  }
  return net;
}

double rms_between(const SampledSurface& a, const SampledSurface& b) {
  const Eigen::RowVectorXd apart = a.mesh.vertices.row(2) - b.mesh.vertices.row(2);
  return std::sqrt(apart.squaredNorm() / static_cast<double>(apart.size()));
}

TEST(MadeSpline, CutsThatAreMadeForItGiveTheWantedSurface) {
  const ControlNet wanted = even_net();
  const SampledSurface meant = spline_nodes(wanted, 2);
  const double as_it_is = rms_between(made_nodes(wanted, kMade, 2, Executor::serial()), meant);
  const double unmade_first =
      rms_between(made_nodes(unmade(wanted, kMade, 1e-3), kMade, 2, Executor::serial()), meant);
  EXPECT_GT(as_it_is, 1e-5);
  EXPECT_LT(unmade_first, 0.05 * as_it_is);
}

TEST(MadeSpline, NodesStayWhereTheyAreInThePlane) {
  const ControlNet net = even_net();
  const SampledSurface made = made_nodes(net, kMade, 2, Executor::cpu(2));
  const SampledSurface plain = spline_nodes(net, 2);
  const Eigen::Matrix2Xd apart = made.mesh.vertices.topRows<2>() - plain.mesh.vertices.topRows<2>();
  EXPECT_LT(apart.cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_GT(made.normals.row(2).minCoeff(), 0.0);
}

}  // namespace
}  // namespace lensforge
