// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <vector>

#include "core/optics/light_source.h"
#include "design/flux/flux_image.h"
#include "design/random_input.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

using testing::Random;

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

TEST(SourceBlur, IsTheSumOfItsDefinition) {
  const SourceKernel kernel = source_kernel(wide_source(), 5.0);
  const int parts = kernel.parts;
  const std::vector<double> in = random_values(kColumns * kRows * parts * parts, 1);
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
          sum += kernel.weights[static_cast<std::size_t>(j * kernel.columns + i)] *
                 in[static_cast<std::size_t>(y * parts * kColumns + x)];
        }
      }
      EXPECT_NEAR(out[static_cast<std::size_t>(row * kColumns + column)], sum, 1e-12);
    }
  }
}

TEST(SourceBlur, TheAdjointIsTheTranspose) {
  const SourceKernel kernel = source_kernel(wide_source(), 5.0);
  SourceBlurOn<Executor> blur(kernel, kColumns, kRows, Executor::serial());
  const auto fine = static_cast<std::size_t>(kColumns * kRows * kernel.parts * kernel.parts);
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
  const std::vector<double> in =
      random_values(static_cast<std::size_t>(kColumns * kRows * kernel.parts * kernel.parts), 4);
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
  const auto width = static_cast<std::size_t>(kColumns * kernel.parts);
  std::vector<double> in(width * static_cast<std::size_t>(kRows * kernel.parts), 0.0);
  // The four parts of the middle pixel.
  for (const std::size_t y : {16U, 17U}) {
    for (const std::size_t x : {20U, 21U}) in[y * width + x] = 0.25;
  }
  const std::span<const double> out = blur.apply(Executor::serial(), in);
  Eigen::Vector2d mean(0.0, 0.0);
  for (std::size_t i = 0; i < out.size(); ++i) {
    mean += out[i] * Eigen::Vector2d(static_cast<double>(i % kColumns) - 10.0,
                                     static_cast<double>(i / kColumns) - 8.0);
  }
  EXPECT_NEAR(std::accumulate(out.begin(), out.end(), 0.0), 1.0, 1e-12);
  Eigen::Vector2d expected(0.0, 0.0);
  for (const SourcePoint& point : source_points(setup.extent, 10000)) {
    expected += point.share * (source_motion(setup, 5.0) * point.at);
  }
  EXPECT_GT(expected.norm(), 0.2);
  EXPECT_LT((mean - expected).norm(), 1e-3);
}

TEST(SourceBlur, WithoutASourcesExtentNothingChanges) {
  SourceBlurOn<Executor> blur(source_kernel(OpticalSetup{}, 5.0), 4, 4, Executor::serial());
  EXPECT_TRUE(blur.none());
  EXPECT_EQ(blur.parts(), 1);
}

}  // namespace
}  // namespace lensforge
