// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stop_token>
#include <string>

#include "design/graded_mesh.h"
#include "design/test_setups.h"
#include "design/transport/mesh_fit.h"

namespace lensforge {
namespace {

using testing::projected_areas;

const Eigen::Vector2d kSize(60.0, 40.0);
const OpticalSetup kSetup = testing::setup_of(kSize, {60, 40}, 200.0);
constexpr GridShape kShape{76, 58};

/// What the faces serve if the image area per lens area is density(x / width, y / height).
Eigen::VectorXd image_area(const SurfaceMesh& mesh,
                           const std::function<double(double, double)>& density) {
  Eigen::VectorXd area = projected_areas(mesh);
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const Eigen::Vector3d c = (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3.0;
    area[t] *= density(c.x() / kSize.x(), c.y() / kSize.y());
  }
  return area / area.sum();
}

double uniform(double, double) { return 1.0; }
double left_half_serves_three_quarters(double x, double) { return x < 0.5 ? 1.5 : 0.5; }
double falling_ramp(double x, double) { return 1.8 - 1.6 * x; }
/// An ellipse on the lens, 9 by 6 mm in half axes, that serves most of the picture.
double dark_spot(double x, double y) { return std::hypot(x - 0.4, y - 0.55) < 0.15 ? 8.0 : 0.1; }

SurfaceMesh spread(const std::function<double(double, double)>& density, double share) {
  SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
  EXPECT_TRUE(spread_vertices({mesh, image_area(mesh, density)}, share, kSetup, Executor::serial(),
                              RunControl(), mesh));
  return mesh;
}

double largest_motion(const SurfaceMesh& mesh) {
  return (mesh.vertices - make_grid_mesh(kSize, kShape, 5.0).vertices).cwiseAbs().maxCoeff();
}

/// A twentieth of the lens serves a third of the picture.
double dark_corner(double x, double y) { return x < 0.25 && y < 0.2 ? 10.0 : 1.0; }

TEST(FavourDark, EvenBrightnessChangesNothing) {
  const SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
  const Eigen::VectorXd areas = image_area(mesh, uniform);
  EXPECT_LT((favour_dark({mesh, areas}, kSetup) - areas).cwiseAbs().maxCoeff(),
            1e-9 * areas.maxCoeff());
}

TEST(FavourDark, WeighsByAPowerOfTheBrightness) {
  const SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
  const Eigen::VectorXd areas = image_area(mesh, dark_spot);
  const Eigen::VectorXd weighed = favour_dark({mesh, areas}, kSetup);
  // Of two faces of the same size one is as many times darker as it serves more.
  const Eigen::ArrayXd light = projected_areas(mesh).array();
  const Eigen::ArrayXd darkness = areas.array() / light;
  const Eigen::ArrayXd weight = weighed.array() / areas.array();
  Eigen::Index dark = 0;
  Eigen::Index bright = 0;
  darkness.maxCoeff(&dark);
  darkness.minCoeff(&bright);
  const double power =
      std::log(weight[dark] / weight[bright]) / std::log(darkness[dark] / darkness[bright]);
  for (Eigen::Index f = 0; f < areas.size(); ++f) {
    EXPECT_NEAR(weight[f] / weight[bright], std::pow(darkness[f] / darkness[bright], power), 1e-9);
  }
  EXPECT_GT(power, 0.0);
  EXPECT_LE(power, 0.3 + 1e-12);
}

TEST(FavourDark, TakesNoMoreThanATenthFromTheOthers) {
  const SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
  const Eigen::VectorXd some = image_area(mesh, dark_corner);
  const Eigen::VectorXd half = image_area(mesh, left_half_serves_three_quarters);
  for (const Eigen::VectorXd& areas : {some, half}) {
    const double cost = favour_dark({mesh, areas}, kSetup).sum() / areas.sum();
    EXPECT_GT(cost, 1.001);
    EXPECT_LE(cost, 1.1);
  }
  EXPECT_NEAR(favour_dark({mesh, some}, kSetup).sum() / some.sum(), 1.1, 1e-3);
}

TEST(FavourDark, BlackServesNothingStill) {
  const SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
  Eigen::VectorXd areas = image_area(mesh, falling_ramp);
  areas.head(areas.size() / 3).setZero();
  const Eigen::VectorXd weighed = favour_dark({mesh, areas}, kSetup);
  EXPECT_EQ(weighed.head(areas.size() / 3).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_TRUE(weighed.allFinite());
}

TEST(VertexSpread, AnEvenlyServedPictureLeavesTheMesh) {
  EXPECT_LT(largest_motion(spread(uniform, 0.9)), 1e-4);
}

TEST(VertexSpread, NoShareLeavesTheMesh) {
  EXPECT_LT(largest_motion(spread(left_half_serves_three_quarters, 0.0)), 1e-4);
}

/// Where the monotone rearrangement sends a column: the share of vertices left of the result is x.
/// By bisection of the density's integral.
double rearranged(const std::function<double(double)>& cumulative, double x) {
  double low = 0.0;
  double high = 1.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (cumulative(middle) < x ? low : high) = middle;
  }
  return low;
}

TEST(VertexSpread, ARampIsRearrangedMonotonely) {
  const SurfaceMesh flat = make_grid_mesh(kSize, kShape, 5.0);
  double worst = 0.0;
  for (const double share : {0.5, 0.9}) {
    const SurfaceMesh mesh = spread(falling_ramp, share);
    const auto cumulative = [&](double x) { return x + share * (0.8 * x - 0.8 * x * x); };
    for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
      const double x = rearranged(cumulative, flat.vertices(0, v) / kSize.x());
      const Eigen::Vector3d expected(x * kSize.x(), flat.vertices(1, v), 5.0);
      worst = std::max(worst, (mesh.vertices.col(v) - expected).norm());
    }
  }
  RecordProperty("worst_mm", std::to_string(worst));
  // A picture pixel is a millimetre; the vertices move by up to 12.
  EXPECT_LT(worst, 0.15);
}

TEST(VertexSpread, HalfThatServesThreeQuartersOfThePictureGetsItsVertices) {
  const double share = 0.8;
  const Eigen::VectorXd before = projected_areas(make_grid_mesh(kSize, kShape, 5.0));
  const SurfaceMesh mesh = spread(left_half_serves_three_quarters, share);
  const Eigen::VectorXd after = projected_areas(mesh);
  double worst = 0.0;
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const double x = (mesh.corner(t, 0).x() + mesh.corner(t, 1).x() + mesh.corner(t, 2).x()) / 3.0;
    // Where the density jumps, the map is smooth over some pixels.
    if (std::fabs(x - 0.5 * kSize.x()) < 6.0) continue;
    const double density = 1.0 - share + share * (x < 0.5 * kSize.x() ? 1.5 : 0.5);
    worst = std::max(worst, std::fabs(after[t] / before[t] * density - 1.0));
  }
  RecordProperty("worst_ratio", std::to_string(worst));
  EXPECT_LT(worst, 0.03);
}

