// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/color.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/outline.h"
#include "core/spline/sample_splines.h"
#include "core/temp_folder.h"
#include "design/design.h"
#include "design/energy/spline_objective.h"
#include "design/finite_difference.h"
#include "design/objective_setups.h"
#include "design/ray_tracer.h"
#include "design/render.h"
#include "design/schedule/levels.h"
#include "design/setup/design_options.h"

/// Lenses that are no rectangle.
namespace lensforge {
namespace {

using testing::Goal;
using ::testing::HasSubstr;
using testing::kGoals;
using testing::kModels;
using testing::kSetup;
using testing::kSize;
using testing::message_of;
using testing::Random;
using testing::rough_mesh;

OpticalSetup disc_setup(const OpticalSetup& rectangle) {
  OpticalSetup setup = rectangle;
  setup.outline = circle_outline(setup.lens_size);
  return setup;
}

/// Mean absolute error of a picture that is not clipped, as in the objective.
double mean_absolute_error(const RenderResult& rendered, const Image& target) {
  const auto pixels = static_cast<double>(target.values().size());
  double sum = 0.0;
  for (std::size_t i = 0; i < target.values().size(); ++i) {
    const double light = static_cast<double>(rendered.image.values()[i]) / pixels * target.total();
    sum += std::fabs(encode(light) - encode(static_cast<double>(target.values()[i])));
  }
  return sum / pixels;
}

class OutlinedModels : public ::testing::TestWithParam<SurfaceModel> {};

TEST_P(OutlinedModels, AllLightOfTheOutlineReachesAWideScreen) {
  OpticalSetup setup = disc_setup(kSetup);
  setup.image_size = 3.0 * kSize;
  setup.image_origin = -kSize;
  for (const Outline& outline :
       {circle_outline(kSize), rounded_outline(kSize, 4.0),
        polygon_outline(kSize, {{0, 0}, {4, 0}, {4, 4}, {2, 1}, {0, 4}})}) {
    setup.outline = outline;
    EXPECT_NEAR(render_surface(rough_mesh(), setup, GetParam(), Executor::serial()).flux_inside,
                1.0, 1e-9);
  }
}

TEST_P(OutlinedModels, DiscAgreesWithAForwardRayTraceWithinItsErrorBars) {
  const Eigen::Vector2d size(20.0, 16.0);
  const SurfaceMesh mesh = testing::height_field(size, {23, 21}, testing::bumps);
  const OpticalSetup setup = disc_setup(testing::setup_of(size, {16, 16}, 150.0));
  const RenderResult rendered = render_surface(mesh, setup, GetParam(), Executor::cpu(2));
  constexpr std::int64_t kRays = 2'000'000;
  const auto in_disc = [&](const Eigen::Vector2d& p) {
    return (p - Eigen::Vector2d(10.0, 8.0)).norm() <= 8.0;
  };
  const std::vector<std::int64_t> hits =
      testing::RayTracer(mesh, setup, GetParam()).trace(kRays, 2026, in_disc);
  const double disc = std::numbers::pi * 64.0 / size.prod();
  double chi_square = 0.0;
  int lit = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const double share = disc * static_cast<double>(rendered.image.values()[i]) / 256.0;
    // A pixel with less expects too few rays for a bell curve.
    if (share * kRays < 25.0) {
      EXPECT_LE(hits[i], 60);
      continue;
    }
    const double z =
        (static_cast<double>(hits[i]) - share * kRays) / std::sqrt(share * (1.0 - share) * kRays);
    EXPECT_LT(std::fabs(z), 5.0) << i;
    chi_square += z * z;
    ++lit;
  }
  EXPECT_GT(lit, 150);
  EXPECT_NEAR(chi_square, lit, 5.0 * std::sqrt(2.0 * lit));
}

TEST_P(OutlinedModels, TheWrittenPartAloneMakesThePicture) {
  const SurfaceMesh mesh = rough_mesh();
  const OpticalSetup setup = disc_setup(kSetup);
  const RenderResult lens = render_surface(mesh, setup, GetParam(), Executor::serial());
  const SampledSurface part = part_inside(mesh, vertex_area_normals(mesh),
                                          cut_mesh(mesh, *setup.outline, Executor::serial()));
  const RenderResult alone =
      GetParam() == SurfaceModel::kFacet
          ? render_surface(part.mesh, kSetup, GetParam(), Executor::serial())
          : render_surface(part.mesh, part.normals, kSetup, Executor::serial());
  const double area = polygon_area(setup.outline->points) / kSize.prod();
  for (std::size_t i = 0; i < lens.image.values().size(); ++i) {
    EXPECT_NEAR(alone.image.values()[i], area * static_cast<double>(lens.image.values()[i]), 1e-6);
  }
}

TEST_P(OutlinedModels, ObjectiveSeesThePictureThatIsRendered) {
  ObjectiveOptions options = testing::options_of(GetParam(), {});
  const SurfaceMesh mesh = rough_mesh();
  const OpticalSetup setup = disc_setup(kSetup);
  DesignObjective objective(mesh, setup, testing::target(), options, Executor::serial());
  const double seen = testing::evaluate_at(objective, mesh.vertices).mae;
  const double mae = mean_absolute_error(
      render_surface(mesh, setup, GetParam(), Executor::serial()), testing::target());
  // Smooth: a corner on the outline has the mean of its neighbours' normals, not of their places.
  EXPECT_NEAR(seen, mae, GetParam() == SurfaceModel::kFacet ? 1e-6 : 1e-4);
  EXPECT_GT(seen, 0.01);
}

TEST_P(OutlinedModels, GradientEqualsCentralDifferences) {
  const ObjectiveWeights weights{1e2, 1e3, 1e-3, 2e1, 1e-8, 3e0, 2e-1, 2e0, 1e1};
  const SurfaceMesh mesh = rough_mesh();
  const OpticalSetup setup = disc_setup(kSetup);
  for (const Goal goal : kGoals) {
    const DesignGoal wanted = goal == Goal::kPicture ? DesignGoal(testing::target())
                                                     : DesignGoal(testing::correspondence());
    DesignObjective objective(mesh, setup, wanted, testing::options_of(GetParam(), weights),
                              Executor::serial());
    Eigen::Matrix3Xd gradient;
    ASSERT_TRUE(objective.evaluate(mesh.vertices, gradient).feasible);
    Random random(3);
    for (const auto& [first, count] : {std::pair{2, 1}, {0, 2}, {0, 3}}) {
      Eigen::Matrix3Xd direction = Eigen::Matrix3Xd::Zero(3, gradient.cols());
      for (double& d : direction.middleRows(first, count).reshaped()) d = random.between(-1, 1);
      direction.array() *= objective.movable().array();
      const auto f = [&](const Eigen::VectorXd& x) {
        return testing::evaluate_at(objective, x.reshaped(3, mesh.vertices.cols())).energy.total;
      };
      EXPECT_LE(testing::slope_error(f, mesh.vertices.reshaped(), gradient.reshaped(),
                                     direction.reshaped()),
                1e-6)
          << first << ' ' << count;
    }
  }
}

TEST_P(OutlinedModels, OnlyTheRimKeepsItsPlace) {
  const SurfaceMesh mesh = rough_mesh();
  const OpticalSetup setup = disc_setup(kSetup);
  const DesignObjective objective(mesh, setup, testing::target(),
                                  testing::options_of(GetParam(), {}), Executor::serial());
  int held = 0;
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    if (objective.movable().col(v).head<2>().any()) continue;
    const Eigen::Vector2d p = mesh.vertices.col(v).head<2>();
    if ((p.array() == 0.0).any() || (p.array() == kSize.array()).any()) continue;
    EXPECT_NEAR((p - 0.5 * kSize).norm(), 10.0, 1.5);
    ++held;
  }
  EXPECT_GT(held, 80);
  EXPECT_TRUE((objective.movable().row(2).array() == 1.0).all());
}

