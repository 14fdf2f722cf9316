// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "cam/analytic_fields.h"
#include "cam/predict/part_surfaces.h"
#include "core/lens/surface_field.h"

namespace lensforge {
namespace {

const Eigen::Vector2d kSize(30.0, 20.0);

TEST(PartLayers, GridIsEvenAndAsFineAsAsked) {
  const PartGrid grid = part_grid(kSize, {0.01, 0.01}, 6000.0);
  EXPECT_NEAR(grid.nodes.cast<double>().prod(), 6000.0, 300.0);
  for (int axis = 0; axis < 2; ++axis) {
    EXPECT_LE(kSize[axis] / (grid.nodes[axis] - 1) / grid.every[axis], 0.01 * (1.0 + 1e-12));
  }
  // No finer than a polished part needs, nor than what is sampled.
  EXPECT_EQ(part_grid(kSize, {0.5 * kPartSpacing, 0.02}, 1e9).every, Eigen::Vector2i(2, 1));
  EXPECT_EQ(part_grid(kSize, {1.0, 1.0}, 1e6).nodes, Eigen::Vector2i(31, 21));
  EXPECT_EQ(part_grid(kSize, {1.0, 1.0}, 1e6).every, Eigen::Vector2i(1, 1));
}

TEST(PartLayers, EveryNodeHasTheSurfacesHeightTheUppermostFirst) {
  const testing::AnalyticField wave([](const Eigen::Vector2d& p) {
    return testing::SurfacePoint{5.0 + std::sin(p.x()) + 0.1 * p.y(), {std::cos(p.x()), 0.1}, 0};
  });
  const testing::AnalyticField plane(testing::plane({0.2, -0.3}));
  PartLayers part({{"a", &wave}, {"b", &plane}}, kSize, {0.04, 0.04});
  SurfacePatch tile;
  const GridWindow sampled = sampled_grid(kSize, {0.04, 0.04});
  EXPECT_LE(sampled.spacing.maxCoeff(), 0.04 * (1.0 + 1e-12));
  for (const CellRange& cells : tiles_of(all_cells(sampled), 100)) {
    for (const testing::AnalyticField* field : {&wave, &plane}) {
      field->sample(window_of(sampled, cells, 1), Executor::cpu(2), tile);
      part.take(*field, tile, Executor::serial());
    }
  }
  const LayeredImage& layers = part.layers();
  EXPECT_EQ(layers.names().size(), 2U);
  const PartGrid grid = part_grid(kSize, {0.04, 0.04}, kPartNodes);
  ASSERT_EQ(layers.columns(), grid.nodes.x());
  ASSERT_EQ(layers.rows(), grid.nodes.y());
  for (int row = 0; row < layers.rows(); row += 7) {
    for (int column = 0; column < layers.columns(); column += 7) {
      const double x = kSize.x() * column / (layers.columns() - 1);
      const double y = kSize.y() * (1.0 - static_cast<double>(row) / (layers.rows() - 1));
      const auto at = static_cast<std::size_t>(row) * static_cast<std::size_t>(layers.columns()) +
                      static_cast<std::size_t>(column);
      EXPECT_NEAR(layers.layer("a.z")[at], 5.0 + std::sin(x) + 0.1 * y, 1e-6);
      EXPECT_NEAR(layers.layer("b.z")[at], 5.0 + 0.2 * x - 0.3 * y, 1e-6);
    }
  }
}

}  // namespace
}  // namespace lensforge
