// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/mesh_fit.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <functional>
#include <stop_token>
#include <string>

#include "core/error.h"
#include "design/graded_mesh.h"
#include "design/random_input.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

MongeAmpereOptions thorough_map() {
  MongeAmpereOptions options;
  options.tolerance = 1e-6;
  options.max_iterations = 4000;
  options.floor = 1e-9;
  return options;
}

MongeAmpereResult solve(const Image& picture, const MongeAmpereOptions& options) {
  return solve_monge_ampere(picture, options, RunControl());
}

/// Brightness 1 + slope·(2x − 1) along a side of unit length.
constexpr double kRamp = 0.6;

Image ramp(int columns, int rows, bool across) {
  Image image(columns, rows);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const double x = across ? (c + 0.5) / columns : (r + 0.5) / rows;
      image.at(c, r) = static_cast<float>(1.0 + kRamp * (2.0 * x - 1.0));
    }
  }
  return image;
}

/// Image of x under the monotone rearrangement: the share of light below y equals x, (1 − k) y + k
/// y² = x.
double rearranged(double x) {
  const double b = 1.0 - kRamp;
  return (-b + std::sqrt(b * b + 4.0 * kRamp * x)) / (2.0 * kRamp);
}

TEST(MongeAmpere, ARampIsRearrangedMonotonely) {
  double worst = 0.0;
  for (const bool across : {true, false}) {
    const Image picture = across ? ramp(48, 20, true) : ramp(20, 48, false);
    const MongeAmpereResult map = solve(picture, thorough_map());
    ASSERT_TRUE(map.converged);
    for (Eigen::Index i = 0; i < map.displacement.cols(); ++i) {
      const double x = static_cast<double>(across ? i % map.columns : i / map.columns) / 48.0;
      const Eigen::Vector2d move = map.displacement.col(i);
      worst =
          std::max(worst, std::fabs((across ? move.x() : move.y()) - 48.0 * (rearranged(x) - x)));
      ASSERT_NEAR(across ? move.y() : move.x(), 0.0, 1e-6);
    }
  }
  RecordProperty("worst_pixels", std::to_string(worst));
  // The border pixel's density is taken as constant up to the border; displacements reach 3.6.
  EXPECT_LT(worst, 0.04);
}

TEST(MongeAmpere, UniformLightStaysWhereItIs) {
  const MongeAmpereResult map = solve(Image(24, 16, 0.3F), {});
  EXPECT_TRUE(map.converged);
  EXPECT_EQ(map.columns, 25);
  EXPECT_EQ(map.rows, 17);
  ASSERT_EQ(map.displacement.cols(), 25 * 17);
  EXPECT_LT(map.displacement.cwiseAbs().maxCoeff(), 1e-12);
}

TEST(MongeAmpere, NothingCrossesTheBorder) {
  const MongeAmpereResult map = solve(testing::spot_picture(30, 22), {});
  for (int r = 0; r < map.rows; ++r) {
    EXPECT_EQ(map.displacement(0, r * map.columns), 0.0);
    EXPECT_EQ(map.displacement(0, r * map.columns + map.columns - 1), 0.0);
  }
  for (int c = 0; c < map.columns; ++c) {
    EXPECT_EQ(map.displacement(1, c), 0.0);
    EXPECT_EQ(map.displacement(1, (map.rows - 1) * map.columns + c), 0.0);
  }
}

/// Signed area of a cell of nodes after the map.
double mapped_area(const MongeAmpereResult& map, int c, int r) {
  const auto at = [&](int column, int row) -> Eigen::Vector2d {
    return Eigen::Vector2d(column, row) + map.displacement.col(row * map.columns + column);
  };
  const Eigen::Vector2d p = at(c + 1, r + 1) - at(c, r);
  const Eigen::Vector2d q = at(c, r + 1) - at(c + 1, r);
  return 0.5 * (p.x() * q.y() - p.y() * q.x());
}

TEST(MongeAmpere, CellsShrinkAsThePictureIsBright) {
  const Image picture = testing::spot_picture(40, 32);
  const MongeAmpereResult map = solve(picture, thorough_map());
  ASSERT_TRUE(map.converged);
  const double mean = picture.total() / (40.0 * 32.0);
  double worst = 0.0;
  for (int r = 1; r < 31; ++r) {
    for (int c = 1; c < 39; ++c) {
      const Eigen::Vector2d centre =
          Eigen::Vector2d(c + 0.5, r + 0.5) +
          0.25 * (map.displacement.col(r * 41 + c) + map.displacement.col(r * 41 + c + 1) +
                  map.displacement.col(r * 41 + c + 41) + map.displacement.col(r * 41 + c + 42));
      const auto density = static_cast<double>(
          picture.at(static_cast<int>(centre.x()), static_cast<int>(centre.y())));
      worst = std::max(worst, std::fabs(mapped_area(map, c, r) * density / mean - 1.0));
    }
  }
  RecordProperty("worst_ratio", std::to_string(worst));
  EXPECT_LT(worst, 0.15);
}

