// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/flux/flux_triangle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "design/clip_reference.h"
#include "design/flux/flux_image.h"
#include "design/random_triangles.h"

namespace lensforge::flux_triangle_test {
namespace {

using testing::kColumns;
using testing::kRows;
using testing::Random;
using testing::Real;
using testing::RealTriangle;
using testing::TriangleClass;

std::vector<EdgePiece> pieces_of(const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
  std::vector<EdgePiece> pieces;
  walk_edge(p, q, kColumns, kRows, [&](const EdgePiece& e) { pieces.push_back(e); });
  return pieces;
}

/// Ends of random edges: anywhere around the picture, now and then on the pixel grid.
Eigen::Vector2d random_end(Random& random) {
  const double reach = random.below(4) == 0 ? 200.0 : 6.0;
  Eigen::Vector2d p(random.between(-reach, kColumns + reach),
                    random.between(-reach, kRows + reach));
  for (int k = 0; k < 2; ++k) {
    if (random.below(4) == 0) p[k] = std::round(p[k]);
  }
  return p;
}

template <class Check>
void for_random_edges(const Check& check) {
  Random random(11);
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector2d p = random_end(random);
    const Eigen::Vector2d q = random_end(random);
    SCOPED_TRACE(::testing::Message() << p.transpose() << " -> " << q.transpose());
    check(p, q, pieces_of(p, q));
    if (::testing::Test::HasFailure()) return;
  }
}

/// Length, as a share of the edge, of its part in low ≤ x ≤ high and 0 ≤ y ≤ kRows.
long double share_within(const Eigen::Vector2d& p, const Eigen::Vector2d& q, long double low,
                         long double high) {
  long double first = 0.0L;
  long double last = 1.0L;
  const auto cut = [&](long double from, long double delta, long double least, long double most) {
    if (delta == 0.0L) {
      if (from < least || from > most) last = -1.0L;
      return;
    }
    const long double a = (least - from) / delta;
    const long double b = (most - from) / delta;
    first = std::max(first, std::min(a, b));
    last = std::min(last, std::max(a, b));
  };
  cut(p.x(), static_cast<long double>(q.x()) - p.x(), low, high);
  cut(p.y(), static_cast<long double>(q.y()) - p.y(), 0.0L, kRows);
  return std::max(0.0L, last - first);
}

TEST(EdgeWalk, PiecesLieInTheirPixels) {
  for_random_edges([](const auto&, const auto&, const std::vector<EdgePiece>& pieces) {
    for (const EdgePiece& e : pieces) {
      ASSERT_TRUE(e.row >= 0 && e.row < kRows && e.column >= -1 && e.column < kColumns);
      ASSERT_TRUE(std::min(e.y0, e.y1) >= e.row && std::max(e.y0, e.y1) <= e.row + 1);
      if (e.column < 0) continue;
      EXPECT_GE(std::min(e.x0, e.x1), e.column - 1e-12);
      EXPECT_LE(std::max(e.x0, e.x1), e.column + 1 + 1e-12);
      EXPECT_LE(e.s0, e.s1);
    }
  });
}

TEST(EdgeWalk, NeighbouringPiecesShareTheirEnds) {
  for_random_edges([](const auto&, const auto&, const std::vector<EdgePiece>& pieces) {
    for (std::size_t i = 1; i < pieces.size(); ++i) {
      const EdgePiece& before = pieces[i - 1];
      const EdgePiece& after = pieces[i];
      ASSERT_EQ(before.y1, after.y0);
      if (before.column < 0 || after.column < 0) continue;
      EXPECT_EQ(before.x1, after.x0);
      EXPECT_EQ(before.s1, after.s0);
      EXPECT_EQ(std::abs(before.column - after.column) + std::abs(before.row - after.row), 1);
    }
  });
}

TEST(EdgeWalk, PiecesEndWhereTheirParametersSay) {
  for_random_edges(
      [](const Eigen::Vector2d& p, const Eigen::Vector2d& q, const std::vector<EdgePiece>& pieces) {
        const double tolerance = 1e-15 * ((q - p).norm() + p.norm() + 1.0);
        for (const EdgePiece& e : pieces) {
          if (e.column < 0) continue;
          EXPECT_NEAR(e.x1, p.x() + e.s1 * (q.x() - p.x()), 8.0 * tolerance);
          EXPECT_NEAR(e.y1, p.y() + e.s1 * (q.y() - p.y()), 8.0 * tolerance);
        }
      });
}

TEST(EdgeWalk, PiecesCoverThePartInThePicture) {
  for_random_edges(
      [](const Eigen::Vector2d& p, const Eigen::Vector2d& q, const std::vector<EdgePiece>& pieces) {
        double covered = 0.0;
        for (const EdgePiece& e : pieces) covered += e.column < 0 ? 0.0 : e.s1 - e.s0;
        EXPECT_NEAR(covered, static_cast<double>(share_within(p, q, 0.0L, kColumns)), 1e-12);
      });
}

TEST(EdgeWalk, LeftPiecesCoverTheRowsLeftOfThePicture) {
  for_random_edges(
      [](const Eigen::Vector2d& p, const Eigen::Vector2d& q, const std::vector<EdgePiece>& pieces) {
        if (p.x() == 0.0 && q.x() == 0.0) return;  // On the border: either side is right.
        double rise = 0.0;
        for (const EdgePiece& e : pieces) rise += e.column < 0 ? e.y1 - e.y0 : 0.0;
        const double share = static_cast<double>(share_within(p, q, -1e9L, 0.0L));
        EXPECT_NEAR(rise, share * (q.y() - p.y()), 1e-11);
      });
}

TEST(EdgeWalk, VisitsNoMorePiecesThanPromised) {
  for_random_edges(
      [](const Eigen::Vector2d& p, const Eigen::Vector2d& q, const std::vector<EdgePiece>& pieces) {
        const double columns = std::fabs(std::floor(p.x()) - std::floor(q.x()));
        const double rows = std::fabs(std::floor(p.y()) - std::floor(q.y()));
        EXPECT_LE(static_cast<double>(pieces.size()), columns + rows + 3.0);
      });
}

TEST(EdgeWalk, EdgesOutsideGiveNoPieces) {
  EXPECT_TRUE(pieces_of({2.0, -3.0}, {9.0, -0.5}).empty());
  EXPECT_TRUE(pieces_of({2.0, kRows + 0.5}, {9.0, kRows + 4.0}).empty());
  EXPECT_TRUE(pieces_of({kColumns + 0.5, 1.0}, {kColumns + 9.0, 8.0}).empty());
}

constexpr std::size_t kPixels = std::size_t{kColumns} * kRows;

/// Relative to a triangle's own flux.
constexpr double kTolerance = 1e-10;

std::vector<double> picture_of(const ImageTriangle& t) {
  FluxImage image(kColumns, kRows);
  const auto flux = image.render(Executor::serial(), std::array{t});
  return {flux.begin(), flux.end()};
}

std::vector<double> clipped_picture_of(const ImageTriangle& t) {
  std::vector<double> flux(kPixels, 0.0);
  testing::for_each_touched_pixel(
      testing::real_corners(t), kColumns, kRows, [&](int pixel, Real share) {
        flux[static_cast<std::size_t>(pixel)] = static_cast<double>(share) * t.flux;
      });
  return flux;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::fabs(a[i] - b[i]));
  return worst;
}

