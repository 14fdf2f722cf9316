// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/fringe.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/surface/mesh_normals.h"
#include "core/temp_folder.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

using ::testing::EndsWith;
using testing::message_of;

TEST(Fringe, OfAPrismIsTheDifferenceOfItsDeflections) {
  const double slope = 0.2;
  const OpticalSetup setup = testing::setup_of({20.0, 20.0}, {20, 20}, 300.0);
  const SurfaceMesh mesh = testing::height_field({20.0, 20.0}, {3, 3},
                                                 [&](double x, double) { return 5.0 + slope * x; });
  const Fringe fringe = fringe_of(mesh, vertex_area_normals(mesh), setup, 57.0, {486.13, 656.27});
  // Snell's law in angles at both indices.
  const auto deflection = [&](double n) {
    const double lean = std::atan(slope);
    return std::tan(std::asin(n * std::sin(lean)) - lean);
  };
  const double spread =
      deflection(in_color(setup, 57.0, 486.13).ior) - deflection(in_color(setup, 57.0, 656.27).ior);
  EXPECT_NEAR(fringe.mean, (300.0 - mesh.vertices.row(2).mean()) * spread, 1e-9);
  EXPECT_NEAR(fringe.max, 295.0 * spread, 1e-9);
}

TEST(Fringe, TheAbbeNumberIsThatOfTheIndices) {
  const OpticalSetup setup;
  const double spread = in_color(setup, 57.0, 486.13).ior - in_color(setup, 57.0, 656.27).ior;
  EXPECT_NEAR(0.49 / spread, 57.0, 1e-9);
  EXPECT_NEAR(in_color(setup, 57.0, 587.56).ior, 1.49, 1e-15);
}

TEST(Fringe, WavelengthsAreReadOrRefusedInOneLine) {
  EXPECT_EQ(parse_wavelengths("450, 550,650", "--wavelengths"),
            (std::vector<double>{450.0, 550.0, 650.0}));
  for (const char* text : {"", "550", "650,550", "550,550", "300,550", "550,800", "1,2,3,4,5,6"}) {
    EXPECT_THAT(message_of<InputError>([&] { parse_wavelengths(text, "--wavelengths"); }),
                EndsWith("450,550,650 would do"));
  }
}

}  // namespace
}  // namespace lensforge
