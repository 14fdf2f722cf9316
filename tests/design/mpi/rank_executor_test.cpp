// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/mpi/rank_executor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <vector>

#include "design/flux/flux_image.h"
#include "design/mpi/rank_test.h"
#include "design/random_input.h"
#include "design/render/render_flux.h"

namespace lensforge {
namespace {

/// Compares a rank's coefficients and values, forward and back, with those of one process.
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

/// Draws shares of a surface's image triangles into one picture.
class PictureOnRanks : public ::testing::TestWithParam<int> {
 protected:
  /// @return the pixels of the rows that this rank uses; `rows` receives their numbers.
  static std::vector<double> shared(const std::vector<ImageTriangle>& triangles,
                                    const SharedPicture& picture, ItemRange& rows) {
    const Ranks ranks = Ranks::world();
    const RowSlab slab(testing::kShape, ranks.count(), ranks.rank());
    const RankExecutor executor(Executor::cpu(GetParam()), ranks, slab, picture, {});
    const ItemRange held = slab.held_faces();
    FluxImageOn<RankExecutor> image(kColumns, kRows);
    const auto flux = image.render(
        executor, std::span(triangles).subspan(static_cast<std::size_t>(held.begin),
                                               static_cast<std::size_t>(held.count())));
    rows = executor.shares_pixels() ? executor.seen_rows() : ItemRange{0, kRows};
    return {flux.begin() + rows.begin * kColumns, flux.begin() + rows.end * kColumns};
  }

  static void expect_same_bits(const SharedPicture& picture) {
    for (const SurfaceModel model : testing::kModels) {
      const std::vector<ImageTriangle> triangles =
          project_surface(testing::rough_mesh(), testing::kSetup, model, Executor::serial());
      FluxImage image(kColumns, kRows);
      const auto whole = image.render(Executor::serial(), triangles);
      ItemRange rows;
      const std::vector<double> found = shared(triangles, picture, rows);
      EXPECT_EQ(std::memcmp(found.data(), whole.data() + rows.begin * kColumns,
                            found.size() * sizeof(double)),
                0)
          << model_name(model);
    }
  }

  static constexpr int kColumns = 24;
  static constexpr int kRows = 20;
};

INSTANTIATE_TEST_SUITE_P(Threads, PictureOnRanks, ::testing::Values(1, 2));

TEST_P(PictureOnRanks, HasTheBitsOfOneProcess) { expect_same_bits({}); }

TEST_P(PictureOnRanks, HasThemInTheRowsOfEachRank) { expect_same_bits({kColumns, kRows}); }

}  // namespace

}  // namespace lensforge
