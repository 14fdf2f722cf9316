// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/mpi/ranks.h"

#include <gtest/gtest.h>

#include "core/mesh/surface_mesh.h"
#include "design/mpi/rank_test.h"

namespace lensforge {
namespace {

TEST(SetupParcel, KeepsEverySetup) {
  for (const testing::NamedSetup& kind : testing::all_setups()) {
    Parcel parcel;
    put_setup(kind.setup, parcel);
    EXPECT_TRUE(take_setup(parcel) == kind.setup) << kind.name;
  }
  OpticalSetup setup;
  setup.extent = {0.5, {2, 3, {0.0, 1.0, 2.0, 0.5, 0.25, 4.0}}};
  setup.outline = polygon_outline(setup.lens_size, {{0.0, 0.0}, {3.0, 0.0}, {1.0, 2.0}});
  Parcel parcel;
  put_setup(setup, parcel);
  EXPECT_TRUE(take_setup(parcel) == setup);
}

TEST(RowSlab, EveryRowAndFaceIsOwnedOnce) {
  const GridShape grid{5, 23};
  for (const int ranks : {1, 2, 3, 5}) {
    std::int64_t vertices = 0;
    std::int64_t faces = 0;
    for (int r = 0; r < ranks; ++r) {
      const RowSlab slab(grid, ranks, r);
      EXPECT_EQ(slab.own_vertices().begin, vertices);
      EXPECT_EQ(slab.own_faces().begin, faces);
      vertices = slab.own_vertices().end;
      faces = slab.own_faces().end;
      EXPECT_LE(slab.held_vertices().begin, slab.own_vertices().begin);
      EXPECT_LE(slab.own_faces_here().end, slab.held_faces().count());
    }
    EXPECT_EQ(vertices, 5 * 23);
    EXPECT_EQ(faces, 2 * 4 * 22);
  }
}

/// Every item is in exactly one part; a block is whole on the rank that has its last item, or
/// joined there.
TEST(BlockShare, PartsCoverTheItemsInOrder) {
  for (const std::int64_t total : {1, 7, 40, 41}) {
    for (int ranks = 1; ranks <= 9; ++ranks) {
      for (int r = 0; r < ranks; ++r) {
        const ItemRange own = even_share(total, ranks, r);
        const BlockShare share(own, 8, total);
        EXPECT_EQ(share.head.begin, own.begin);
        EXPECT_EQ(share.head.end, share.whole.begin);
        EXPECT_EQ(share.whole.end, share.tail.begin);
        EXPECT_EQ(share.tail.end, own.end);
        const auto ends = [&](std::int64_t item) { return item % 8 == 0 || item == total; };
        EXPECT_TRUE(share.head.count() == 0 || (!ends(own.begin) && ends(share.head.end)));
        EXPECT_TRUE(share.whole.count() == 0 ||
                    (share.whole.begin % 8 == 0 && ends(share.whole.end)));
        EXPECT_TRUE(share.tail.count() == 0 || !ends(own.end));
        EXPECT_LT(share.tail.count(), 8);
      }
    }
  }
}

TEST(RowSlab, GridMeshesLieRowByRow) {
  SurfaceMesh mesh = make_grid_mesh({10.0, 10.0}, {9, 8}, 1.0);
  EXPECT_TRUE(has_row_order(mesh));
  mesh.triangles.col(0).swap(mesh.triangles.col(100));
  EXPECT_FALSE(has_row_order(mesh));
}

}  // namespace
}  // namespace lensforge
