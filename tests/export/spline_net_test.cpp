// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/spline/spline_net.h"

#include <gtest/gtest.h>

#include <random>

#include "core/lens/slope_fit.h"
#include "core/spline/control_net.h"
#include "design/design.h"
#include "design/render.h"
#include "design/render/source_picture.h"
#include "export/files/closed_solid.h"
#include "export/sample_surfaces.h"
#include "export/spline/spline_fit.h"
#include "fixtures/scenes/scenes.h"

namespace lensforge::testing {
namespace {

SplineNet fitted(const SmoothSurface& surface, std::int64_t points = 0) {
  FitOptions options;
  options.max_control_points = points;
  return fit_spline_net(surface, options, Executor::serial(), RunControl());
}

TEST(CubicSpline, BasisSumsToOneAndSlopesAreItsDerivatives) {
  for (const int cells : {1, 2, 3, 9}) {
    for (double t = 0.01; t < cells - 0.01; t += 0.0837) {
      const CubicBasis b = cubic_basis(t, cells);
      double sum = 0.0;
      double place = 0.0;
      double slope = 0.0;
      for (int j = 0; j < 4; ++j) {
        sum += b.value[static_cast<std::size_t>(j)];
        place += b.value[static_cast<std::size_t>(j)] * greville_point(b.first + j, cells);
        slope += b.slope[static_cast<std::size_t>(j)] * greville_point(b.first + j, cells);
      }
      EXPECT_NEAR(sum, 1.0, 1e-14);
      EXPECT_NEAR(place, t, 1e-13);
      EXPECT_NEAR(slope, 1.0, 1e-13);
      for (const double step : {1e-6, 5e-7}) {
        const CubicBasis after = cubic_basis(t + step, cells);
        const CubicBasis before = cubic_basis(t - step, cells);
        if (after.first != before.first) continue;
        for (std::size_t j = 0; j < 4; ++j) {
          EXPECT_NEAR((after.value[j] - before.value[j]) / (2.0 * step), b.slope[j], 1e-8);
        }
      }
    }
  }
}

TEST(CubicSpline, RestrictionKeepsTheSpline) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  constexpr int kCells = 9;
  const Eigen::VectorXd whole =
      Eigen::VectorXd::NullaryExpr(kCells + 3, [&] { return unit(random); });
  for (int from = 0; from < kCells; ++from) {
    for (int to = from + 1; to <= kCells; ++to) {
      const Eigen::VectorXd part =
          restriction(kCells, from, to) * whole.segment(from, to - from + 3);
      std::vector<double> at;
      std::vector<double> part_at;
      for (int i = 0; i <= 20 * (to - from); ++i) {
        at.push_back(from + i / 20.0);
        part_at.push_back(i / 20.0);
      }
      const Eigen::VectorXd a = basis_matrix(at, kCells, false) * whole;
      const Eigen::VectorXd b = basis_matrix(part_at, to - from, false) * part;
      EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-12) << from << ' ' << to;
    }
  }
}

TEST(SplineNet, KeepsAPlaneToTheRoundingOfItsHeights) {
  const auto plane = [](double x, double y) { return 5.0 + 0.1 * x - 0.05 * y; };
  const SmoothSurface surface(surface_of({80.0, 70.0}, {81, 81}, plane));
  const SplineNet net = fitted(surface);
  EXPECT_GT(net.patches.size(), 1U);
  EXPECT_LT(net.error().height, 2e-7);
  EXPECT_LT(net.error().normal, 1e-6);
  EXPECT_NEAR(net.volume(), 80.0 * 70.0 * (5.0 + 4.0 - 1.75), 1e-3);
}

TEST(SplineNet, PatchesJoinWithEqualHeightsAndSlopes) {
  const SmoothSurface surface(crowded_lens(101));
  const SplineNet net = fitted(surface, 20000);
  ASSERT_GT(net.columns, 1);
  for (int line = 1; line < net.columns; ++line) {
    for (int r = 0; r < net.rows; ++r) {
      const SplinePatch& a = net.patches[table_index(line - 1, r, net.columns)];
      const SplinePatch& b = net.patches[table_index(line, r, net.columns)];
      for (int i = 0; i <= 50; ++i) {
        const double v = a.box.min().y() + a.box.sizes().y() * i / 50.0;
        const SplinePoint left = a.at({a.box.max().x(), v});
        const SplinePoint right = b.at({b.box.min().x(), v});
        EXPECT_LT((left.xy - right.xy).norm(), 1e-12);
        EXPECT_NEAR(left.surface.z, right.surface.z, 1e-12);
        EXPECT_LT((left.surface.slope - right.surface.slope).norm(), 2e-6);
      }
    }
  }
}

