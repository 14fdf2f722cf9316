// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>

#include "core/mesh/surface_mesh.h"
#include "core/optics/front.h"

namespace lensforge::testing {

/// A map of columns × rows samples of a function of (x, y) over a lens of this size.
template <class Height>
HeightGrid sampled_heights(const Eigen::Vector2d& size, const GridShape& shape, const Height& h) {
  HeightGrid grid{shape.columns, shape.rows, {}};
  for (int row = shape.rows - 1; row >= 0; --row) {
    for (int column = 0; column < shape.columns; ++column) {
      const Eigen::Vector2d at(size.x() * column / (shape.columns - 1),
                               size.y() * row / (shape.rows - 1));
      grid.heights.push_back(static_cast<float>(h(at)));
    }
  }
  return grid;
}

template <class Height>
HeightFront height_front(const Eigen::Vector2d& size, const GridShape& shape, const Height& h) {
  return {std::make_shared<HeightSpline>(sampled_heights(size, shape, h)), size};
}

}  // namespace lensforge::testing