double sum_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

std::string describe(const ImageTriangle& t) {
  std::ostringstream out;
  out.precision(17);
  out << t.p0.transpose() << " | " << t.p1.transpose() << " | " << t.p2.transpose() << " flux "
      << t.flux;
  return out.str();
}

void record(const std::string& name, double value) {
  ::testing::Test::RecordProperty(name, std::to_string(std::log10(value)));
}

class FluxTriangleKinds : public ::testing::TestWithParam<TriangleClass> {};

TEST_P(FluxTriangleKinds, DepositEqualsClippingEveryPixel) {
  Random random(1);
  double worst = 0.0;
  for (int i = 0; i < 3000; ++i) {
    const ImageTriangle t = testing::next_triangle(GetParam(), random);
    const double error = largest_difference(picture_of(t), clipped_picture_of(t)) / t.flux;
    ASSERT_LE(error, kTolerance) << describe(t);
    worst = std::max(worst, error);
  }
  record("log10_worst", worst);
}

TEST_P(FluxTriangleKinds, OrientationDoesNotMatter) {
  Random random(2);
  for (int i = 0; i < 300; ++i) {
    const ImageTriangle t = testing::next_triangle(GetParam(), random);
    const ImageTriangle turned{t.p0, t.p2, t.p1, t.flux};
    ASSERT_LE(largest_difference(picture_of(t), picture_of(turned)) / t.flux, kTolerance)
        << describe(t);
  }
}

