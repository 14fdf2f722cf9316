// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/flux/flux_image.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "core/optics/light_source.h"
#include "design/clip_reference.h"
#include "design/random_input.h"
#include "design/random_triangles.h"
#include "design/test_setups.h"

namespace lensforge::flux_image_test {
namespace {

using testing::Random;

constexpr int kWide = 64;
constexpr int kHigh = 48;

std::vector<double> render(const std::vector<ImageTriangle>& triangles,
                           const Executor& executor = Executor::serial()) {
  FluxImage image(kWide, kHigh);
  const auto flux = image.render(executor, triangles);
  return {flux.begin(), flux.end()};
}

double sum_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

/// Triangles of all sizes that share a total flux of 1; `margin` pixels are kept free.
std::vector<ImageTriangle> random_triangles(int count, double margin, std::uint64_t seed) {
  Random random(seed);
  const Eigen::Vector2d low(margin, margin);
  const Eigen::Vector2d high(kWide - margin, kHigh - margin);
  std::vector<ImageTriangle> triangles;
  double total = 0.0;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d centre(random.between(0.0, kWide), random.between(0.0, kHigh));
    ImageTriangle t = testing::triangle_around(random, centre, random.magnitude(1e-3, 30.0));
    for (Eigen::Vector2d* p : {&t.p0, &t.p1, &t.p2}) *p = p->cwiseMax(low).cwiseMin(high);
    t.flux = random.between(0.0, 1.0);
    total += t.flux;
    triangles.push_back(t);
  }
  for (ImageTriangle& t : triangles) t.flux /= total;
  return triangles;
}

/// A jittered grid of image triangles that tiles the picture, of uniform light.
std::vector<ImageTriangle> tiling(int columns, int rows, std::uint64_t seed) {
  Random random(seed);
  std::vector<Eigen::Vector2d> points;
  for (int r = 0; r <= rows; ++r) {
    for (int c = 0; c <= columns; ++c) {
      Eigen::Vector2d p(c, r);
      if (c > 0 && c < columns) p.x() += random.between(-0.15, 0.15);
      if (r > 0 && r < rows) p.y() += random.between(-0.15, 0.15);
      points.emplace_back(p.x() * kWide / columns, p.y() * kHigh / rows);
    }
  }
  std::vector<ImageTriangle> triangles;
  const auto add = [&](int a, int b, int c) {
    const auto at = [&](int i) { return points[static_cast<std::size_t>(i)]; };
    ImageTriangle t{at(a), at(b), at(c), 0.0};
    t.flux = testing::area_of(t) / (static_cast<double>(kWide) * kHigh);
    triangles.push_back(t);
  };
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const int a = r * (columns + 1) + c;
      add(a, a + 1, a + columns + 2);
      add(a, a + columns + 2, a + columns + 1);
    }
  }
  return triangles;
}

TEST(FluxImage, TotalFluxIsConserved) {
  for (const double margin : {1e-3, 3.5}) {
    const std::vector<double> flux = render(random_triangles(20000, margin, 1));
    EXPECT_NEAR(sum_of(flux), 1.0, 1e-12);
  }
}

TEST(FluxImage, ATilingOfUniformLightIsUniform) {
  const std::vector<double> flux = render(tiling(83, 97, 2));
  EXPECT_NEAR(sum_of(flux), 1.0, 1e-12);
  const double mean = 1.0 / (static_cast<double>(kWide) * kHigh);
  for (const double value : flux) ASSERT_NEAR(value / mean, 1.0, 1e-10);
}

TEST(FluxImage, PixelsThatNoTriangleTouchesAreExactlyZero) {
  const std::vector<ImageTriangle> triangles = random_triangles(60, 3.5, 3);
  std::vector<bool> touched(static_cast<std::size_t>(kWide * kHigh), false);
  for (const ImageTriangle& t : triangles) {
    testing::for_each_touched_pixel(
        testing::real_corners(t), kWide, kHigh,
        [&](int pixel, testing::Real) { touched[static_cast<std::size_t>(pixel)] = true; });
  }
  ASSERT_GT(std::count(touched.begin(), touched.end(), false), 400);
  const std::vector<double> flux = render(triangles);
  for (std::size_t i = 0; i < flux.size(); ++i) {
    ASSERT_TRUE(touched[i] || flux[i] == 0.0) << i << ' ' << flux[i];
  }
}

