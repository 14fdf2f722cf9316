// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/leakage/render_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <stop_token>
#include <vector>

#include "cam/analytic_fields.h"
#include "core/error.h"
#include "core/optics/light_source.h"
#include "core/optics/optical_setup.h"
#include "core/optics/screen.h"

namespace lensforge::render_field_test {
namespace {

using testing::AnalyticField;
using testing::SurfacePoint;

OpticalSetup small_setup(int pixels = 20) {
  OpticalSetup setup;
  setup.focal_length = 60.0;
  setup.lens_size = {4.0, 4.0};
  setup.image_size = {20.0, 20.0};
  setup.image_origin = {-8.0, -8.0};
  setup.pixels = {pixels, pixels};
  setup.view = ViewSide::kRear;
  return setup;
}

FieldRenderSetup setup_of(double spacing, std::int64_t tile = 768) {
  const OpticalSetup optics = small_setup();
  return {optics, lens_grid(optics.lens_size, spacing), tile};
}

FluxPicture render(const SurfaceField& field, const FieldRenderSetup& setup) {
  return render_field(field, setup, Executor::serial(), RunControl());
}

std::vector<double> column_sums(const FluxPicture& picture) {
  std::vector<double> sums(static_cast<std::size_t>(picture.columns), 0.0);
  for (std::size_t i = 0; i < picture.flux.size(); ++i) sums[i % sums.size()] += picture.flux[i];
  return sums;
}

/// Flux per column of a surface that changes along x only, by many single rays through Snell's law
/// written out for a profile: sin of the angle to the normal grows by η.
std::vector<double> traced_columns(const AnalyticField& field, const OpticalSetup& setup,
                                   int rays) {
  std::vector<double> sums(static_cast<std::size_t>(setup.pixels.x()), 0.0);
  for (int ray = 0; ray < rays; ++ray) {
    const double x = setup.lens_size.x() * (ray + 0.5) / rays;
    const SurfacePoint point = field.at({x, 1.0});
    const double lean = std::atan(point.slope.x());
    const double angle = std::asin(setup.ior * std::sin(lean)) - lean;
    const double lands = x + (setup.focal_length - point.z) * std::tan(angle);
    const double column =
        (lands - setup.image_origin.x()) / setup.image_size.x() * setup.pixels.x();
    if (column < 0.0 || column >= setup.pixels.x()) continue;
    sums[static_cast<std::size_t>(column)] += 1.0 / rays;
  }
  return sums;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

TEST(RenderField, APlaneGivesAnEvenPicture) {
  OpticalSetup optics = small_setup(16);
  optics.image_size = optics.lens_size;
  optics.image_origin = {0.0, 0.0};
  const AnalyticField field(testing::plane({0.0, 0.0}));
  const FluxPicture picture = render(field, {optics, lens_grid(optics.lens_size, 0.03), 768});
  for (const double flux : picture.flux) EXPECT_NEAR(flux, 1.0 / 256.0, 1e-10);
}

TEST(RenderField, APrismShiftsTheLight) {
  const Eigen::Vector2d slope(0.11, -0.07);
  const FluxPicture picture = render(AnalyticField(testing::plane(slope)), setup_of(0.05));
  EXPECT_NEAR(picture.inside(), 1.0, 1e-12);
  // Snell's law in vector form: η ẑ minus the refracted direction is parallel to the normal.
  const double steep = slope.norm();
  const double angle = std::asin(1.49 * std::sin(std::atan(steep))) - std::atan(steep);
  const Eigen::Vector2d m = std::tan(angle) / steep * slope;
  const auto land = [&](double x, double y) {
    const Eigen::Vector2d p(x, y);
    return Eigen::Vector2d(p + (60.0 - 5.0 - slope.dot(p)) * m);
  };
  const Eigen::Vector2d centre = land(2.0, 2.0);
  Eigen::Vector2d mean(0.0, 0.0);
  const ImagePlane plane(small_setup());
  for (int r = 0; r < 20; ++r) {
    for (int c = 0; c < 20; ++c) {
      mean += picture.flux[20 * static_cast<std::size_t>(r) + static_cast<std::size_t>(c)] *
              plane.to_mm(Eigen::Vector2d(c + 0.5, r + 0.5));
    }
  }
  EXPECT_LT((mean - centre).norm(), 0.15);  // The picture knows places to a part of a pixel.
  const std::vector<double> traced =
      traced_columns(AnalyticField(testing::plane({0.11, 0.0})), small_setup(), 400000);
  EXPECT_LT(
      largest_difference(
          column_sums(render(AnalyticField(testing::plane({0.11, 0.0})), setup_of(0.05))), traced),
      1e-5);
}

TEST(RenderField, SurfacesRenderedTogetherHaveThePicturesTheyHaveAlone) {
  const AnalyticField flat(testing::plane({0.11, -0.07}));
  const AnalyticField bent([](const Eigen::Vector2d& p) {
    return SurfacePoint{6.0 - p.squaredNorm() / 30.0, -p / 15.0, p.x() < 2.013 ? 1 : 2};
  });
  const FieldRenderSetup setup = setup_of(0.05, 19);
  const std::vector<const SurfaceField*> fields{&flat, &bent};
  const std::vector<FluxPicture> pictures =
      render_fields(fields, setup, Executor::cpu(2), RunControl());
  ASSERT_EQ(pictures.size(), 2U);
  EXPECT_EQ(pictures[0].flux, render(flat, setup).flux);
  EXPECT_EQ(pictures[1].flux, render(bent, setup).flux);
  EXPECT_NE(pictures[0].flux, pictures[1].flux);
}

TEST(RenderField, ACylinderSpreadsTheLightAsRaysDo) {
  const AnalyticField field([](const Eigen::Vector2d& p) {
    const double x = p.x() - 1.7;
    return SurfacePoint{6.0 - x * x / 18.0, {-x / 9.0, 0.0}, 0};
  });
  const std::vector<double> traced = traced_columns(field, small_setup(), 400000);
  EXPECT_LT(largest_difference(column_sums(render(field, setup_of(0.05))), traced), 1e-4);
  EXPECT_LT(largest_difference(column_sums(render(field, setup_of(0.0125))), traced), 2e-5);
}

TEST(RenderField, AnExtendedSourceBlursThePictureAsItsPointsTogetherDo) {
  const AnalyticField field([](const Eigen::Vector2d& p) {
    const double x = p.x() - 1.7;
    return SurfacePoint{6.0 - x * x / 18.0, {-x / 9.0, 0.0}, 0};
  });
  FieldRenderSetup setup = setup_of(0.05);
  setup.optics.extent.width = 0.06;
  setup.surface_height = 6.0;
  std::vector<double> together(20, 0.0);
  for (const SourcePoint& point : source_points(setup.optics.extent, 300)) {
    FieldRenderSetup one = setup;
    one.optics = lit_from(setup.optics, point.at);
    one.whole = {one.optics.lens_size.prod()};
    const std::vector<double> sums = column_sums(render(field, one));
    for (std::size_t c = 0; c < sums.size(); ++c) together[c] += point.share * sums[c];
  }
  const std::vector<double> sharp = column_sums(render(field, setup_of(0.05)));
  const std::vector<double> blurred = column_sums(render(field, setup));
  EXPECT_GT(largest_difference(sharp, together), 0.01);
  EXPECT_LT(largest_difference(blurred, together), 0.002);
}

/// Of parallel light, and of a lamp, whose light every colour takes in differently.
TEST(RenderField, ASpectrumSendsTheSumOfItsColors) {
  const AnalyticField bent([](const Eigen::Vector2d& p) {
    return SurfacePoint{6.0 - p.squaredNorm() / 30.0, -p / 15.0, p.x() < 2.013 ? 1 : 2};
  });
  FieldRenderSetup setup = setup_of(0.05, 19);
  setup.optics.spectrum = {{460.0, 550.0, 640.0}, {1.0, 2.0, 1.0}, 15.0};
  for (const bool lamp : {false, true}) {
    if (lamp) {
      setup.optics.lamp = PointSource{{2.0, 2.0, -60.0}, {}};
      setup.whole = {13.0, 14.0, 15.0};
    }
    std::vector<double> sum(400, 0.0);
    const std::vector<LightColor> colors = light_colors(setup.optics);
    for (std::size_t k = 0; k < colors.size(); ++k) {
      FieldRenderSetup one = setup;
      one.optics = colors[k].setup;
      if (lamp) one.whole = {setup.whole[k]};
      const FluxPicture picture = render(bent, one);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += colors[k].share * picture.flux[i];
    }
    EXPECT_LT(largest_difference(render(bent, setup).flux, sum), 1e-12);
  }
}

/// A wave of six nodes: its beams, taken as linear between nodes, would bend 9 % too little.
TEST(RenderField, AShortWaveThrowsTheLightThatRaysDo) {
  constexpr double kTurn = 2.0 * std::numbers::pi / 0.08;
  const AnalyticField field(
      [](const Eigen::Vector2d& p) {
        constexpr double kSlope = 0.05;
        return testing::SurfacePoint{5.0 - kSlope / kTurn * std::cos(kTurn * p.x()),
                                     {kSlope * std::sin(kTurn * p.x()), 0.0}};
      },
      false);
  const std::vector<double> traced = traced_columns(field, small_setup(), 2000000);
  EXPECT_LT(largest_difference(column_sums(render(field, setup_of(0.08 / 6.0))), traced), 1e-3);
}

TEST(RenderField, ScallopsThrowTheLightOfTheirArcs) {
  // Nodes fall differently into every scallop: 0.0606 mm rows on a 0.01 mm grid.
  const AnalyticField field(testing::scalloped_plane(0.2, 0.0606));
  const std::vector<double> traced = traced_columns(field, small_setup(40), 2000000);
  FieldRenderSetup setup = setup_of(0.01);
  setup.optics = small_setup(40);
  EXPECT_LT(largest_difference(column_sums(render(field, setup)), traced), 4e-4);
  setup.grid = lens_grid(setup.optics.lens_size, 0.005);
  EXPECT_LT(largest_difference(column_sums(render(field, setup)), traced), 1e-4);
}

TEST(RenderField, NoLightFallsBetweenTheSidesOfARidge) {
  const AnalyticField field(testing::roof(2.0137, 0.2));
  const FluxPicture picture = render(field, setup_of(0.05));
  const std::vector<double> sums = column_sums(picture);
  const std::vector<double> traced = traced_columns(field, small_setup(), 400000);
  EXPECT_LT(largest_difference(sums, traced), 1e-5);
  for (std::size_t c = 0; c < sums.size(); ++c) {
    if (traced[c] > 0.0) continue;
    EXPECT_EQ(sums[c], 0.0) << "column " << c;
  }
  EXPECT_EQ(std::count(traced.begin() + 7, traced.begin() + 13, 0.0), 6);  // The gap.
  // The same nodes without their cuts bridge the gap: this is what splitting prevents.
  const AnalyticField bridged(testing::roof(2.0137, 0.2), false);
  const std::vector<double> invented = column_sums(render(bridged, setup_of(0.05)));
  EXPECT_GT(*std::min_element(invented.begin() + 7, invented.begin() + 13), 5e-4);
}

TEST(RenderField, AFilletsLightIsThatOfItsArc) {
  const AnalyticField field(testing::rounded_groove(2.0137, 0.2, 0.2));
  const std::vector<double> traced = traced_columns(field, small_setup(), 2000000);
  EXPECT_LT(largest_difference(column_sums(render(field, setup_of(0.01))), traced), 5e-5);
}

TEST(RenderField, ThreeFacesThatMeetThrowThreeSpots) {
  const std::array<Eigen::Vector2d, 3> slopes{
      Eigen::Vector2d{0.15, 0.0}, {-0.08, 0.13}, {-0.08, -0.13}};
  const Eigen::Vector2d apex(2.011, 1.987);
  const auto face = [&](const Eigen::Vector2d& p) {
    int least = 0;
    for (int k = 1; k < 3; ++k) {
      const auto height = [&](int i) { return slopes[static_cast<std::size_t>(i)].dot(p - apex); };
      if (height(k) < height(least)) least = k;
    }
    return least;
  };
  const AnalyticField field([&](const Eigen::Vector2d& p) {
    const int k = face(p);
    const Eigen::Vector2d& slope = slopes[static_cast<std::size_t>(k)];
    return SurfacePoint{5.0 + slope.dot(p - apex), slope, k};
  });
  const FluxPicture picture = render(field, setup_of(0.05));
  EXPECT_NEAR(picture.inside(), 1.0, 1e-12);
  // Rays 2 µm apart: a pixel's flux is known to one row of them, 1 / (4 · 2000) of the lens.
  const LightPath light(small_setup());
  std::vector<double> traced(picture.flux.size(), 0.0);
  for (int i = 0; i < 2000; ++i) {
    for (int j = 0; j < 2000; ++j) {
      const Eigen::Vector2d p(0.002 * (i + 0.5), 0.002 * (j + 0.5));
      const SurfacePoint point = field.at(p);
      const Eigen::Vector2d at = land_of(light, p, point.z, point.slope);
      traced[20 * static_cast<std::size_t>(at.y()) + static_cast<std::size_t>(at.x())] += 0.25e-6;
    }
  }
  EXPECT_LT(largest_difference(picture.flux, traced), 1.3e-4);
}

TEST(RenderField, SameBitsForAnyTileAndThreads) {
  const AnalyticField field(testing::scalloped_plane(0.2, 0.0606));
  const FluxPicture whole = render(field, setup_of(0.017, 1000));
  for (const std::int64_t tile : {7, 64, 100}) {
    const FluxPicture tiled =
        render_field(field, setup_of(0.017, tile), Executor::cpu(3), RunControl());
    EXPECT_EQ(whole.flux, tiled.flux) << tile;
  }
}

TEST(RenderField, LightThatIsReflectedTotallyIsLost) {
  // Total reflection begins at sin = 1/1.49, a slope of 0.905.
  const FluxPicture dark = render(AnalyticField(testing::plane({0.91, 0.0})), setup_of(0.05));
  EXPECT_EQ(dark.inside(), 0.0);
}

TEST(RenderField, AnInterruptEndsIt) {
  std::stop_source stop;
  stop.request_stop();
  const AnalyticField field(testing::plane({0.0, 0.0}));
  EXPECT_THROW((void)render_field(field, setup_of(0.05), Executor::serial(),
                                  RunControl(stop.get_token(), {})),
               Interrupted);
}

TEST(LensGrid, EndsAtTheRim) {
  for (double side = 10.0; side < 11.0; side += 0.0173) {
    const GridWindow grid = lens_grid({side, 37.3}, 0.0093);
    EXPECT_LE(grid.spacing.maxCoeff(), 0.0093 * (1.0 + 1e-11));
    EXPECT_GT(grid.spacing.minCoeff(), 0.00928);
    const Eigen::Vector2d rim = grid.node(grid.columns - 1, grid.rows - 1);
    EXPECT_LE(rim.x(), side);
    EXPECT_NEAR(rim.x(), side, 1e-12);
    EXPECT_LE(rim.y(), 37.3);
  }
}

TEST(LensGrid, TilesCoverEveryCellOnce) {
  const GridWindow grid = lens_grid({4.0, 3.0}, 0.1);
  std::vector<int> seen(static_cast<std::size_t>((grid.columns - 1) * (grid.rows - 1)), 0);
  for (const CellRange& tile : tiles_of(all_cells(grid), 7)) {
    for (std::int64_t r = tile.row; r < tile.row + tile.rows; ++r) {
      for (std::int64_t c = tile.column; c < tile.column + tile.columns; ++c) {
        ++seen[static_cast<std::size_t>(r * (grid.columns - 1) + c)];
      }
    }
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), std::ssize(seen));
}

TEST(LensGrid, RefusesASizeOrSpacingThatMakesNoGrid) {
  EXPECT_THROW((void)lens_grid({0.0, 10.0}, 0.01), InputError);
  EXPECT_THROW((void)lens_grid({10.0, 2000.0}, 0.01), InputError);
  EXPECT_THROW((void)lens_grid({10.0, 10.0}, 0.0), InputError);
}

/// Light from a side on a plane: one beam, and a share of flux that depends on the slope.
TEST(RenderField, LightFromTheSideFollowsSnellsLawTwice) {
  FieldRenderSetup setup = setup_of(0.05);
  setup.optics.lamp = ParallelLight{Eigen::Vector3d(0.08, 0.0, 1.0).normalized()};
  const double inside = std::asin(0.08 / std::hypot(0.08, 1.0) / 1.49);
  const Eigen::Vector2d slope(0.09, 0.0);
  const double lean = std::atan(slope.x());
  const double angle = std::asin(1.49 * std::sin(lean + inside)) - lean;
  std::vector<double> traced(20, 0.0);
  const int rays = 400000;
  for (int ray = 0; ray < rays; ++ray) {
    const double x = 4.0 * (ray + 0.5) / rays;
    const double z = 5.0 + slope.x() * x;
    const double column = (x + (60.0 - z) * std::tan(angle) + 8.0) / 20.0 * 20.0;
    traced[static_cast<std::size_t>(column)] += (1.0 - slope.x() * std::tan(inside)) / rays;
  }
  const FluxPicture picture = render(AnalyticField(testing::plane(slope)), setup);
  EXPECT_LT(largest_difference(column_sums(picture), traced), 1e-5);
}

TEST(CreaseSplit, PiecesTakeExactlyTheTrianglesFlux) {
  const LightPath light(small_setup());
  std::array<SurfaceSide, 3> sides;
  const std::array<Eigen::Vector2d, 3> corners{
      Eigen::Vector2d{1.0, 1.0}, {1.01, 1.0}, {1.01, 1.01}};
  for (int shape = 0; shape < 200; ++shape) {
    for (std::size_t k = 0; k < 3; ++k) {
      sides[k].place = corners[k];
      sides[k].z = 5.0 + 0.001 * std::sin(1.0 + 3.7 * shape + 2.3 * static_cast<double>(k));
      sides[k].slope = {0.3 * std::cos(shape),
                        0.3 * std::sin(5.0 * shape + static_cast<double>(k))};
      sides[k].cut = static_cast<std::int32_t>(k == 2 && shape % 2 == 0 ? 1 : k);
    }
    double flux = 0.0;
    double least = 1.0;
    split_at_crease(sides, light, 16.0, [&](const ImageTriangle& t) {
      flux += t.flux;
      least = std::min(least, t.flux);
    });
    EXPECT_NEAR(flux, 0.5 * 0.01 * 0.01 / 16.0, 1e-18);
    EXPECT_GE(least, -1e-20);
  }
}

}  // namespace
}  // namespace lensforge::render_field_test