TEST_P(OutlinedModels, SameBitsForAnyNumberOfThreads) {
  const SurfaceMesh mesh = rough_mesh();
  const OpticalSetup setup = disc_setup(kSetup);
  const auto run = [&](const Executor& executor) {
    DesignObjective objective(mesh, setup, testing::target(), testing::options_of(GetParam(), {}),
                              executor);
    Eigen::Matrix3Xd gradient;
    const double total = objective.evaluate(mesh.vertices, gradient).energy.total;
    return std::pair(total, gradient);
  };
  EXPECT_EQ(run(Executor::serial()), run(Executor::cpu(3)));
}

INSTANTIATE_TEST_SUITE_P(Outlined, OutlinedModels, ::testing::ValuesIn(kModels),
                         testing::model_name);

TEST(OutlinedSpline, GradientEqualsCentralDifferences) {
  const ControlNet net = testing::sample_spline();
  const OpticalSetup setup = disc_setup(testing::setup_of({15.0, 10.0}, {24, 16}, 60.0));
  ObjectiveOptions options;
  options.model = SurfaceModel::kSpline;
  options.samples = 2;
  options.weights.smooth = 0.0;
  const Image target = testing::random_picture(24, 16, 0.1, 2);
  SplineObjectiveOn<Executor> function(net_mesh(net), setup, target, options, Executor::serial());
  function.relinearize(net.points.data());
  Eigen::Matrix3Xd gradient(3, net.points.cols());
  const ObjectiveEvaluation e = function.evaluate(net.points.data(), gradient.data());
  ASSERT_TRUE(e.feasible);
  const SampledSurface nodes = spline_nodes(net, 2);
  const double mae = mean_absolute_error(
      render_surface(nodes.mesh, nodes.normals, setup, Executor::serial()), target);
  EXPECT_NEAR(e.mae, mae, 1e-4);
  const auto f = [&](const Eigen::VectorXd& x) {
    Eigen::Matrix3Xd ignored(3, net.points.cols());
    return function.evaluate(x.data(), ignored.data()).energy.total;
  };
  Random random(5);
  for (const auto& [first, count] : {std::pair{2, 1}, {0, 2}, {0, 3}}) {
    Eigen::Matrix3Xd direction = Eigen::Matrix3Xd::Zero(3, net.points.cols());
    for (double& d : direction.middleRows(first, count).reshaped()) d = random.between(-1, 1);
    direction.array() *= function.movable().array();
    ASSERT_GT(gradient.cwiseProduct(direction).norm(), 0.0);
    EXPECT_LE(
        testing::slope_error(f, net.points.reshaped(), gradient.reshaped(), direction.reshaped()),
        1e-6)
        << first << ' ' << count;
  }
}