TEST(VertexSpread, TrianglesKeepTheirOrientationAndTheLensItsOutline) {
  const SurfaceMesh flat = make_grid_mesh(kSize, kShape, 5.0);
  for (const auto density : {left_half_serves_three_quarters, falling_ramp, dark_spot}) {
    const SurfaceMesh mesh = spread(density, 0.95);
    const Eigen::VectorXd areas = projected_areas(mesh);
    RecordProperty("least_share", std::to_string(areas.minCoeff() / projected_areas(flat).mean()));
    EXPECT_GT(areas.minCoeff(), 0.0);
    EXPECT_NEAR(areas.sum(), kSize.prod(), 1e-9 * kSize.prod());
    for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
      for (int k = 0; k < 2; ++k) {
        const double border = flat.vertices(k, v);
        if (border == 0.0 || border == kSize[k]) {
          EXPECT_EQ(mesh.vertices(k, v), border) << v;
        }
      }
      EXPECT_EQ(mesh.vertices(2, v), 5.0);
    }
  }
}

TEST(VertexSpread, ASmallSpotGetsItsShareOfVertices) {
  const SurfaceMesh flat = make_grid_mesh(kSize, kShape, 5.0);
  const double share = 0.5;
  const SurfaceMesh mesh = spread(dark_spot, share);
  const Eigen::VectorXd served = image_area(flat, dark_spot);
  const auto in_spot = [](const Eigen::Vector3d& p) {
    return dark_spot(p.x() / kSize.x(), p.y() / kSize.y()) > 1.0;
  };
  double wanted = 0.0;
  double got = 0.0;
  const Eigen::VectorXd before = projected_areas(flat);
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    if (in_spot((flat.corner(t, 0) + flat.corner(t, 1) + flat.corner(t, 2)) / 3.0)) {
      wanted += share * served[t] + (1.0 - share) * before[t] / kSize.prod();
    }
    // As many faces as the even mesh has on this area.
    if (in_spot((mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3.0)) {
      got += before[t] / kSize.prod();
    }
  }
  RecordProperty("wanted", std::to_string(wanted));
  RecordProperty("got", std::to_string(got));
  EXPECT_NEAR(got / wanted, 1.0, 0.1);
}

TEST(VertexSpread, LeavesTheMeshAloneWhenAskedToStop) {
  const SurfaceMesh flat = make_grid_mesh(kSize, kShape, 5.0);
  SurfaceMesh mesh = flat;
  std::stop_source stop;
  stop.request_stop();
  EXPECT_FALSE(spread_vertices({mesh, image_area(mesh, falling_ramp)}, 0.5, kSetup,
                               Executor::serial(), RunControl(stop.get_token(), {}), mesh));
  EXPECT_EQ(mesh.vertices, flat.vertices);
}

TEST(VertexSpread, ThreadCountDoesNotChangeABit) {
  const SurfaceMesh serial = spread(dark_spot, 0.5);
  for (const int threads : {1, 2}) {
    SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
    spread_vertices({mesh, image_area(mesh, dark_spot)}, 0.5, kSetup, Executor::cpu(threads),
                    RunControl(), mesh);
    EXPECT_EQ(mesh.vertices, serial.vertices);
  }
}

}  // namespace
}  // namespace lensforge
