// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/files/height_map.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/image/color.h"
#include "core/image/image_io.h"

namespace lensforge {

GridShape height_map_shape(const Eigen::Vector2d& size, int longer_side) {
  const double pixel = size.maxCoeff() / longer_side;
  return {std::max(1, static_cast<int>(std::lround(size.x() / pixel))),
          std::max(1, static_cast<int>(std::lround(size.y() / pixel)))};
}

Image height_map(const OpticalSurface& surface, int longer_side, const Executor& executor,
                 const RunControl& control) {
  const Eigen::Vector2d size = surface.box().sizes();
  const GridShape shape = height_map_shape(size, longer_side);
  const int columns = shape.columns;
  const int rows = shape.rows;
  Image image(columns, rows);
  const auto set_height = [&](std::int64_t i) {
    const std::int64_t column = i % columns;
    const std::int64_t row = i / columns;
    const Eigen::Array2d share((static_cast<double>(column) + 0.5) / columns,
                               1.0 - (static_cast<double>(row) + 0.5) / rows);
    const auto point = surface.at(surface.box().min() + (share * size.array()).matrix());
    if (point) image.values()[static_cast<std::size_t>(i)] = static_cast<float>(point->z);
  };
  constexpr std::int64_t kPixelsAtOnce = 1 << 20;  // A look for a stop request every 0.2 s or so.
  const std::int64_t count = std::int64_t{columns} * rows;
  for (std::int64_t first = 0; first < count; first += kPixelsAtOnce) {
    if (control.stop_requested()) throw Interrupted();
    const auto share = static_cast<double>(first);
    control.report({"height map", share, static_cast<double>(count), ""});
    parallel_for(executor, "height map", std::min(kPixelsAtOnce, count - first),
                 [&](std::int64_t i) { set_height(first + i); });
  }
  return image;
}

GreyScale write_grey_relief(const Image& heights, const std::filesystem::path& path,
                            const Executor& executor, const RunControl& control) {
  const auto [low, high] = std::minmax_element(heights.values().begin(), heights.values().end());
  const double black = *low;
  const double range = std::max(double{*high} - *low, 1e-12);
  Image relief(heights.columns(), heights.rows());
  // write_image() stores the encoded value: decoded beforehand, the file's numbers are linear.
  parallel_for(executor.with_stop(control.stop_token()), "grey relief",
               static_cast<std::int64_t>(relief.values().size()), [&](std::int64_t at) {
                 const auto i = static_cast<std::size_t>(at);
                 relief.values()[i] =
                     static_cast<float>(decode((heights.values()[i] - black) / range));
               });
  write_image(relief, path, control);
  return {*low, *high};
}

}  // namespace lensforge