TEST(MongeAmpere, BlackPixelsGiveFiniteMonotoneMaps) {
  Image picture(32, 32);
  for (int r = 10; r < 22; ++r) {
    for (int c = 10; c < 22; ++c) picture.at(c, r) = 1.0F;
  }
  const MongeAmpereResult map = solve(picture, {});
  EXPECT_TRUE(map.displacement.allFinite());
  const Eigen::Vector2d corner_cell = map.displacement.col(33 * 8 + 8);
  EXPECT_GT(corner_cell.x(), 1.0);
  EXPECT_GT(corner_cell.y(), 1.0);
}

TEST(MongeAmpere, ReportsThatItHasNotConverged) {
  MongeAmpereOptions options = thorough_map();
  options.max_iterations = 3;
  const MongeAmpereResult map = solve(testing::spot_picture(30, 22), options);
  EXPECT_FALSE(map.converged);
  EXPECT_EQ(map.iterations, 3);
  EXPECT_GT(map.last_change, options.tolerance);
}

TEST(MongeAmpere, EndsAtOnceWhenAskedToStop) {
  std::stop_source stop;
  int reports = 0;
  const RunControl control(stop.get_token(), [&](const Progress& p) {
    EXPECT_EQ(p.done, ++reports);
    if (reports == 2) stop.request_stop();
  });
  const MongeAmpereResult map =
      solve_monge_ampere(testing::spot_picture(30, 22), thorough_map(), control);
  EXPECT_TRUE(map.stopped);
  EXPECT_FALSE(map.converged);
  EXPECT_EQ(map.iterations, 2);
}

TEST(MongeAmpere, TwoByTwoPixelsAreEnough) {
  Image picture(2, 2, 0.5F);
  picture.at(0, 0) = 1.0F;
  const MongeAmpereResult map = solve(picture, {});
  EXPECT_TRUE(map.displacement.allFinite());
  EXPECT_LT(map.displacement(0, 4), 0.0);
  EXPECT_LT(map.displacement(1, 4), 0.0);
}

using testing::projected_areas;

const Eigen::Vector2d kSize(60.0, 40.0);
const OpticalSetup kSetup = testing::setup_of(kSize, {60, 40}, 200.0);
constexpr GridShape kShape{76, 58};

/// Areas served by the faces if the image area per lens area is density(x / width, y / height).
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
/// An ellipse on the lens with half axes of 9 and 6 mm that serves most of the picture.
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

/// Image of a column under the monotone rearrangement: the share of vertices left of the result is
/// x. By bisection of the density's integral.
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
    // At a jump of the density the map is smooth over some pixels.
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
    // The number of faces of the even mesh on this area.
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

using testing::face_gradients;
using testing::graded_mesh;
using testing::Random;

const Eigen::Vector2d kFitSize(30.0, 24.0);
constexpr GridShape kFitShape{31, 29};
constexpr GridShape kSmallShape{9, 8};

HeightFitOptions thorough_fit() {
  HeightFitOptions options;
  options.tolerance = 1e-13;
  return options;
}

Eigen::Matrix2Xd random_gradients(const SurfaceMesh& mesh, std::uint64_t seed) {
  Random random(seed);
  Eigen::Matrix2Xd gradients(2, mesh.triangle_count());
  for (double& g : gradients.reshaped()) g = random.between(-0.3, 0.3);
  return gradients;
}

double paraboloid(double x, double y) {
  return 5.0 + 2e-3 * std::pow(x - 11.0, 2) - 1e-3 * (x + 3.0) * y + 3e-3 * y * y;
}

/// A flat surface at the same x, y and mean height.
SurfaceMesh flattened(SurfaceMesh mesh) {
  mesh.vertices.row(2).setConstant(mesh.vertices.row(2).mean());
  return mesh;
}

struct MeshKind {
  std::string name;
  SurfaceMesh mesh;

  friend std::ostream& operator<<(std::ostream& out, const MeshKind& k) { return out << k.name; }
};

