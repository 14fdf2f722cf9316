// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "core/image/image.h"
#include "core/optics/light_source.h"
#include "design/design.h"
#include "design/finite_difference.h"
#include "design/objective_setups.h"
#include "design/render.h"
#include "design/render/source_picture.h"
#include "design/snell.h"

namespace lensforge {
namespace {

using testing::Random;

/// The test lens under a source whose image is some three pixels wide.
OpticalSetup wide_setup() {
  OpticalSetup setup = testing::kSetup;
  setup.extent.width = 0.05;
  return setup;
}

class ExtendedSource : public ::testing::TestWithParam<SurfaceModel> {};
INSTANTIATE_TEST_SUITE_P(Models, ExtendedSource, ::testing::ValuesIn(testing::kModels),
                         testing::model_name);

TEST_P(ExtendedSource, ObjectiveGradientEqualsCentralDifferences) {
  const SurfaceMesh mesh = testing::rough_mesh();
  DesignObjective objective(mesh, wide_setup(), testing::target(),
                            testing::options_of(GetParam(), {}), Executor::serial());
  EXPECT_LT(testing::gradient_error(objective, mesh.vertices), 1e-6);
}

TEST_P(ExtendedSource, ObjectiveHasTheSameBitsForAnyNumberOfThreads) {
  const SurfaceMesh mesh = testing::rough_mesh();
  const ObjectiveOptions options = testing::options_of(GetParam(), {});
  DesignObjective one(mesh, wide_setup(), testing::target(), options, Executor::serial());
  DesignObjective three(mesh, wide_setup(), testing::target(), options, Executor::cpu(3));
  Eigen::Matrix3Xd a;
  Eigen::Matrix3Xd b;
  EXPECT_EQ(one.evaluate(mesh.vertices, a).energy.total,
            three.evaluate(mesh.vertices, b).energy.total);
  EXPECT_EQ(a, b);
}

/// Flux per pixel by random rays from all over the disc, apart from all optics of the program: they
/// enter the flat face and meet one facet, and are bent by angles at both.
struct TracedPicture {
  std::vector<double> flux;
  double rays;
};

/// The facet above a place that a ray through it from below meets.
Eigen::Vector3d meet(const SurfaceMesh& mesh, const Eigen::Vector3d& from, const Eigen::Vector3d& a,
                     Eigen::Vector3d& normal) {
  for (std::int64_t f = 0; f < mesh.triangle_count(); ++f) {
    Eigen::Matrix3d sides;
    sides << mesh.corner(f, 1) - mesh.corner(f, 0), mesh.corner(f, 2) - mesh.corner(f, 0), -a;
    const Eigen::Vector3d s = sides.inverse() * (from - mesh.corner(f, 0));
    if (s.x() < 0.0 || s.y() < 0.0 || s.x() + s.y() > 1.0) continue;
    normal = sides.col(0).cross(sides.col(1)).normalized();
    return from + s.z() * a;
  }
  normal.setZero();
  return from;
}

TracedPicture traced(const SurfaceMesh& mesh, const OpticalSetup& setup, int count) {
  TracedPicture picture{std::vector<double>(static_cast<std::size_t>(setup.pixels.prod()), 0.0), 0};
  Random random(11);
  for (int ray = 0; ray < count; ++ray) {
    const double angle = 0.5 * setup.extent.width * std::sqrt(random.between(0.0, 1.0));
    const double turn = random.between(0.0, 2.0 * std::numbers::pi);
    const Eigen::Vector3d way =
        Eigen::Vector3d(angle * std::cos(turn), angle * std::sin(turn), 1.0).normalized();
    // Wider than the lens by what a slanting ray moves inside it.
    const Eigen::Vector3d place(random.between(-0.5, setup.lens_size.x() + 0.5),
                                random.between(-0.5, setup.lens_size.y() + 0.5), 0.0);
    const Eigen::Vector3d a =
        testing::refract_by_angles(way, Eigen::Vector3d::UnitZ(), 1.0 / setup.ior);
    Eigen::Vector3d n;
    const Eigen::Vector3d p = meet(mesh, place, a, n);
    if (n.isZero()) continue;
    picture.rays += 1.0;
    const Eigen::Vector3d b = testing::refract_by_angles(a, n, setup.ior);
    const Eigen::Vector3d hit = p + (setup.focal_length - p.z()) / b.z() * b;
    const double u = (setup.lens_size.x() - hit.x()) / setup.lens_size.x() * setup.pixels.x();
    const double v = (setup.lens_size.y() - hit.y()) / setup.lens_size.y() * setup.pixels.y();
    if (u < 0.0 || v < 0.0 || u >= setup.pixels.x() || v >= setup.pixels.y()) continue;
    const int pixel = static_cast<int>(v) * setup.pixels.x() + static_cast<int>(u);
    picture.flux[static_cast<std::size_t>(pixel)] += 1.0;
  }
  return picture;
}

TEST(ExtendedPicture, IsThatOfSingleRaysFromAllOverTheSource) {
  OpticalSetup setup = testing::setup_of({24.0, 20.0}, {12, 10}, 60.0);
  setup.extent.width = 0.1;
  const SurfaceMesh mesh = testing::height_field({24.0, 20.0}, {13, 13}, [](double x, double y) {
    return 5.0 + 0.15 * std::sin(0.4 * x) * std::cos(0.3 * y);
  });
  const TracedPicture rays = traced(mesh, setup, 80000);
  const RenderResult rendered =
      render_surface(mesh, setup, SurfaceModel::kFacet, Executor::serial());
  double chi_square = 0.0;
  const auto pixels = static_cast<double>(rays.flux.size());
  for (std::size_t i = 0; i < rays.flux.size(); ++i) {
    const double expected = static_cast<double>(rendered.image.values()[i]) / pixels * rays.rays;
    chi_square += (rays.flux[i] - expected) * (rays.flux[i] - expected) / expected;
  }
  // 120 pixels: mean 120, standard deviation 15.5.
  EXPECT_LT(chi_square, 120.0 + 4.0 * 15.5);
  EXPECT_GT(chi_square, 120.0 - 5.0 * 15.5);
}

TEST(ExtendedPicture, AnAimGoesPastTheTargetByWhatIsSeenWrong) {
  Image target(2, 1);
  target.at(0, 0) = 1.0F;
  target.at(1, 0) = 3.0F;
  // A tenth of the light is seen in the wrong pixel.
  const Image aim = corrected(target, {0.35, 0.65}, {0.25, 0.75});
  EXPECT_NEAR(aim.at(0, 0), 0.6, 1e-6);
  EXPECT_NEAR(aim.at(1, 0), 3.4, 1e-6);
  EXPECT_EQ(corrected(target, {0.75, 0.25}, {0.25, 0.75}).at(0, 0), 0.0F);
}

TEST(ExtendedPicture, TheConvolutionIsCloseToTheSumOverTheSource) {
  OpticalSetup setup = testing::setup_of({24.0, 20.0}, {24, 20}, 60.0);
  setup.extent.width = 0.05;
  const SurfaceMesh mesh = testing::height_field({24.0, 20.0}, {49, 41}, testing::bumps);
  const auto flux = [&](const OpticalSetup& one) {
    const RenderResult result =
        render_surface(mesh, one, SurfaceModel::kSmooth, Executor::serial());
    return std::vector<double>(result.image.values().begin(), result.image.values().end());
  };
  const std::vector<double> exact = picture_under(setup, 256, flux);
  std::vector<double> convolved = picture_by_convolution(setup, 5.0, flux, Executor::serial());
  const int parts = source_kernel(setup, 5.0).parts;
  double off = 0.0;
  // The finer picture is relative to more pixels; the rim lacks light from outside.
  for (int row = 3; row < 17; ++row) {
    for (int column = 3; column < 21; ++column) {
      const int pixel = row * 24 + column;
      const auto i = static_cast<std::size_t>(pixel);
      off = std::max(off, std::fabs(convolved[i] / (parts * parts) - exact[i]));
    }
  }
  EXPECT_LT(off, 0.02);
}

/// The bumps' picture through a mesh.
PointPicture bumps_through(const GridShape& shape) {
  const SurfaceMesh mesh = testing::height_field({24.0, 20.0}, shape, testing::bumps);
  return [mesh](const OpticalSetup& one) {
    return flux_of_surface(mesh, one, SurfaceModel::kSmooth, Executor::serial());
  };
}

/// Sum of differences of two pictures.
double apart(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::fabs(a[i] - b[i]);
  return sum;
}

TEST(ExtendedPicture, FewRaysOfEveryPointShowWhatManyShow) {
  OpticalSetup setup = testing::setup_of({24.0, 20.0}, {24, 20}, 60.0);
  setup.extent.width = 0.05;
  const PointPicture few = bumps_through({49, 41});
  const PointPicture many = bumps_through({193, 161});
  const std::vector<double> exact = picture_under(setup, 64, many);
  const std::vector<double> mixed =
      picture_under_few_rays(setup, 5.0, 64, {few, many}, Executor::serial());
  EXPECT_LT(apart(mixed, exact), 0.25 * apart(picture_under(setup, 64, few), exact));
}

TEST(SourceLimit, IsTheTargetWhereTheSourceCouldMakeIt) {
  OpticalSetup setup = testing::setup_of({32.0, 32.0}, {32, 32}, 100.0);
  setup.extent.width = 0.02;
  // A picture that is blurred already, dark at its rim.
  Image target(32, 32);
  for (int row = 0; row < 32; ++row) {
    for (int column = 0; column < 32; ++column) {
      const double r2 = std::pow(column - 15.5, 2) + std::pow(row - 15.5, 2);
      target.at(column, row) = static_cast<float>(std::exp(-r2 / 40.0));
    }
  }
  const SourceLimit limit = source_limit(target, setup, 5.0, Executor::serial());
  EXPECT_LT(limit.metrics.mae, 0.002);
  EXPECT_NEAR(limit.light.total(), target.total(), 1e-3 * target.total());
}

TEST(SourceLimit, IsHalfGreyWhereTheSourceHidesAChequer) {
  OpticalSetup setup = testing::setup_of({32.0, 32.0}, {32, 32}, 100.0);
  setup.extent.width = 0.12;
  Image target(32, 32);
  for (int row = 0; row < 32; ++row) {
    for (int column = 0; column < 32; ++column) {
      target.at(column, row) = (row + column) % 2 == 0 ? 1.0F : 0.0F;
    }
  }
  const SourceLimit limit = source_limit(target, setup, 5.0, Executor::serial());
  EXPECT_GT(limit.metrics.mae, 0.4);
}

TEST(ExtendedDesign, IsBetterThanOneForAPointAndNoBetterThanItsLimit) {
  const Image target = testing::spot_picture(32, 32);
  DesignOptions options = default_design_options(SurfaceModel::kSmooth, target);
  options.width = 32.0;
  options.focal_length = 100.0;
  options.rounds = 1;
  options.iterations = 60;
  const DesignResult sharp = design_lens(target, options, Executor::cpu(2), RunControl());
  options.light.source_angle = 40.0;
  const DesignResult wide = design_lens(target, options, Executor::cpu(2), RunControl());
  ASSERT_TRUE(wide.source.has_value());
  ASSERT_TRUE(wide.lens.source_limit.has_value());
  EXPECT_NEAR(wide.source->blur, 3.8, 0.1);
  Lens other = sharp.lens;
  other.setup = wide.lens.setup;
  const double unaware = evaluate(other, SurfaceModel::kSmooth, nullptr, Executor::cpu(2)).mae;
  const double aware = wide.lens.metrics.at(SurfaceModel::kSmooth).mae;
  EXPECT_LT(aware, 0.8 * unaware);
  EXPECT_LE(wide.lens.source_limit->mae, aware);
}

TEST(ExtendedDesign, LaterRoundsMendWhatTheConvolutionMisses) {
  const Image target = testing::spot_picture(32, 32);
  DesignOptions options = default_design_options(SurfaceModel::kSmooth, target);
  options.width = 32.0;
  options.focal_length = 60.0;
  options.iterations = 40;
  options.light.source_angle = 60.0;
  const Executor executor = Executor::cpu(2);
  const DesignResult result = design_lens(target, options, executor, RunControl());
  ASSERT_TRUE(result.source.has_value());
  EXPECT_GT(result.source->convolution, 0.001);
  const Lens& lens = result.lens;
  std::vector<double> convolved = picture_by_convolution(
      lens.setup, lens.surface.vertices.row(2).mean(),
      [&](const OpticalSetup& light) { return flux_of_lens(lens, light, executor); }, executor);
  Image picture(32, 32);
  for (std::size_t i = 0; i < convolved.size(); ++i) {
    picture.values()[i] = static_cast<float>(convolved[i] * target.total());
  }
  // The picture by convolution, which the optimiser sees, misses the target on purpose.
  EXPECT_LT(lens.metrics.at(SurfaceModel::kSmooth).mae, compare(picture, target).mae);
}

}  // namespace
}  // namespace lensforge
