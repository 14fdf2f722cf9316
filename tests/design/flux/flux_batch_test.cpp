// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/flux/flux_batch.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include "design/flux/flux_image.h"
#include "design/random_triangles.h"

namespace lensforge::flux_batch_test {
namespace {

using testing::kColumns;
using testing::kRows;
using testing::Random;

/// Of an ImageTriangle, which has unused bytes after them.
constexpr std::size_t kNumbers = 7;

std::vector<Lanes> all_lanes() {
  std::vector<Lanes> lanes{Lanes::kTwo};
  if (widest_lanes() != Lanes::kTwo) lanes.push_back(widest_lanes());
  return lanes;
}

/// Of every class that triangles are tested with one after the other, needles and those without
/// light or place among them.
std::vector<ImageTriangle> mixed_triangles() {
  std::vector<testing::TriangleClass> classes = testing::generic_classes();
  for (const auto& kind : testing::aligned_classes()) classes.push_back(kind);
  Random random(5);
  std::vector<ImageTriangle> triangles;
  for (int i = 0; i < 400; ++i) {
    for (const testing::TriangleClass& kind : classes) {
      triangles.push_back(next_triangle(kind, random));
    }
    triangles.push_back(testing::triangle_around(random, testing::point_in_picture(random), 0.3));
    triangles.push_back(triangles.back());
    triangles.back().p2 = 0.5 * (triangles.back().p0 + triangles.back().p1);
    triangles.push_back({});
  }
  triangles[7].p1.x() = std::numeric_limits<double>::quiet_NaN();
  triangles[8].p2.y() = std::numeric_limits<double>::infinity();
  return triangles;
}

/// Calls `visit(batch, first, count)` for batches of several lengths.
template <class Visit>
void for_batches(const std::vector<ImageTriangle>& triangles, const Visit& visit) {
  TriangleBatch batch;
  std::size_t first = 0;
  for (int round = 0; first < triangles.size(); ++round) {
    int count = 0;
    const int wanted = round % 3 == 0 ? TriangleBatch::kSize : 1 + round % TriangleBatch::kSize;
    while (count < wanted && first + static_cast<std::size_t>(count) < triangles.size()) {
      batch.set(count, triangles[first + static_cast<std::size_t>(count)]);
      ++count;
    }
    visit(batch, first, count);
    first += static_cast<std::size_t>(count);
  }
}

/// Pictures in which triangles lie in the middle and at borders, and those without 2 × 2 pixels.
struct Size {
  int columns;
  int rows;
};
std::vector<Size> sizes() { return {{kColumns, kRows}, {2, 2}, {1, kRows}, {kColumns, 1}}; }

std::vector<std::int64_t> units_of(const Size& size) {
  return std::vector<std::int64_t>(static_cast<std::size_t>(size.columns + 1) *
                                   static_cast<std::size_t>(size.rows));
}

TEST(FluxBatch, DepositsTheBitsOfSingleTriangles) {
  const std::vector<ImageTriangle> triangles = mixed_triangles();
  for (const Size& size : sizes()) {
    std::vector<std::int64_t> expected = units_of(size);
    const FluxAccumulator image{expected.data(), size.columns, size.rows};
    for (const ImageTriangle& t : triangles) deposit(t, image);
    for (const Lanes lanes : all_lanes()) {
      std::vector<std::int64_t> units = units_of(size);
      for_batches(triangles, [&](const TriangleBatch& batch, std::size_t /*first*/, int count) {
        deposit_batch(batch, count, {units.data(), size.columns, size.rows}, lanes);
      });
      EXPECT_EQ(units, expected) << static_cast<int>(lanes) << " lanes";
    }
  }
}

TEST(FluxBatch, AdjointsHaveTheBitsOfSingleTriangles) {
  const std::vector<ImageTriangle> triangles = mixed_triangles();
  for (const Size& size : sizes()) {
    FluxCotangentImage cotangent(size.columns, size.rows);
    Random random(6);
    for (double& g : cotangent.pixels()) g = random.between(-1.0, 1.0);
    cotangent.prepare(Executor::serial());
    for (const Lanes lanes : all_lanes()) {
      for_batches(triangles, [&](const TriangleBatch& batch, std::size_t first, int count) {
        TriangleBatch bars;
        deposit_adjoint_batch(batch, count, cotangent.view(), bars, lanes);
        for (int i = 0; i < count; ++i) {
          const ImageTriangle bar = bars.at(i);
          const ImageTriangle expected =
              deposit_adjoint(triangles[first + static_cast<std::size_t>(i)], cotangent.view());
          EXPECT_EQ(std::memcmp(&bar, &expected, kNumbers * sizeof(double)), 0)
              << static_cast<int>(lanes) << " lanes, triangle " << first << " + " << i;
        }
      });
    }
  }
}

}  // namespace
}  // namespace lensforge::flux_batch_test
