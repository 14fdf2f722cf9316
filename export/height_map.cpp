// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/height_map.h"

#include <algorithm>
#include <cmath>

#include "core/image_io.h"
#include "core/transfer.h"

namespace lensforge {

Image height_map(const SmoothSurface& surface, int longer_side, const Executor& executor) {
  const Eigen::Vector2d size = surface.box().sizes();
  const double pixel = size.maxCoeff() / longer_side;
  const int columns = std::max(1, static_cast<int>(std::lround(size.x() / pixel)));
  const int rows = std::max(1, static_cast<int>(std::lround(size.y() / pixel)));
  Image image(columns, rows);
  parallel_for(executor, "height map", std::int64_t{columns} * rows, [&](std::int64_t i) {
    const std::int64_t column = i % columns;
    const std::int64_t row = i / columns;
    const Eigen::Array2d share((static_cast<double>(column) + 0.5) / columns,
                               1.0 - (static_cast<double>(row) + 0.5) / rows);
    const auto point = surface.at(surface.box().min() + (share * size.array()).matrix());
    if (point) image.values()[static_cast<std::size_t>(i)] = static_cast<float>(point->z);
  });
  return image;
}

GreyScale write_grey_relief(const Image& heights, const std::filesystem::path& path) {
  const auto [low, high] = std::minmax_element(heights.values().begin(), heights.values().end());
  const double range = std::max(double{*high} - *low, 1e-12);
  Image relief(heights.columns(), heights.rows());
  // write_image() stores the encoded value: decoded beforehand, the file's numbers are linear.
  for (std::size_t i = 0; i < relief.values().size(); ++i) {
    relief.values()[i] = static_cast<float>(decode((heights.values()[i] - *low) / range));
  }
  write_image(relief, path);
  return {*low, *high};
}

}  // namespace lensforge