TEST(FluxImage, ThreadCountDoesNotChangeABit) {
  const std::vector<ImageTriangle> triangles = random_triangles(30000, 0.0, 4);
  const std::vector<double> serial = render(triangles);
  EXPECT_EQ(serial, render(triangles, Executor::cpu(1)));
  EXPECT_EQ(serial, render(triangles, Executor::cpu(2)));
}

TEST(FluxImage, OrderOfTrianglesDoesNotChangeABit) {
  std::vector<ImageTriangle> triangles = random_triangles(30000, 0.0, 5);
  const std::vector<double> before = render(triangles);
  std::shuffle(triangles.begin(), triangles.end(), Random(6).engine());
  EXPECT_EQ(before, render(triangles));
}

TEST(FluxImage, PicturesDoNotDependOnTheOneBefore) {
  FluxImage image(kWide, kHigh);
  const std::vector<ImageTriangle> first = random_triangles(500, 0.0, 7);
  const std::vector<ImageTriangle> second = random_triangles(500, 0.0, 8);
  image.render(Executor::cpu(2), first);
  const auto again = image.render(Executor::serial(), second);
  EXPECT_EQ(std::vector<double>(again.begin(), again.end()), render(second));
}

TEST(FluxImage, NoTrianglesGiveABlackPicture) {
  for (const double value : render({})) ASSERT_EQ(value, 0.0);
}

TEST(FluxImage, OnePixelTakesWhatLandsOnIt) {
  FluxImage image(1, 1);
  const ImageTriangle half_inside{{-1.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}, 1.0};
  EXPECT_NEAR(image.render(Executor::serial(), std::array{half_inside})[0], 0.5, 1e-15);
}

TEST(FluxCotangentImage, SumsRowsFromTheRight) {
  FluxCotangentImage image(5, 3);
  Random random(9);
  for (double& g : image.pixels()) g = random.between(-1.0, 1.0);
  image.prepare(Executor::cpu(2));
  const FluxCotangent view = image.view();
  for (int row = 0; row < 3; ++row) {
    EXPECT_EQ(view.from(row, 5), 0.0);
    for (int column = 0; column < 5; ++column) {
      double sum = 0.0;
      for (int c = column; c < 5; ++c) sum += view.at(row, c);
      EXPECT_NEAR(view.from(row, column), sum, 1e-15);
    }
  }
}

TEST(FluxCotangentImage, IsZeroOutsideThePicture) {
  FluxCotangentImage image(2, 2);
  std::fill(image.pixels().begin(), image.pixels().end(), 1.0);
  image.prepare(Executor::serial());
  for (const auto& [row, column] : {std::pair{-1, 0}, {2, 0}, {0, -1}, {0, 2}}) {
    EXPECT_EQ(image.view().at(row, column), 0.0);
  }
}

constexpr int kColumns = 21;
constexpr int kRows = 17;

OpticalSetup wide_source() {
  OpticalSetup setup = testing::setup_of({21.0, 17.0}, {kColumns, kRows}, 100.0);
  setup.extent.width = 0.03;
  setup.extent.shape = {3, 2, {1.0, 0.0, 2.0, 0.5, 1.0, 4.0}};
  return setup;
}

std::vector<double> random_values(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<double> values(count);
  for (double& value : values) value = random.between(-1.0, 1.0);
  return values;
}

double product(std::span<const double> a, std::span<const double> b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

/// Number of the parts of all pixels.
std::size_t part_count(const SourceKernel& kernel) {
  const auto parts = static_cast<std::size_t>(kernel.parts);
  return parts * parts * kColumns * kRows;
}

TEST(SourceBlur, IsTheSumOfItsDefinition) {
  const SourceKernel kernel = source_kernel(wide_source(), 5.0);
  const int parts = kernel.parts;
  const std::vector<double> in = random_values(part_count(kernel), 1);
  SourceBlurOn<Executor> blur(kernel, kColumns, kRows, Executor::serial());
  const std::span<const double> out = blur.apply(Executor::serial(), in);
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      double sum = 0.0;
      for (int j = 0; j < kernel.rows; ++j) {
        for (int i = 0; i < kernel.columns; ++i) {
          const int y = parts * row + j - kernel.offset_y;
          const int x = parts * column + i - kernel.offset_x;
          if (y < 0 || y >= parts * kRows || x < 0 || x >= parts * kColumns) continue;
          const int weight = j * kernel.columns + i;
          const int place = y * parts * kColumns + x;
          sum += kernel.weights[static_cast<std::size_t>(weight)] *
                 in[static_cast<std::size_t>(place)];
        }
      }
      const int pixel = row * kColumns + column;
      EXPECT_NEAR(out[static_cast<std::size_t>(pixel)], sum, 1e-12);
    }
  }
}