/// Coverage of a shape, in pixels, display-encoded linearly, as a drawing program writes it.
template <class Inside>
Image drawn(int columns, int rows, const Inside& inside) {
  constexpr int kParts = 8;
  Image image(columns, rows);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      int covered = 0;
      for (int k = 0; k < kParts * kParts; ++k) {
        const int row = k / kParts;
        covered += inside(c + (k % kParts + 0.5) / kParts, r + (row + 0.5) / kParts);
      }
      image.at(c, r) = static_cast<float>(decode(static_cast<double>(covered) / (kParts * kParts)));
    }
  }
  return image;
}

TEST(OutlineContour, FollowsACircleWithinATenthOfAPixel) {
  const Image image =
      drawn(90, 80, [](double x, double y) { return std::hypot(x - 45.3, y - 40.1) <= 31.7; });
  const std::vector<Eigen::Vector2d> points = contour_of(image, "disc.png");
  EXPECT_GT(points.size(), 20U);
  EXPECT_LT(points.size(), 200U);
  EXPECT_GT(polygon_area(points), 0.0);
  const Eigen::Vector2d middle(45.3 + 0.5, -40.1 - 0.5);
  for (const Eigen::Vector2d& p : points) EXPECT_NEAR((p - middle).norm(), 31.7, 0.15);
  EXPECT_NEAR(polygon_area(points), std::numbers::pi * 31.7 * 31.7, 20.0);
  EXPECT_FALSE(polygon_fault(points));
}

TEST(OutlineContour, ShapeIsSeenFromTheCuttersSide) {
  // Wide at its foot, which is the picture's lower side, and to the left.
  const Image image = drawn(40, 40, [](double x, double y) {
    return (x > 5 && x < 10 && y > 5 && y < 35) || (x > 5 && x < 35 && y > 28 && y < 35);
  });
  const Outline outline = fitted({OutlineKind::kPolygon, 0.0, contour_of(image, "L.png")}, kSize);
  double mean_x = 0.0;
  double mean_y = 0.0;
  const OutlineIndex index(outline);
  int inside = 0;
  for (int k = 0; k < 10000; ++k) {
    const int row = k / 100;
    const Eigen::Vector2d p(kSize.x() * (k % 100 + 0.5) / 100, kSize.y() * (row + 0.5) / 100);
    if (!index.contains(p)) continue;
    mean_x += p.x();
    mean_y += p.y();
    ++inside;
  }
  EXPECT_LT(mean_x / inside, 0.45 * kSize.x());
  EXPECT_LT(mean_y / inside, 0.45 * kSize.y());
}