TEST_P(FluxTriangleKinds, UntouchedPixelsAreExactlyZero) {
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const ImageTriangle t = testing::next_triangle(GetParam(), random);
    std::vector<bool> touched(kPixels, false);
    testing::for_each_touched_pixel(
        testing::real_corners(t), kColumns, kRows,
        [&](int pixel, Real) { touched[static_cast<std::size_t>(pixel)] = true; });
    const std::vector<double> flux = picture_of(t);
    for (std::size_t k = 0; k < kPixels; ++k) {
      ASSERT_TRUE(touched[k] || flux[k] == 0.0) << describe(t) << " pixel " << k << ' ' << flux[k];
    }
  }
}

/// A random picture of derivatives; a corner step moves Σ g·flux.
struct Cotangent {
  explicit Cotangent(std::uint64_t seed) : image(kColumns, kRows) {
    Random random(seed);
    for (double& g : image.pixels()) g = random.between(-1.0, 1.0);
    image.prepare(Executor::serial());
  }

  /// Σ g · (share of the triangle in the pixel), by clipping.
  [[nodiscard]] Real mean_over(const RealTriangle& t) const {
    Real sum = 0.0L;
    testing::for_each_touched_pixel(t, kColumns, kRows, [&](int pixel, Real share) {
      sum += share * image.view().pixel[pixel];
    });
    return sum;
  }

  FluxCotangentImage image;
};

/// Small against the triangle, large against the last digit of the extended coordinates.
constexpr std::array<Real, 2> kDifferenceSteps = {1e-8L, 5e-9L};

/// Derivatives by p0, p1, p2 through central differences in extended precision, with a step in
/// units of the triangle.
std::array<double, 6> numeric_corner_slopes(const Cotangent& cotangent, const ImageTriangle& t,
                                            Real relative_step) {
  const Real step = relative_step * static_cast<Real>(testing::longest_extent(t));
  std::array<double, 6> slopes{};
  for (std::size_t i = 0; i < 6; ++i) {
    const auto at = [&](Real shift) {
      RealTriangle moved = testing::real_corners(t);
      (i % 2 == 0 ? moved[i / 2].x : moved[i / 2].y) += shift;
      return cotangent.mean_over(moved);
    };
    slopes[i] = static_cast<double>(t.flux * (at(step) - at(-step)) / (2.0L * step));
  }
  return slopes;
}

/// Largest difference of slopes, relative to the largest one.
double slope_error(const std::array<double, 6>& computed, const std::array<double, 6>& expected,
                   const ImageTriangle& t) {
  // A triangle inside one pixel has no slope; then the scale is that of one that straddles.
  double largest = 1e-3 * t.flux / testing::longest_extent(t);
  double error = 0.0;
  for (std::size_t k = 0; k < 6; ++k) {
    largest = std::max(largest, std::fabs(expected[k]));
    error = std::max(error, std::fabs(computed[k] - expected[k]));
  }
  return error / largest;
}

class FluxTriangleAdjoint : public ::testing::TestWithParam<TriangleClass> {};

