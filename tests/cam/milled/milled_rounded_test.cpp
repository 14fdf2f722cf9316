// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "cam/cam_meshes.h"
#include "cam/milled/rounded_field.h"
#include "cam/milled_paths.h"
#include "cam/milled_tiles.h"
#include "core/lens/smooth_surface.h"

namespace lensforge::milled_rounded_test {
namespace {

constexpr double kRadius = 0.2;

/// A mesh, its facets and what the ball can reach of them.
struct Rounded {
  explicit Rounded(const SurfaceMesh& surface)
      : mesh(surface),
        cutter(mesh, kRadius, Executor::serial()),
        designed(mesh),
        field(designed, designed.grid(), cutter, Executor::serial()) {}

  SurfaceMesh mesh;
  DropCutter cutter;
  FacetField designed;
  RoundedField field;
};

TEST(RoundedField, PlaneAndRoofStayAsDesigned) {
  for (const double roof : {0.0, 0.2}) {
    const Rounded rounded(testing::grid_mesh(9, 7, 2.0, 2.0, [&](double x, double y) {
      return 3.0 + 0.3 * x - 0.1 * y - roof * std::abs(x - 1.0);
    }));
    const GridWindow window = testing::window_at({0.0, 0.0}, 0.02, 101, 101);
    const SurfacePatch designed = testing::sampled(rounded.designed, window);
    SurfacePatch patch;
    rounded.field.sample(window, Executor::serial(), patch);
    EXPECT_EQ(patch.z, designed.z);
    EXPECT_EQ(patch.slope_x, designed.slope_x);
    EXPECT_EQ(patch.cut, designed.cut);
    EXPECT_EQ(*std::max_element(patch.depth.begin(), patch.depth.end()), 0.0);
  }
}

/// A groove along y at x = 1: slope m1 to the left going down, m2 to the right going up.
struct Groove {
  double left, right;
  [[nodiscard]] double z(double x) const { return 3.0 + (x < 1.0 ? left : right) * (x - 1.0); }
};

TEST(RoundedField, VGrooveKeepsTheFilletOfTheClosedForm) {
  for (const Groove& groove : {Groove{-0.3, 0.3}, Groove{-0.02, 0.05}, Groove{0.1, 0.5}}) {
    const Rounded rounded(
        testing::grid_mesh(9, 7, 2.0, 2.0, [&](double x, double) { return groove.z(x); }));
    const GridWindow window = testing::window_at({0.85, 0.7}, 0.0003, 1001, 3);
    SurfacePatch patch;
    rounded.field.sample(window, Executor::serial(), patch);
    const double a = std::atan(groove.left);
    const double b = std::atan(groove.right);
    const double turn = b - a;
    const double tilt = 0.5 * (a + b);
    // Centre of the ball that touches both faces: R/cos(Δ/2) from the crease along the bisector.
    const double reach = kRadius / std::cos(0.5 * turn);
    const double x0 = 1.0 - reach * std::sin(tilt);
    const double z0 = 3.0 + reach * std::cos(tilt);
    double deepest = 0.0;
    std::size_t filleted = 0;
    for (std::size_t i = 0; i < 1001; ++i) {
      const double x = patch.window.x(static_cast<std::int64_t>(i));
      const bool fillet = x > x0 + kRadius * std::sin(a) && x < x0 + kRadius * std::sin(b);
      const double root = std::sqrt(kRadius * kRadius - (x - x0) * (x - x0));
      EXPECT_NEAR(patch.z[i], fillet ? z0 - root : groove.z(x), 1e-12);
      const double slope = fillet ? (x - x0) / root : x < 1.0 ? groove.left : groove.right;
      if (std::abs(x - 1.0) > 1e-9) {
        EXPECT_NEAR(patch.slope_x[i], slope, 1e-9);
      }
      EXPECT_EQ(patch.cut[i] == RoundedField::kFillet, fillet);
      EXPECT_NEAR(patch.depth[i], fillet ? z0 - root - groove.z(x) : 0.0, 1e-12);
      EXPECT_NEAR(patch.width[i], fillet ? 2.0 * kRadius * std::sin(0.5 * turn) : 0.0, 1e-12);
      deepest = std::max(deepest, patch.depth[i]);
      filleted += fillet ? 1 : 0;
    }
    EXPECT_GT(filleted, 10U);
    if (groove.left == -groove.right) {
      EXPECT_NEAR(deepest, kRadius * (1.0 / std::cos(0.5 * turn) - 1.0), 1e-12);
    }
  }
}

TEST(RoundedField, PyramidPitHoldsTheBallOnThreeFaces) {
  // Three planes with normals 120° apart meet in (1, 1).
  const double m = 0.4;
  const auto z = [&](double x, double y) {
    double height = 0.0;
    for (int k = 0; k < 3; ++k) {
      const double angle = 0.3 + 2.0 * k * std::acos(-1.0) / 3.0;
      height = std::max(height, m * (std::cos(angle) * (x - 1.0) + std::sin(angle) * (y - 1.0)));
    }
    return 3.0 + height;
  };
  // Triangles along the creases: a fan around the pit.
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 7);
  mesh.vertices.col(0) << 1.0, 1.0, 3.0;
  mesh.triangles.resize(3, 6);
  for (int k = 0; k < 6; ++k) {
    const double angle = 0.3 + k * std::acos(-1.0) / 3.0;
    const double x = 1.0 + std::cos(angle);
    const double y = 1.0 + std::sin(angle);
    mesh.vertices.col(k + 1) << x, y, z(x, y);
    mesh.triangles.col(k) << 0, k + 1, (k + 1) % 6 + 1;
  }
  const Rounded rounded(mesh);
  const SurfacePatch patch =
      testing::sampled(rounded.field, testing::window_at({0.98, 0.98}, 0.004, 11, 11));
  const double centre = 3.0 + kRadius * std::sqrt(1.0 + m * m);
  for (std::int64_t n = 0; n < 121; ++n) {
    const Eigen::Vector2d q = patch.window.node(n % 11, n / 11);
    const double r2 = (q - Eigen::Vector2d(1.0, 1.0)).squaredNorm();
    const auto i = static_cast<std::size_t>(n);
    EXPECT_NEAR(patch.z[i], centre - std::sqrt(kRadius * kRadius - r2), 1e-12);
    EXPECT_NEAR(patch.slope_x[i], (q.x() - 1.0) / std::sqrt(kRadius * kRadius - r2), 1e-10);
  }
}

SurfaceMesh creased_relief() {
  return testing::grid_mesh(15, 16, 2.0, 2.0, [](double x, double y) {
    return testing::lens_relief(3.0 * x, 3.0 * y) + 0.2 * std::abs(x - 0.834 + 0.3 * y) -
           0.15 * std::abs(y - 1.05) + 0.1 * std::abs(x + y - 2.1);
  });
}

/// The lowest of many balls over q: a grid of positions that closes in on the best twice.
double best_of_many(const DropCutter& cutter, const Eigen::Vector2d& q) {
  double best = 1e3;
  Eigen::Vector2d at = q;
  double step = kRadius / 20.0;
  int reach = 19;
  for (int level = 0; level < 5; ++level) {
    const Eigen::Vector2d middle = at;
    for (int r = -reach; r <= reach; ++r) {
      for (int c = -reach; c <= reach; ++c) {
        const Eigen::Vector2d p = middle + step * Eigen::Vector2d(c, r);
        const double room = kRadius * kRadius - (q - p).squaredNorm();
        if (room < 0.0) continue;
        const double z = cutter.drop(p).tip + kRadius - std::sqrt(room);
        if (z >= best) continue;
        best = z;
        at = p;
      }
    }
    reach = 10;
    step *= 0.2;
  }
  return best;
}

TEST(RoundedField, EqualsTheBestOfManyBalls) {
  const Rounded rounded(creased_relief());
  const SurfacePatch patch =
      testing::sampled(rounded.field, testing::window_at({0.4, 0.4}, 0.0611, 20, 20));
  const SurfacePatch fine =
      testing::sampled(rounded.field, testing::window_at({0.4, 0.4}, 0.0047, 256, 256));
  std::size_t fillets = 0;
  for (const SurfacePatch* some : {&patch, &fine}) {
    const bool all = some == &patch;
    for (std::int64_t n = 0; n < some->window.size(); n += all ? 1 : 31) {
      const auto i = static_cast<std::size_t>(n);
      const bool fillet = some->cut[i] == RoundedField::kFillet;
      if (!all && !fillet) continue;
      fillets += fillet ? 1 : 0;
      const Eigen::Vector2d q =
          some->window.node(n % some->window.columns, n / some->window.columns);
      const double best = best_of_many(rounded.cutter, q);
      EXPECT_LE(some->z[i], best + 1e-9) << q.transpose();
      // The last grid's step is 1.6e-5 mm; beside the best place in a valley it costs slope × step.
      EXPECT_GE(some->z[i], best - 1e-5) << q.transpose();
    }
  }
  EXPECT_GT(fillets, 50U);
}

TEST(RoundedField, LeavingOutFacetsThatCannotBeCutChangesNoBit) {
  const Rounded rounded(creased_relief());
  const FacetCutSurface facets(rounded.mesh, kRadius, Executor::serial());
  const RoundedField plain(rounded.designed, facets, 0.0, Executor::serial());
  const GridWindow window = testing::window_at({0.0, 0.0}, 0.01, 200, 200);
  const SurfacePatch a = testing::sampled(rounded.field, window);
  const SurfacePatch b = testing::sampled(plain, window);
  EXPECT_EQ(a.z, b.z);
  EXPECT_EQ(a.slope_x, b.slope_x);
  EXPECT_EQ(a.slope_y, b.slope_y);
  EXPECT_EQ(a.cut, b.cut);
}

TEST(RoundedField, SameBitsForAnyTilesAndThreads) {
  const Rounded rounded(creased_relief());
  testing::expect_same_bits_in_tiles(rounded.field,
                                     testing::window_at({0.0, 0.0}, 0.0131, 150, 150));
}

/// A bowl whose bend at its bottom is sharper than the ball: z = √(x² + a²), of radius a there.
SurfaceMesh sharp_bowl(double a) {
  return testing::grid_mesh(41, 11, 2.0, 0.5, [&](double x, double /*y*/) {
    return 3.0 + 0.5 * std::sqrt((x - 1.0) * (x - 1.0) + a * a);
  });
}

TEST(RoundedField, SmoothSurfaceKeepsWhatTheBallDoesNotReach) {
  const SurfaceMesh mesh = sharp_bowl(0.05);
  const SmoothSurface surface(mesh);
  const SmoothField designed(surface);
  const SmoothCutSurface cut(mesh, kRadius, {1e-4, 5e-2, 1'000'000}, Executor::serial());
  const RoundedField field(designed, cut, 1e-4, Executor::serial());
  const GridWindow window = testing::window_at({0.5, 0.25}, 0.005, 201, 3);
  SurfacePatch patch;
  field.sample(window, Executor::serial(), patch);
  const SurfacePatch plain = testing::sampled(designed, window);
  const auto cutter =
      cut.cutter({Eigen::Vector2d(0.2, 0.0), Eigen::Vector2d(1.8, 0.5)}, Executor::serial());
  std::size_t held = 0;
  for (std::size_t i = 201; i < 402; i += 10) {
    const auto column = static_cast<std::int64_t>(i - 201);
    EXPECT_NEAR(patch.z[i], best_of_many(*cutter, window.node(column, 1)), 1e-4);
    held += patch.depth[i] > 0.0 ? 1 : 0;
    if (patch.depth[i] == 0.0) {
      EXPECT_EQ(patch.z[i], plain.z[i]);
    }
  }
  EXPECT_GT(held, 2U);
  EXPECT_LT(held, 15U);
  EXPECT_GT(patch.depth[301], 1e-3);
  EXPECT_NEAR(patch.slope_x[301], 0.0, 5e-2);
}

TEST(RoundedField, SmoothSurfaceHasTheSameBitsForAnyTilesAndThreads) {
  const SurfaceMesh mesh = testing::grid_mesh(41, 9, 22.0, 4.0, [](double x, double y) {
    return testing::lens_relief(x, y) + 0.2 * std::abs(x - 9.9);
  });
  const SmoothSurface surface(mesh);
  const SmoothField designed(surface);
  const SmoothCutSurface cut(mesh, kRadius, {1e-3, 0.2, 1'000'000}, Executor::serial());
  testing::expect_same_bits_in_tiles(RoundedField(designed, cut, 1e-3, Executor::serial()),
                                     testing::window_at({9.0, 1.0}, 0.02, 120, 60));
}

/// Facets of a smooth surface without what it is said to bend.
class BareFacets final : public CutSurface {
 public:
  explicit BareFacets(const SmoothCutSurface& cut) : cut_(cut) {}
  [[nodiscard]] std::shared_ptr<const DropCutter> cutter(const Eigen::AlignedBox2d& axis,
                                                         const Executor& executor) const override {
    return cut_.cutter(axis, executor);
  }
  [[nodiscard]] double radius() const override { return cut_.radius(); }

