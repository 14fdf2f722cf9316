// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/cast_field.h"

#include <algorithm>
#include <cstddef>

namespace lensforge {
namespace {

/// The mould's nodes under a window of the lens: mirrored along x, so that columns count down.
GridWindow under(const GridWindow& lens, const CastFrame& frame) {
  GridWindow mould = lens;
  mould.origin = frame.scale * Eigen::Vector2d(frame.width - lens.origin.x(), lens.origin.y());
  mould.spacing = frame.scale * lens.spacing;
  mould.first_column = -(lens.first_column + lens.columns - 1);
  return mould;
}

template <class Value>
void mirror_rows(const GridWindow& window, std::vector<Value>& values) {
  const auto columns = static_cast<std::ptrdiff_t>(window.columns);
  for (auto row = values.begin(); row != values.end(); row += columns) {
    std::reverse(row, row + columns);
  }
}

}  // namespace

void CastField::sample(const GridWindow& window, const Executor& executor,
                       SurfacePatch& patch) const {
  mould_.sample(under(window, frame_), executor, patch);
  patch.window = window;
  for (std::vector<double>* values :
       {&patch.z, &patch.slope_x, &patch.slope_y, &patch.depth, &patch.width}) {
    mirror_rows(window, *values);
  }
  mirror_rows(window, patch.cut);
  // z = top − (Z − thickness) / scale with X = scale (width − x), Y = scale y: the slope along x
  // changes its sign twice.
  for (double& z : patch.z) z = frame_.top - (z - frame_.thickness) / frame_.scale;
  for (double& slope : patch.slope_y) slope = -slope;
  for (double& depth : patch.depth) depth /= frame_.scale;
  for (double& width : patch.width) width /= frame_.scale;
}

}  // namespace lensforge