TEST_P(FluxTriangleAdjoint, CornerSlopesEqualCentralDifferences) {
  Random random(4);
  const Cotangent cotangent(5);
  double worst = 0.0;
  for (int i = 0; i < 400; ++i) {
    const ImageTriangle t = testing::next_triangle(GetParam(), random);
    const ImageTriangle bar = deposit_adjoint(t, cotangent.image.view());
    const std::array<double, 6> computed{bar.p0.x(), bar.p0.y(), bar.p1.x(),
                                         bar.p1.y(), bar.p2.x(), bar.p2.y()};
    for (const Real step : kDifferenceSteps) {
      const double error = slope_error(computed, numeric_corner_slopes(cotangent, t, step), t);
      ASSERT_LE(error, 1e-6) << describe(t) << " step " << step;
      worst = std::max(worst, error);
    }
  }
  record("log10_worst", worst);
}

TEST_P(FluxTriangleAdjoint, FluxSlopeIsTheMeanDerivativeOverTheTriangle) {
  Random random(6);
  const Cotangent cotangent(7);
  double worst = 0.0;
  for (int i = 0; i < 1000; ++i) {
    const ImageTriangle t = testing::next_triangle(GetParam(), random);
    const double expected = static_cast<double>(cotangent.mean_over(testing::real_corners(t)));
    const double error = std::fabs(deposit_adjoint(t, cotangent.image.view()).flux - expected);
    ASSERT_LE(error, 1e-9) << describe(t);
    worst = std::max(worst, error);
  }
  record("log10_worst", worst);
}

std::string class_name(const ::testing::TestParamInfo<TriangleClass>& info) {
  return info.param.name;
}

std::vector<TriangleClass> all_classes() {
  std::vector<TriangleClass> classes = testing::generic_classes();
  const std::vector<TriangleClass> aligned = testing::aligned_classes();
  classes.insert(classes.end(), aligned.begin(), aligned.end());
  return classes;
}

INSTANTIATE_TEST_SUITE_P(FluxTriangle, FluxTriangleKinds, ::testing::ValuesIn(all_classes()),
                         class_name);
// Sides along pixel borders are where the slope jumps: nothing to compare there.
INSTANTIATE_TEST_SUITE_P(FluxTriangle, FluxTriangleAdjoint,
                         ::testing::ValuesIn(testing::generic_classes()), class_name);

/// A triangle of the given area over the square of its longest side, well inside the picture and
/// not along a pixel border.
ImageTriangle sliver(Random& random, double ratio) {
  const double angle = random.between(0.1, 1.4) + random.below(4) * std::numbers::pi / 2.0;
  const Eigen::Vector2d along = Eigen::Vector2d(std::cos(angle), std::sin(angle));
  const Eigen::Vector2d across(-along.y(), along.x());
  const double length = random.magnitude(0.5, 5.0);
  const Eigen::Vector2d a(random.between(6.0, 11.0), random.between(6.0, 7.0));
  const Eigen::Vector2d third = random.between(0.05, 0.95) * length * along;
  return {a, a + length * along, a + third + 2.0 * ratio * length * across, 1.0};
}

TEST(FluxTriangle, SliversKeepTheirStatedError) {
  Random random(8);
  double worst = 0.0;
  for (int i = 0; i < 3000; ++i) {
    // Below 1e-10 the clipping itself runs out of digits.
    const double ratio = random.magnitude(1e-10, 1e-4);
    const ImageTriangle t = sliver(random, ratio);
    const double error = largest_difference(picture_of(t), clipped_picture_of(t));
    const double rounding = 4e-16 / std::max(ratio, kNeedleRatio);
    // A needle, or a triangle denser than kMaxDensity, loses its width; at 0.1 rad from the pixel
    // borders and the densities of a tent that moves at most 20 widths' share of the flux.
    const double width = 2.0 * ratio * testing::longest_extent(t);
    const bool needle = ratio < 2.0 * kNeedleRatio || testing::area_of(t) * kMaxDensity < 2.0;
    ASSERT_LE(error, kTolerance + rounding + (needle ? 40.0 * width : 0.0)) << describe(t);
    if (ratio < kNeedleRatio) worst = std::max(worst, error);
  }
  record("log10_worst_needle", worst);
}

TEST(FluxTriangle, SliversLoseNoFlux) {
  Random random(9);
  for (int i = 0; i < 3000; ++i) {
    const ImageTriangle t = sliver(random, random.magnitude(1e-16, 1e-4));
    ASSERT_NEAR(sum_of(picture_of(t)), t.flux, 1e-12) << describe(t);
  }
}

