// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/image/color.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "core/temp_folder.h"
#include "design/render.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

using ::testing::EndsWith;
using testing::message_of;

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
  for (const char* text : {"", "550", "650,550", "550,550", "300,550", "550,800", "1,2,3,4,5,6",
                           "450:1,550", "450:1,550:0", "450:1,550:-1", "450:1:550"}) {
    EXPECT_THAT(message_of<InputError>([&] { (void)parse_spectrum(text, "--wavelengths"); }),
                EndsWith("450,550,650 would do"));
  }
}

}  // namespace
}  // namespace lensforge