/// The certificate was taken on a raster; one ten times as dense as the knots, and points at
/// random, find nothing worse.
void expect_certificate_holds(const SmoothSurface& surface, const SplineNet& net) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (const SplinePatch& patch : net.patches) {
    const FitError denser = measure_patch(patch, surface, FitOptions(), 10 * kMinDensity);
    EXPECT_LE(denser.height, patch.error.height);
    EXPECT_LE(denser.normal, patch.error.normal);
    EXPECT_NEAR(denser.normal_rms, patch.error.normal_rms, 0.1 * denser.normal_rms);
    for (int i = 0; i < 500; ++i) {
      const Eigen::Array2d share(unit(random), unit(random));
      const SplinePoint point =
          patch.at(patch.box.min() + (share * patch.box.sizes().array()).matrix());
      const auto truth = surface.model_at(nearest_inside(surface.box(), point.xy));
      ASSERT_TRUE(truth);
      const FitError found = difference(point.surface, *truth);
      EXPECT_LE(found.height, patch.error.height);
      EXPECT_LE(found.normal, patch.error.normal);
    }
  }
}

TEST(SplineNet, CertificateHoldsBetweenItsPoints) {
  for (const SurfaceMesh& mesh : {smooth_lens(61), creased_lens(), noisy_lens(), crowded_lens()}) {
    const SmoothSurface surface(mesh);
    expect_certificate_holds(surface, fitted(surface, 6000));
  }
}

/// Creases, moved vertices, a rectangle (3:2) and a square, both models.
TEST(SplineNet, CertificateHoldsOnDesignsOfFixtures) {
  DesignOptions options;
  options.model = SurfaceModel::kFacet;
  options.pixels = 32;
  options.rounds = 1;
  options.iterations = 20;
  for (const Image& picture : {fixtures::draw_logo(64), fixtures::draw_stripes(66)}) {
    const DesignResult design = design_lens(picture, options, Executor::cpu(2), RunControl());
    ASSERT_EQ(design.status, DesignResult::Status::kDone) << design.message;
    const SmoothSurface surface(design.lens.surface);
    expect_certificate_holds(surface, fitted(surface, 3000));
    options.model = SurfaceModel::kSmooth;
  }
}

/// Light goes by normals: splines must be nearer to the model's than the smooth surface is, which
/// follows them as well as it can, but has a jagged mesh's normals at all vertices.
TEST(SplineNet, FollowsNormalsAsWellAsTheSmoothSurface) {
  const SmoothSurface surface(noisy_lens());
  const SplineNet net = fitted(surface, 4000);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  double of_net = 0.0;
  double of_surface = 0.0;
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Array2d share(unit(random), unit(random));
    const SplinePoint point =
        net.at(surface.box().min() + (share * surface.box().sizes().array()).matrix());
    const auto model = surface.model_at(nearest_inside(surface.box(), point.xy));
    const auto own = surface.at(nearest_inside(surface.box(), point.xy));
    ASSERT_TRUE(model && own);
    of_net += (point.surface.slope - model->slope).squaredNorm();
    of_surface += (own->slope - model->slope).squaredNorm();
  }
  EXPECT_LT(of_net, of_surface);
}

/// A design whose normals contradict each other, as those of all smooth designs do.
Lens smooth_design(const LightOptions& light = {}) {
  DesignOptions options;
  options.pixels = 40;
  options.rounds = 1;
  options.iterations = 60;
  options.model = SurfaceModel::kSmooth;
  options.light = light;
  DesignResult design =
      design_lens(fixtures::draw_portrait(80), options, Executor::cpu(2), RunControl());
  EXPECT_EQ(design.status, DesignResult::Status::kDone) << design.message;
  return std::move(design.lens);
}

/// MAE of the net's picture, rendered from other points than the fit took.
double picture_error(const SplineNet& net, const Lens& lens) {
  const SampledSurface solid = sampled(net, {413, 477});
  return evaluate(solid.mesh, solid.normals, lens.setup, lens.target, nullptr, Executor::cpu(2))
      .mae;
}