TEST(OutlineContour, RefusesHolesPiecesAndNothing) {
  const auto said = [](const Image& image) {
    return message_of<InputError>([&] { contour_of(image, "mask.png"); });
  };
  EXPECT_THAT(said(Image(20, 20, 0.0F)), HasSubstr("nothing in it is white"));
  EXPECT_THAT(said(drawn(40, 40,
                         [](double x, double y) {
                           const double d = std::hypot(x - 20, y - 20);
                           return d < 18 && d > 6;
                         })),
              HasSubstr("2 closed lines"));
  EXPECT_THAT(said(drawn(40, 40,
                         [](double x, double y) {
                           return std::hypot(x - 10, y - 10) < 6 || std::hypot(x - 30, y - 30) < 6;
                         })),
              HasSubstr("2 closed lines"));
}

TEST(OutlineContour, AWhitePictureIsItsRectangle) {
  const std::vector<Eigen::Vector2d> points = contour_of(Image(30, 20, 1.0F), "white.png");
  EXPECT_NEAR(polygon_area(points), 600.0, 2.0);
}

TEST(OutlineContour, FollowsAnSvgFile) {
  const testing::TempFolder folder;
  testing::write_bytes(folder / "disc.svg",
                       "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 100 100\">"
                       "<circle cx=\"50\" cy=\"50\" r=\"40\" fill=\"white\"/></svg>");
  const Outline outline =
      fitted(*outline_from((folder / "disc.svg").string(), {}, {}).outline, kSize);
  for (const Eigen::Vector2d& p : outline.points) {
    // Within the tolerance and as much again by scaling, of 2048 pixels of which 20 mm are 80 %.
    EXPECT_NEAR((p - 0.5 * kSize).norm(), 10.0, 0.006);
  }
  EXPECT_NEAR(polygon_area(outline.points), std::numbers::pi * 100.0, 0.3);
}

TEST(OutlineOption, IsReadAndRefusedInOneLine) {
  const auto said = [](const std::string& text) {
    return message_of<InputError>([&] { outline_from(text, {}, {}); });
  };
  EXPECT_FALSE(outline_from("rectangle", {}, {}).outline);
  EXPECT_EQ(outline_from("circle", {}, {}).outline->kind, OutlineKind::kCircle);
  EXPECT_EQ(outline_from("rounded:1cm", {}, {}).outline->radius, 10.0);
  EXPECT_THAT(said("oval"), HasSubstr("--outline: 'oval'"));
  EXPECT_THAT(message_of<InputError>([] {
                require_outline(Outline{OutlineKind::kRoundedRectangle, 11.0, {}}, kSize);
              }),
              HasSubstr("at most 10 mm"));
  EXPECT_THAT(message_of<InputError>([] {
                require_outline(
                    Outline{OutlineKind::kPolygon, 0.0, {{0, 0}, {4, 4}, {4, 0}, {0, 4}}}, kSize);
              }),
              HasSubstr("crosses"));
  EXPECT_THAT(message_of<InputError>([] {
                require_outline(
                    Outline{OutlineKind::kPolygon, 0.0, {{0, 0}, {100, 0}, {100, 1}, {0, 1}}},
                    kSize);
              }),
              HasSubstr("must be at least 5 %"));
}

TEST(OutlinedDesign, DiscLensProjectsItsPicture) {
  for (const SurfaceModel model :
       {SurfaceModel::kFacet, SurfaceModel::kSmooth, SurfaceModel::kSpline}) {
    const Image picture = testing::spot_picture(28, 28);
    DesignOptions options = default_design_options(model, picture);
    options.outline = Outline{OutlineKind::kCircle, 0.0, {}};
    options.rounds = 3;
    options.iterations = 30;
    const DesignResult result = design_lens(picture, options, Executor::cpu(2), {});
    ASSERT_EQ(result.status, DesignResult::Status::kDone) << result.message;
    ASSERT_TRUE(result.lens.setup.outline);
    const ImageMetrics& metrics = result.lens.metrics.at(model);
    EXPECT_LT(metrics.mae, 0.02) << model_name(model);
    EXPECT_GT(metrics.flux_inside, 0.985) << model_name(model);
    RecordProperty("mae_" + model_name(model), std::to_string(metrics.mae));
  }
}

}  // namespace
}  // namespace lensforge