 private:
  const SmoothCutSurface& cut_;
};

TEST(RoundedField, PlacesThatBendLessThanTheBallNeedNoFacets) {
  const SurfaceMesh mesh = testing::grid_mesh(41, 21, 4.0, 2.0, [](double x, double y) {
    return testing::lens_relief(x, y) + 0.3 * std::abs(x - 1.9 - 0.2 * y);
  });
  const SmoothSurface surface(mesh);
  const SmoothField designed(surface);
  const SmoothCutSurface cut(mesh, kRadius, {1e-4, 5e-2, 1'000'000}, Executor::serial());
  const SmoothReach reach(*cut.bed(), Executor::serial());
  const GridWindow window = testing::window_at({0.0, 0.0}, 0.04, 101, 51);
  const SurfacePatch plain = testing::sampled(
      RoundedField(designed, BareFacets(cut), cut.deviation().height, Executor::serial()), window);
  const SurfacePatch patch = testing::sampled(
      RoundedField(designed, cut, cut.deviation().height, Executor::serial()), window);
  EXPECT_EQ(patch.z, plain.z);
  EXPECT_EQ(patch.slope_x, plain.slope_x);
  EXPECT_EQ(patch.slope_y, plain.slope_y);
  std::int64_t free = 0;
  for (std::int64_t n = 0; n < window.size(); ++n) {
    free += reach.surely_free(window.node(n % 101, n / 101)) ? 1 : 0;
  }
  EXPECT_GT(free, window.size() / 2);
  EXPECT_LT(free, window.size());
}

}  // namespace
}  // namespace lensforge::milled_rounded_test