/// Round trip: what the mesh's normals throw, the splines throw to 3e-4, a third of what the fit of
/// slopes alone misses; of the mirror half. The coarser a mesh, the more its normals contradict
/// each other.
/// @param share, most  that may be missing of what the fit of slopes alone misses, and of MAE.
void expect_kept_picture(const Lens& lens, double share, double most) {
  const Executor executor = Executor::cpu(2);
  const SmoothSurface surface(lens.surface);
  const double wanted =
      evaluate(lens.surface, lens.setup, SurfaceModel::kSmooth, lens.target, nullptr, executor).mae;
  const double by_slopes = picture_error(fitted(surface), lens) - wanted;
  EXPECT_GT(by_slopes, 5e-4);
  const WantedPicture picture(lens.surface, lens.setup, lens.target, executor);
  FitOptions options;
  options.picture.reach = picture.reach();
  options.picture.miss = [&](const SampledSurface& solid) {
    auto found = picture.compare(solid.mesh, solid.normals);
    return PictureMiss{found.excess, std::move(found.missing)};
  };
  const SplineNet net = fit_spline_net(surface, options, executor, RunControl());
  EXPECT_LT(picture_error(net, lens) - wanted, std::min(share * by_slopes, most));
  const SplineNet serial = fit_spline_net(surface, options, Executor::serial(), RunControl());
  EXPECT_EQ(net.patches.back().coefficients, serial.patches.back().coefficients);
}

TEST(SplineNet, KeepsThePictureThatNoSurfaceHasTheNormalsFor) {
  expect_kept_picture(smooth_design(), 1.0 / 3.0, 3e-4);
}

/// A mirror sends light against the slope, and here farther across the light than along it.
TEST(SplineNet, KeepsAMirrorsPicture) {
  LightOptions light;
  light.body = MirrorBody{};
  light.incidence = 30.0;
  const Lens mirror = smooth_design(light);
  ASSERT_TRUE(traits(mirror.setup.body).reflects);
  expect_kept_picture(mirror, 0.5, 5e-4);
}

/// The same surface and as many control points: knots that follow the crowded vertices are nearer
/// to the model than even ones.
TEST(SplineNet, KnotsAreDenseWhereVerticesAre) {
  SurfaceMesh mesh = crowded_lens();
  const double followed = fitted(SmoothSurface(mesh), 2500).error().normal_rms;
  mesh.grid = {};
  const double even = fitted(SmoothSurface(mesh), 2500).error().normal_rms;
  EXPECT_LT(followed, 0.7 * even);
}

TEST(GridWarp, LeavesAFlatGridAndAMeshWithoutGridAlone) {
  SurfaceMesh mesh = smooth_lens();
  const Eigen::AlignedBox2d box(Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(30.0, 24.0));
  EXPECT_LT((GridWarp(mesh, box).at({7.3, 5.1}) - Eigen::Vector2d(7.3, 5.1)).norm(), 1e-12);
  mesh = crowded_lens();
  mesh.grid = {};
  EXPECT_LT((GridWarp(mesh, box).at({7.3, 5.1}) - Eigen::Vector2d(7.3, 5.1)).norm(), 1e-12);
}

TEST(GridWarp, TakesTheFlatPlaceOfAVertexToTheVertex) {
  const SurfaceMesh mesh = crowded_lens();
  const Eigen::AlignedBox2d box(Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(30.0, 24.0));
  const GridWarp warp(mesh, box);
  for (Eigen::Index v = 0; v < mesh.vertex_count(); ++v) {
    const Eigen::Vector2d vertex = mesh.vertices.col(v).head<2>();
    EXPECT_LT((warp.at(warp.before(v)) - vertex).norm(), 1e-9);
  }
}

TEST(GridWarp, ControlPointsKeepTheBordersAndNeverFoldARowOfVertices) {
  const SurfaceMesh mesh = crowded_lens();
  const Eigen::AlignedBox2d box(Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(30.0, 24.0));
  const auto [x, y] = GridWarp(mesh, box).control_points(40, 50, 1.0);
  EXPECT_TRUE((x.row(0).array() == 0.0).all() && (x.row(42).array() == 30.0).all());
  EXPECT_TRUE((y.col(0).array() == 0.0).all() && (y.col(52).array() == 24.0).all());
  for (Eigen::Index i = 1; i < x.rows(); ++i) {
    EXPECT_GT((x.row(i) - x.row(i - 1)).minCoeff(), 0.0);
  }
}