class HeightFitMeshes : public ::testing::TestWithParam<MeshKind> {
 protected:
  /// Largest error of the heights that come from the surface's own gradients.
  double error_of_recovery(const SurfaceMesh& surface) {
    SurfaceMesh mesh = flattened(surface);
    const HeightFitSummary summary =
        fit_face_gradients(face_gradients(surface), thorough_fit(), Executor::serial(), mesh);
    EXPECT_TRUE(summary.converged);
    EXPECT_LE(summary.residual, thorough_fit().tolerance);
    RecordProperty("iterations", summary.iterations);
    EXPECT_EQ(mesh.vertices.topRows<2>(), surface.vertices.topRows<2>());
    return (mesh.vertices - surface.vertices).cwiseAbs().maxCoeff();
  }

  SurfaceMesh mesh_ = GetParam().mesh;
};

INSTANTIATE_TEST_SUITE_P(
    HeightFit, HeightFitMeshes,
    ::testing::Values(MeshKind{"Even", make_grid_mesh(kFitSize, kFitShape, 5.0)},
                      MeshKind{"Graded", graded_mesh(kFitSize, kFitShape, 0.0, 1)},
                      MeshKind{"GradedAndRough", graded_mesh(kFitSize, kFitShape, 0.15, 2)}),
    [](const ::testing::TestParamInfo<MeshKind>& kind) { return kind.param.name; });

TEST_P(HeightFitMeshes, AParaboloidComesBack) {
  for (Eigen::Index v = 0; v < mesh_.vertices.cols(); ++v) {
    mesh_.vertices(2, v) = paraboloid(mesh_.vertices(0, v), mesh_.vertices(1, v));
  }
  EXPECT_LT(error_of_recovery(mesh_), 1e-10);
}

TEST_P(HeightFitMeshes, AnyPiecewiseLinearSurfaceComesBack) {
  Random random(3);
  for (double& z : mesh_.vertices.row(2)) z += random.between(-0.2, 0.2);
  EXPECT_LT(error_of_recovery(mesh_), 1e-10);
}

TEST_P(HeightFitMeshes, ATiltedPlaneComesBack) {
  mesh_.vertices.row(2) += 0.1 * mesh_.vertices.row(0) - 0.05 * mesh_.vertices.row(1);
  EXPECT_LT(error_of_recovery(mesh_), 1e-10);
}

TEST_P(HeightFitMeshes, ASurfaceThatIsRightAlreadyStays) {
  Random random(4);
  for (double& z : mesh_.vertices.row(2)) z += random.between(-0.2, 0.2);
  SurfaceMesh mesh = mesh_;
  const HeightFitSummary summary =
      fit_face_gradients(face_gradients(mesh_), HeightFitOptions{}, Executor::serial(), mesh);
  EXPECT_TRUE(summary.converged);
  EXPECT_EQ(summary.iterations, 0);
  EXPECT_LT((mesh.vertices - mesh_.vertices).cwiseAbs().maxCoeff(), 1e-13);
}

TEST_P(HeightFitMeshes, NoGradientMakesASurfaceFlat) {
  Random random(5);
  for (double& z : mesh_.vertices.row(2)) z += random.between(-0.2, 0.2);
  const double mean = mesh_.vertices.row(2).mean();
  const HeightFitSummary summary =
      fit_face_gradients(Eigen::Matrix2Xd::Zero(2, mesh_.triangle_count()), HeightFitOptions{},
                         Executor::serial(), mesh_);
  EXPECT_TRUE(summary.converged);
  EXPECT_LT((mesh_.vertices.row(2).array() - mean).abs().maxCoeff(), 1e-6);
}

TEST_P(HeightFitMeshes, AFlatSurfaceStaysFlatUnderGradientsOfRoundingSize) {
  const Eigen::Matrix2Xd gradients = 1e-16 * random_gradients(mesh_, 6);
  const HeightFitSummary summary =
      fit_face_gradients(gradients, HeightFitOptions{}, Executor::serial(), mesh_);
  RecordProperty("iterations", summary.iterations);
  EXPECT_TRUE(mesh_.vertices.allFinite());
  EXPECT_LT((mesh_.vertices.row(2).array() - 5.0).abs().maxCoeff(), 1e-12);
}

TEST_P(HeightFitMeshes, MeanHeightIsKept) {
  Random random(7);
  for (double& z : mesh_.vertices.row(2)) z += random.between(-0.2, 0.2);
  const double mean = mesh_.vertices.row(2).mean();
  fit_face_gradients(random_gradients(mesh_, 8), HeightFitOptions{}, Executor::serial(), mesh_);
  EXPECT_NEAR(mesh_.vertices.row(2).mean(), mean, 1e-12);
}