TEST(SourceBlur, TheAdjointIsTheTranspose) {
  const SourceKernel kernel = source_kernel(wide_source(), 5.0);
  SourceBlurOn<Executor> blur(kernel, kColumns, kRows, Executor::serial());
  const std::size_t fine = part_count(kernel);
  const std::vector<double> in = random_values(fine, 2);
  const std::vector<double> bar = random_values(kColumns * kRows, 3);
  const double forward = product(blur.apply(Executor::serial(), in), bar);
  std::copy(bar.begin(), bar.end(), blur.bar().begin());
  std::vector<double> in_bar(fine);
  blur.apply_adjoint(Executor::serial(), in_bar);
  EXPECT_NEAR(product(in, in_bar), forward, 1e-12 * static_cast<double>(fine));
}

TEST(SourceBlur, SameBitsForAnyNumberOfThreads) {
  const SourceKernel kernel = source_kernel(wide_source(), 5.0);
  const std::vector<double> in = random_values(part_count(kernel), 4);
  SourceBlurOn<Executor> one(kernel, kColumns, kRows, Executor::serial());
  SourceBlurOn<Executor> three(kernel, kColumns, kRows, Executor::cpu(3));
  const std::span<const double> a = one.apply(Executor::serial(), in);
  const std::span<const double> b = three.apply(Executor::cpu(3), in);
  EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end()));
}

TEST(SourceBlur, APointOfLightBecomesTheSourcesImageWithItsMoments) {
  const OpticalSetup setup = wide_source();
  const SourceKernel kernel = source_kernel(setup, 5.0);
  SourceBlurOn<Executor> blur(kernel, kColumns, kRows, Executor::serial());
  const auto parts = static_cast<std::size_t>(kernel.parts);
  std::vector<double> in(part_count(kernel), 0.0);
  // All parts of the middle pixel, column 10 and row 8.
  for (std::size_t y = 8 * parts; y < 9 * parts; ++y) {
    for (std::size_t x = 10 * parts; x < 11 * parts; ++x) {
      in[y * kColumns * parts + x] = 1.0 / static_cast<double>(parts * parts);
    }
  }
  const std::span<const double> out = blur.apply(Executor::serial(), in);
  Eigen::Vector2d mean(0.0, 0.0);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const std::size_t row = i / kColumns;
    mean += out[i] * Eigen::Vector2d(static_cast<double>(i % kColumns) - 10.0,
                                     static_cast<double>(row) - 8.0);
  }
  EXPECT_NEAR(std::accumulate(out.begin(), out.end(), 0.0), 1.0, 1e-12);
  Eigen::Vector2d expected(0.0, 0.0);
  for (const SourcePoint& point : source_points(setup.extent, 10000)) {
    expected += point.share * (source_motion(setup, 5.0) * point.at);
  }
  EXPECT_GT(expected.norm(), 0.2);
  EXPECT_LT((mean - expected).norm(), 1e-3);
}

TEST(SourceBlur, WiderImagesAreResolvedInFewerParts) {
  OpticalSetup setup = testing::setup_of({21.0, 17.0}, {kColumns, kRows}, 100.0);
  const auto parts = [&](double pixels) {
    setup.extent.width = 1.0;
    setup.extent.width = pixels / source_blur(setup, 5.0);
    return source_kernel(setup, 5.0).parts;
  };
  EXPECT_EQ(parts(1e-9), 4);
  EXPECT_EQ(parts(3.9), 4);
  EXPECT_EQ(parts(5.0), 3);
  EXPECT_EQ(parts(9.0), 2);
}

TEST(SourceBlur, WithoutASourcesExtentNothingChanges) {
  SourceBlurOn<Executor> blur(source_kernel(OpticalSetup{}, 5.0), 4, 4, Executor::serial());
  EXPECT_TRUE(blur.none());
  EXPECT_EQ(blur.parts(), 1);
}

}  // namespace

}  // namespace lensforge::flux_image_test