/// Share of a tent over a → b with its peak at `peak` in every pixel, by the midpoint rule.
std::vector<double> integrated_tent(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                    double peak) {
  constexpr int kSteps = 200000;
  std::vector<double> flux(kPixels, 0.0);
  for (int i = 0; i < kSteps; ++i) {
    const double s = (i + 0.5) / kSteps;
    const Eigen::Vector2d p = a + s * (b - a);
    const double density = 2.0 * (s < peak ? s / peak : (1.0 - s) / (1.0 - peak));
    const auto column = static_cast<std::size_t>(p.x());
    const auto row = static_cast<std::size_t>(p.y());
    flux[row * kColumns + column] += density / kSteps;
  }
  return flux;
}

TEST(FluxTriangle, CollinearCornersGiveATentOfLight) {
  Random random(10);
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector2d a = testing::point_in_picture(random);
    const Eigen::Vector2d b = testing::point_in_picture(random);
    const double peak = i < 4 ? i % 2 : random.between(0.0, 1.0);
    std::array corners{a, b, Eigen::Vector2d(a + peak * (b - a))};
    std::rotate(corners.begin(), corners.begin() + i % 3, corners.end());
    const ImageTriangle t{corners[0], corners[1], corners[2], 1.0};
    // The midpoint rule misplaces one step at most at each pixel border.
    EXPECT_LE(largest_difference(picture_of(t), integrated_tent(a, b, peak)), 4.1 / 200000)
        << describe(t);
    EXPECT_NEAR(sum_of(picture_of(t)), 1.0, 1e-13);
  }
}

TEST(FluxTriangle, CoincidingCornersGiveAllFluxToTheirPixel) {
  const Eigen::Vector2d inside(4.25, 7.5);
  const std::vector<double> flux = picture_of({inside, inside, inside, 0.375});
  EXPECT_EQ(flux[7 * kColumns + 4], 0.375);
  EXPECT_EQ(sum_of(flux), 0.375);
  for (const Eigen::Vector2d& p : {Eigen::Vector2d(4.0, 7.0), Eigen::Vector2d(4.0, 7.5)}) {
    EXPECT_EQ(sum_of(picture_of({p, p, p, 0.375})), 0.375);
  }
}

TEST(FluxTriangle, NonFiniteCornersGiveNothing) {
  const ImageTriangle good{{2.0, 2.0}, {9.0, 3.0}, {5.0, 9.0}, 1.0};
  const Cotangent cotangent(12);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
        -std::numeric_limits<double>::infinity()}) {
    for (int k = 0; k < 6; ++k) {
      ImageTriangle t = good;
      Eigen::Vector2d* corners[] = {&t.p0, &t.p1, &t.p2};
      (*corners[k / 2])[k % 2] = bad;
      for (const double flux : picture_of(t)) ASSERT_EQ(flux, 0.0) << describe(t);
      EXPECT_EQ(deposit_adjoint(t, cotangent.image.view()).flux, 0.0) << describe(t);
    }
  }
}

TEST(FluxTriangle, AllCornersNanGiveNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Vector2d bad(nan, nan);
  EXPECT_EQ(sum_of(picture_of({bad, bad, bad, 1.0})), 0.0);
}

TEST(FluxTriangle, NeedlesFeelOnlyTheirFlux) {
  Random random(13);
  const Cotangent cotangent(14);
  for (int i = 0; i < 200; ++i) {
    const ImageTriangle t = sliver(random, 0.0);
    const ImageTriangle bar = deposit_adjoint(t, cotangent.image.view());
    const std::vector<double> flux = picture_of(t);
    double expected = 0.0;
    for (std::size_t k = 0; k < kPixels; ++k) expected += flux[k] * cotangent.image.view().pixel[k];
    EXPECT_NEAR(bar.flux, expected, 1e-12) << describe(t);
    EXPECT_TRUE(bar.p0.isZero() && bar.p1.isZero() && bar.p2.isZero()) << describe(t);
  }
}

}  // namespace

}  // namespace lensforge::flux_triangle_test