TEST_P(HeightFitMeshes, FewIterationsAreEnough) {
  SurfaceMesh mesh = mesh_;
  const HeightFitSummary summary =
      fit_face_gradients(random_gradients(mesh_, 9), HeightFitOptions{}, Executor::serial(), mesh);
  RecordProperty("iterations", summary.iterations);
  EXPECT_TRUE(summary.converged);
  EXPECT_LT(summary.iterations, 60);
}

/// √A_i times a triangle's gradient as a matrix on the heights, two rows per triangle: by
/// differences of unit heights.
Eigen::MatrixXd dense_gradient_rows(SurfaceMesh mesh, const Eigen::VectorXd& root_areas) {
  Eigen::MatrixXd rows(2 * mesh.triangle_count(), mesh.vertex_count());
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    mesh.vertices.row(2) = Eigen::RowVectorXd::Unit(mesh.vertices.cols(), v);
    const Eigen::Matrix2Xd weighted = face_gradients(mesh) * root_areas.asDiagonal();
    rows.col(v) = weighted.reshaped();
  }
  return rows;
}

TEST(HeightFit, ContradictoryGradientsGiveTheDenseLeastSquaresSolution) {
  for (const double jitter : {0.0, 0.2}) {
    SurfaceMesh mesh = graded_mesh(kFitSize, kSmallShape, jitter, 10);
    const Eigen::Matrix2Xd gradients = random_gradients(mesh, 11);
    const Eigen::VectorXd root_areas = testing::projected_areas(mesh).cwiseSqrt();
    const Eigen::MatrixXd rows = dense_gradient_rows(mesh, root_areas);
    const Eigen::Matrix2Xd weighted = gradients * root_areas.asDiagonal();
    const Eigen::VectorXd wanted = weighted.reshaped();
    // The solution of minimum norm has mean zero.
    const Eigen::VectorXd expected = rows.completeOrthogonalDecomposition().solve(wanted);
    ASSERT_NEAR(expected.mean(), 0.0, 1e-12);
    ASSERT_TRUE(fit_face_gradients(gradients, thorough_fit(), Executor::serial(), mesh).converged);
    const Eigen::VectorXd heights = mesh.vertices.row(2).transpose().array() - 5.0;
    EXPECT_LT((heights - expected).cwiseAbs().maxCoeff(), 1e-11);
    EXPECT_LT((rows.transpose() * (rows * heights - wanted)).norm(), 1e-11 * wanted.norm());
    EXPECT_GT((rows * heights - wanted).norm(), 0.1 * wanted.norm());
  }
}

TEST(HeightFit, ReportsThatItHasNotConverged) {
  SurfaceMesh mesh = graded_mesh(kFitSize, kFitShape, 0.15, 12);
  HeightFitOptions options = thorough_fit();
  options.max_iterations = 2;
  const HeightFitSummary summary =
      fit_face_gradients(random_gradients(mesh, 13), options, Executor::serial(), mesh);
  EXPECT_FALSE(summary.converged);
  EXPECT_EQ(summary.iterations, 2);
  EXPECT_GT(summary.residual, options.tolerance);
}

TEST(HeightFit, LeavesTheMeshAloneWhenAskedToStop) {
  const SurfaceMesh before = graded_mesh(kFitSize, kFitShape, 0.15, 14);
  SurfaceMesh mesh = before;
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(fit_face_gradients(random_gradients(mesh, 15), HeightFitOptions{},
                                  Executor::cpu(2).with_stop(stop.get_token()), mesh),
               Interrupted);
  EXPECT_EQ(mesh.vertices, before.vertices);
}

TEST(HeightFit, ThreadCountDoesNotChangeABit) {
  // Above the executor's grain, so that the work is divided.
  SurfaceMesh serial = graded_mesh(kFitSize, {61, 57}, 0.15, 16);
  const SurfaceMesh start = serial;
  const Eigen::Matrix2Xd gradients = random_gradients(serial, 17);
  fit_face_gradients(gradients, HeightFitOptions{}, Executor::serial(), serial);
  for (const int threads : {1, 2}) {
    SurfaceMesh mesh = start;
    fit_face_gradients(gradients, HeightFitOptions{}, Executor::cpu(threads), mesh);
    EXPECT_EQ(mesh.vertices, serial.vertices);
  }
}

}  // namespace

}  // namespace lensforge
