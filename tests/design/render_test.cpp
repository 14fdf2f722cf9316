// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/render.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/image/color.h"
#include "core/image/image.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "core/schema/description.h"
#include "core/temp_folder.h"
#include "core/test_meshes.h"
#include "design/ray_tracer.h"
#include "design/setup/design_options.h"
#include "design/test_setups.h"

namespace lensforge::render_test {
namespace {

using ::testing::EndsWith;
using testing::grid_mesh;
using ::testing::HasSubstr;
using testing::height_field;
using testing::message_of;
using testing::setup_of;

constexpr SurfaceModel kModels[] = {SurfaceModel::kFacet, SurfaceModel::kSmooth};
const Eigen::Vector2d kSize(20.0, 16.0);

TEST(RenderLens, APlaneGivesAPictureOfExactlyOne) {
  const SurfaceMesh mesh = make_grid_mesh(kSize, {51, 47}, 5.0);
  for (const SurfaceModel model : kModels) {
    for (const Eigen::Vector2i& pixels : {Eigen::Vector2i(40, 32), Eigen::Vector2i(23, 19)}) {
      const RenderResult result =
          render_surface(mesh, setup_of(kSize, pixels, 150.0), model, Executor::cpu(2));
      EXPECT_NEAR(result.flux_inside, 1.0, 1e-12);
      for (const float value : result.image.values()) ASSERT_EQ(value, 1.0F);
    }
  }
}

TEST(RenderLens, APrismMovesTheWholePicture) {
  // Tilted along x only: the image keeps its height and is as wide as the projection of its beam.
  const double tilt = 0.15;
  const SurfaceMesh mesh =
      height_field(kSize, {41, 37}, [&](double x, double) { return 5.0 + std::tan(tilt) * x; });
  OpticalSetup setup = setup_of(kSize, {40, 32}, 150.0);
  const double slope = std::tan(testing::refracted_angle(tilt, setup.ior) - tilt);
  const double left = (150.0 - 5.0) * slope;
  const double width = kSize.x() * (1.0 - std::tan(tilt) * slope);
  setup.image_origin = {left, 0.0};
  setup.image_size = {width, kSize.y()};
  for (const SurfaceModel model : kModels) {
    const RenderResult result = render_surface(mesh, setup, model, Executor::serial());
    EXPECT_NEAR(result.flux_inside, 1.0, 1e-10);
    for (const float value : result.image.values()) ASSERT_NEAR(value, 1.0, 1e-6);
    OpticalSetup beside = setup;
    beside.image_origin.x() += 0.5 * width;
    EXPECT_NEAR(render_surface(mesh, beside, model, Executor::serial()).flux_inside, 0.5, 1e-10);
  }
}

TEST(RenderLens, AThinParaboloidScalesItsImage) {
  const double radius = 2000.0;
  const Eigen::Vector2d centre = 0.5 * kSize;
  for (const double sign : {-1.0, 1.0}) {
    const SurfaceMesh mesh = height_field(kSize, {101, 95}, [&](double x, double y) {
      return 5.0 + sign * (Eigen::Vector2d(x, y) - centre).squaredNorm() / (2.0 * radius);
    });
    OpticalSetup setup = setup_of(kSize, {16, 16}, 505.0);
    const double scale = 1.0 + sign * 500.0 * 0.49 / radius;
    // Half of the image's extent: all inside, so the brightness is that of the middle.
    setup.image_size = 0.5 * scale * kSize;
    setup.image_origin = centre - 0.5 * setup.image_size;
    EXPECT_NEAR(render_surface(mesh, setup, SurfaceModel::kSmooth, Executor::serial()).flux_inside,
                0.25, 2e-5);
    // Facets do not stretch: seen at the scale of a facet their light is uneven.
    EXPECT_NEAR(render_surface(mesh, setup, SurfaceModel::kFacet, Executor::serial()).flux_inside,
                0.25, 2e-3);
  }
}

/// A mesh of one small triangle near the lens's corner of least x and y.
SurfaceMesh triangle_near_origin() {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0.2, 0.6, 0.2, 1.2, 1.2, 1.8, 5.0, 5.0, 5.0;
  mesh.triangles.resize(3, 1);
  mesh.triangles << 0, 1, 2;
  return mesh;
}

TEST(RenderLens, FrontViewShowsTheLensCornerOfSmallXAndYAtTheLowerRight) {
  const OpticalSetup setup = setup_of(kSize, {20, 8}, 150.0);
  const RenderResult result =
      render_surface(triangle_near_origin(), setup, SurfaceModel::kFacet, Executor::serial());
  EXPECT_NEAR(result.flux_inside, 0.12 / 320.0, 1e-12);
  EXPECT_NEAR(result.image.at(19, 7), 160.0 * 0.12 / 320.0, 1e-7);
}

TEST(RenderLens, RearViewShowsTheLensCornerOfSmallXAndYAtTheLowerLeft) {
  OpticalSetup setup = setup_of(kSize, {20, 8}, 150.0);
  setup.view = ViewSide::kRear;
  const RenderResult result =
      render_surface(triangle_near_origin(), setup, SurfaceModel::kFacet, Executor::serial());
  EXPECT_NEAR(result.image.at(0, 7), 160.0 * 0.12 / 320.0, 1e-7);
}

class RenderLensModels : public ::testing::TestWithParam<SurfaceModel> {};

TEST_P(RenderLensModels, AgreesWithAForwardRayTraceWithinItsErrorBars) {
  const SurfaceMesh mesh = height_field(kSize, {23, 21}, testing::bumps);
  const OpticalSetup setup = setup_of(kSize, {16, 16}, 150.0);
  const RenderResult rendered = render_surface(mesh, setup, GetParam(), Executor::cpu(2));
  constexpr std::int64_t kRays = 4'000'000;
  const std::vector<std::int64_t> hits =
      testing::RayTracer(mesh, setup, GetParam()).trace(kRays, 2026);
  double chi_square = 0.0;
  double worst = 0.0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const double share = static_cast<double>(rendered.image.values()[i]) / 256.0;
    const double deviation = std::sqrt(share * (1.0 - share) * kRays);
    ASSERT_GT(share * kRays, 100.0);
    const double z = (static_cast<double>(hits[i]) - share * kRays) / deviation;
    chi_square += z * z;
    worst = std::max(worst, std::fabs(z));
  }
  RecordProperty("chi_square", std::to_string(chi_square));
  RecordProperty("worst_z", std::to_string(worst));
  EXPECT_LT(worst, 5.0);
  // 256 degrees of freedom: mean 256, standard deviation 22.6.
  EXPECT_NEAR(chi_square, 256.0, 5.0 * 22.6);
}

TEST_P(RenderLensModels, TheBumpsOfTheRayTraceMatter) {
  const OpticalSetup setup = setup_of(kSize, {16, 16}, 150.0);
  const SurfaceMesh mesh = height_field(kSize, {23, 21}, testing::bumps);
  const Image image = render_surface(mesh, setup, GetParam(), Executor::serial()).image;
  const auto [low, high] = std::minmax_element(image.values().begin(), image.values().end());
  EXPECT_GT(*high, 2.0F * *low);
}

TEST_P(RenderLensModels, ThreadCountDoesNotChangeABit) {
  const OpticalSetup setup = setup_of(kSize, {40, 32}, 150.0);
  const SurfaceMesh mesh = height_field(kSize, {60, 55}, testing::bumps);
  const RenderResult serial = render_surface(mesh, setup, GetParam(), Executor::serial());
  for (const int threads : {1, 2}) {
    const RenderResult result = render_surface(mesh, setup, GetParam(), Executor::cpu(threads));
    EXPECT_EQ(serial.image, result.image);
    EXPECT_EQ(serial.flux_inside, result.flux_inside);
  }
}

TEST_P(RenderLensModels, EvaluateScalesTheLensToTheTargetsTotal) {
  const OpticalSetup setup = setup_of(kSize, {20, 16}, 150.0);
  const SurfaceMesh mesh = height_field(kSize, {26, 24}, testing::bumps);
  const Image target = testing::random_picture(20, 16, 0.1, 3);
  Image shown;
  const ImageMetrics metrics =
      evaluate(mesh, setup, GetParam(), target, &shown, Executor::serial());
  const RenderResult plain = render_surface(mesh, setup, GetParam(), Executor::serial());
  EXPECT_EQ(metrics.flux_inside, plain.flux_inside);
  EXPECT_NEAR(shown.total(), plain.flux_inside * target.total(), 1e-5 * target.total());
  const ImageMetrics expected = compare(shown, target);
  EXPECT_EQ(metrics.mae, expected.mae);
  EXPECT_EQ(metrics.psnr, expected.psnr);
  EXPECT_EQ(metrics.ssim, expected.ssim);
  EXPECT_EQ(metrics.mae_linear, expected.mae_linear);
  EXPECT_EQ(evaluate(mesh, setup, GetParam(), target, nullptr, Executor::serial()).mae,
            metrics.mae);
}

INSTANTIATE_TEST_SUITE_P(RenderLens, RenderLensModels, ::testing::ValuesIn(kModels),
                         testing::model_name);

TEST(Fringe, OfAPrismIsTheDifferenceOfItsDeflections) {
  const double slope = 0.2;
  OpticalSetup setup = testing::setup_of({20.0, 20.0}, {20, 20}, 300.0);
  setup.spectrum.wavelengths = {486.13, 656.27};
  const SurfaceMesh mesh = testing::height_field({20.0, 20.0}, {3, 3},
                                                 [&](double x, double) { return 5.0 + slope * x; });
  const Fringe fringe = fringe_of(mesh, vertex_area_normals(mesh), setup);
  // Snell's law in angles at both indices.
  const auto deflection = [&](double n) {
    const double lean = std::atan(slope);
    return std::tan(std::asin(n * std::sin(lean)) - lean);
  };
  const double spread =
      deflection(in_color(setup, 486.13).ior) - deflection(in_color(setup, 656.27).ior);
  EXPECT_NEAR(fringe.mean, (300.0 - mesh.vertices.row(2).mean()) * spread, 1e-9);
  EXPECT_NEAR(fringe.max, 295.0 * spread, 1e-9);
}

TEST(Fringe, TheAbbeNumberIsThatOfTheIndices) {
  const OpticalSetup setup;
  const double spread = in_color(setup, 486.13).ior - in_color(setup, 656.27).ior;
  EXPECT_NEAR(0.49 / spread, 57.0, 1e-9);
  EXPECT_NEAR(in_color(setup, 587.56).ior, 1.49, 1e-15);
}

TEST(Fringe, SharesAreThoseOfPowerAndBrightness) {
  OpticalSetup setup;
  setup.spectrum = parse_spectrum("500:2,600:1", "--wavelengths");
  const std::vector<LightColor> colors = light_colors(setup);
  ASSERT_EQ(colors.size(), 2U);
  EXPECT_NEAR(colors[0].share / colors[1].share,
              2.0 * color_matching(500.0).y() / color_matching(600.0).y(), 1e-12);
  EXPECT_NEAR(colors[0].share + colors[1].share, 1.0, 1e-12);
  EXPECT_GT(colors[0].setup.ior, colors[1].setup.ior);
  EXPECT_TRUE(colors[0].setup.spectrum.none());
  EXPECT_EQ(light_colors(OpticalSetup()).front().setup, OpticalSetup());
}

TEST(Fringe, WavelengthsAreReadOrRefusedInOneLine) {
  EXPECT_EQ(parse_spectrum("450, 550,650", "--wavelengths").wavelengths,
            (std::vector<double>{450.0, 550.0, 650.0}));
  const Spectrum led = parse_spectrum("450:0.6,550:1,650:0.8", "--wavelengths");
  EXPECT_EQ(led.wavelengths, (std::vector<double>{450.0, 550.0, 650.0}));
  EXPECT_EQ(led.powers, (std::vector<double>{0.6, 1.0, 0.8}));
  EXPECT_EQ(spectrum_text(led), "450:0.6,550:1,650:0.8");
  EXPECT_EQ(parse_spectrum("550", "--wavelengths").wavelengths, (std::vector<double>{550.0}));
  for (const char* text :
       {"", "red", "350", "650,550", "550,550", "300,550", "550,800", "1,2,3,4,5,6", "450:1,550",
        "450:1,550:0", "450:1,550:-1", "450:1:550"}) {
    EXPECT_THAT(message_of<InputError>([&] { (void)parse_spectrum(text, "--wavelengths"); }),
                EndsWith("450,550,650 works"));
  }
}

/// 15 x 10 mm, moved off the origin.
SurfaceMesh shifted_mesh() {
  SurfaceMesh mesh = grid_mesh(7, 5, 2.5, 5.0);
  mesh.vertices.topRows<2>().colwise() += Eigen::Vector2d(-3.0, 4.0);
  return mesh;
}

TEST(RenderSetup, OfAMeshHasAnImageStraightAboveOfTheSameSize) {
  const OpticalSetup setup = setup_for_mesh(shifted_mesh());
  EXPECT_EQ(setup.lens_size, Eigen::Vector2d(15.0, 10.0));
  EXPECT_EQ(setup.image_size, setup.lens_size);
  EXPECT_EQ(setup.image_origin, Eigen::Vector2d(-3.0, 4.0));
  EXPECT_EQ(setup.pixels, Eigen::Vector2i(256, 171));
  EXPECT_EQ(setup.ior, OpticalSetup{}.ior);
}

TEST(RenderSetup, PixelsKeepTheImagesProportions) {
  OpticalSetup setup;
  setup.image_size = {20.0, 50.0};
  EXPECT_EQ(with_longer_side(setup, 100).pixels, Eigen::Vector2i(40, 100));
  setup.image_size = {1000.0, 1.0};
  EXPECT_EQ(with_longer_side(setup, 10).pixels, Eigen::Vector2i(10, 1));
}

TEST(RenderSetup, AWidthKeepsTheImagesProportionsAndCentre) {
  OpticalSetup setup;
  setup.image_size = {20.0, 50.0};
  setup.image_origin = {-4.0, 10.0};
  const OpticalSetup wide = with_image_width(setup, 80.0);
  EXPECT_EQ(wide.image_size, Eigen::Vector2d(80.0, 200.0));
  EXPECT_EQ(wide.image_origin + 0.5 * wide.image_size, setup.image_origin + 0.5 * setup.image_size);
  EXPECT_EQ(wide.pixels, setup.pixels);
}

TEST(RenderSetup, OptionsInTheTablesOrderSetTheWidthAndThenThePixels) {
  RenderOptions options{SurfaceModel::kFacet, setup_for_mesh(shifted_mesh())};
  const Description fields = description_of(options);
  for (const Field& field : fields) {
    if (field.name == "--image-width") field.set(30.0);
    if (field.name == "--pixels") field.set(60);
  }
  EXPECT_EQ(options.setup.image_size, Eigen::Vector2d(30.0, 20.0));
  EXPECT_EQ(options.setup.image_origin, Eigen::Vector2d(-10.5, -1.0));
  EXPECT_EQ(options.setup.pixels, Eigen::Vector2i(60, 40));
  EXPECT_EQ(fields.at("--image-width").get(), FieldValue(30.0));
  EXPECT_EQ(fields.at("--pixels").get(), FieldValue(60));
}

TEST(RenderSetup, TheWallLiesAboveTheSurface) {
  OpticalSetup setup = setup_for_mesh(shifted_mesh());
  setup.focal_length = shifted_mesh().vertices.row(2).maxCoeff();
  EXPECT_THAT(message_of<InputError>([&] { require_wall_above(shifted_mesh(), setup); }),
              HasSubstr("must stand above the whole surface"));
  setup.focal_length += 0.1;
  require_wall_above(shifted_mesh(), setup);
}

}  // namespace

}  // namespace lensforge::render_test
