// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "design/mpi/rank_executor.h"
#include "design/mpi/rank_test.h"
#include "design/random_input.h"

namespace lensforge {
namespace {

/// A rank's coefficients and values, there and back, beside those of one process.
void expect_transforms(const GridShape& grid) {
  CosineTransform whole(grid.columns, grid.rows);
  testing::Random random(5);
  std::vector<double> values(whole.values().size());
  for (double& value : values) value = random.between(-1.0, 1.0);
  std::copy(values.begin(), values.end(), whole.values().begin());
  RankTransforms shared(grid, Ranks::world(), Executor::serial());
  const ItemRange rows = shared.rows();
  for (int k = 0; k < 3; ++k) {
    std::copy(values.begin() + rows.begin * grid.columns, values.begin() + rows.end * grid.columns,
              shared.plane(k));
  }
  whole.run();
  shared.forward();
  const ItemRange columns = shared.columns();
  for (std::int64_t c = columns.begin; c < columns.end; ++c) {
    for (std::int64_t r = 0; r < grid.rows; ++r) {
      const double expected = whole.values()[static_cast<std::size_t>(r * grid.columns + c)];
      const double found = shared.plane(2)[(c - columns.begin) * grid.rows + r];
      ASSERT_EQ(found, expected) << "column " << c << ", row " << r;
    }
  }
  shared.backward();
  whole.run();
  for (std::int64_t i = 0; i < rows.count() * grid.columns; ++i) {
    ASSERT_EQ(shared.plane(1)[i],
              whole.values()[static_cast<std::size_t>(rows.begin * grid.columns + i)]);
  }
}

TEST(RankTransforms, HaveTheBitsOfTheCosineTransformThereAndBack) {
  expect_transforms({31, 29});
  expect_transforms({64, 17});
  expect_transforms({81, 93});
  expect_transforms({161, 93});
}

TEST(RankTransforms, ServeRanksWithoutColumns) { expect_transforms({3, 40}); }

}  // namespace
}  // namespace lensforge
