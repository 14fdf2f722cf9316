// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cstring>
#include <span>
#include <vector>

#include "design/flux/flux_image.h"
#include "design/mpi/rank_executor.h"
#include "design/mpi/rank_test.h"
#include "design/render/render_flux.h"

namespace lensforge {
namespace {

/// Shares of a surface's image triangles go into one picture.
class PictureOnRanks : public ::testing::TestWithParam<int> {
 protected:
  /// @return the rows of the picture that this rank looks at, and in `rows` which.
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