/// Closed forms: a plane's slopes and, at its inner vertices, a paraboloid's agree with a surface;
/// moving vertices at random makes normals contradict each other, which no number of knots mends.
TEST(NormalBound, IsNothingForSurfacesAndBelowEveryFit) {
  const auto plane = [](double x, double y) { return 5.0 + 0.1 * x - 0.05 * y; };
  const SmoothSurface flat(surface_of({30.0, 24.0}, {31, 29}, plane));
  EXPECT_LT(normal_bound(flat, 1e-4).largest, 1e-12);
  EXPECT_EQ(normal_bound(flat, 1e-4).share_above, 0.0);
  for (const SurfaceMesh& mesh : {noisy_lens(), creased_lens(), crowded_lens()}) {
    const SmoothSurface surface(mesh);
    const NormalBound bound = normal_bound(surface, 1e-4);
    EXPECT_GT(bound.largest, 0.0);
    for (const std::int64_t points : {3000, 12000}) {
      const FitError error = fitted(surface, points).error();
      EXPECT_GE(error.normal, bound.largest);
      EXPECT_GE(error.area - error.area_within, 0.0);
      EXPECT_NEAR(error.area, surface.box().volume(), 0.01 * surface.box().volume());
    }
  }
  EXPECT_GT(normal_bound(SmoothSurface(noisy_lens()), 1e-4).share_above, 0.5);
}

/// Where the certificate says that errors are largest, they are about so large.
TEST(SplineNet, TellsWhereTheWorstPlacesAre) {
  const SmoothSurface surface(creased_lens());
  const SplineNet net = fitted(surface, 3000);
  const FitError error = net.error();
  const auto uv = net.parameters_of(error.normal_at, error.normal_at);
  ASSERT_TRUE(uv);
  const auto model = surface.model_at(error.normal_at);
  ASSERT_TRUE(model);
  const FitError there = difference(net.at(*uv).surface, *model);
  EXPECT_NEAR(there.normal * kCertificateMargin, error.normal, 1e-6);
  EXPECT_LT(error.share_within(), 0.999);
  EXPECT_GT(error.share_within(), 0.001);
}

TEST(SplineNet, ErrorFallsWithTheKnots) {
  const SmoothSurface surface(smooth_lens(41));
  double before = 1.0;
  for (const std::int64_t points : {100, 400, 1400, 5000, 20000}) {
    const double now = fitted(surface, points).error().normal;
    EXPECT_LT(now, before);
    before = now;
  }
}

TEST(SplineNet, ControlPointsStayWithinTheirLimit) {
  const SmoothSurface surface(creased_lens());
  for (const std::int64_t points : {500, 3000}) {
    EXPECT_LE(fitted(surface, points).control_points(), points);
  }
}

TEST(SplineNet, IsTheSameForAnyNumberOfThreads) {
  const SmoothSurface surface(smooth_lens(101));
  FitOptions options;
  options.max_control_points = 10000;
  const SplineNet one = fit_spline_net(surface, options, Executor::serial(), RunControl());
  const SplineNet three = fit_spline_net(surface, options, Executor::cpu(3), RunControl());
  ASSERT_EQ(one.patches.size(), three.patches.size());
  for (std::size_t i = 0; i < one.patches.size(); ++i) {
    EXPECT_EQ(one.patches[i].coefficients, three.patches[i].coefficients);
  }
}

TEST(SplineNet, SampledMeshIsTheNet) {
  const SmoothSurface surface(crowded_lens());
  const SplineNet net = fitted(surface, 5000);
  const SampledSurface samples = sampled(net, {200, 160});
  EXPECT_NEAR(enclosed_volume(closed_solid(samples.mesh, "net")), net.volume(),
              1e-5 * net.volume());
  for (Eigen::Index v = 0; v < samples.mesh.vertex_count(); v += 37) {
    const Eigen::Vector2d xy = samples.mesh.vertices.col(v).head<2>();
    const auto uv = net.parameters_of(xy, xy);
    ASSERT_TRUE(uv);
    const SurfacePoint point = net.at(*uv).surface;
    EXPECT_NEAR(samples.mesh.vertices(2, v), point.z, 1e-8);
    EXPECT_LT((samples.normals.col(v).head<2>() + point.slope).norm(), 1e-6);
  }
}

}  // namespace
}  // namespace lensforge::testing
