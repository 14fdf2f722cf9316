// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/part_tile.h"

#include <algorithm>

#include "cam/milled/rim_loss.h"
#include "core/surface/corners.h"
#include "design/optics/image_triangle.h"

namespace lensforge {
namespace {

/// out[n] = Σ weight[k] (in[n + k step] + in[n − k step]) for n = 0 … count − 1.
void average(const double* in, std::int64_t step, const LineFilter& filter, std::int64_t count,
             double* out) {
  for (std::int64_t n = 0; n < count; ++n) out[n] = filter.average[0] * in[n];
  for (std::int64_t k = 1; k <= filter.reach(); ++k) {
    const double weight = filter.average[static_cast<std::size_t>(k)];
    const double* const before = in - k * step;
    const double* const after = in + k * step;
    for (std::int64_t n = 0; n < count; ++n) out[n] += weight * (before[n] + after[n]);
  }
}

/// The same with the difference of both sides.
void differentiate(const double* in, std::int64_t step, const LineFilter& filter,
                   std::int64_t count, double* out) {
  std::fill(out, out + count, 0.0);
  for (std::int64_t k = 1; k <= filter.reach(); ++k) {
    const double weight = filter.slope[static_cast<std::size_t>(k)];
    const double* const before = in - k * step;
    const double* const after = in + k * step;
    for (std::int64_t n = 0; n < count; ++n) out[n] += weight * (after[n] - before[n]);
  }
}

}  // namespace

PartTile::PartTile(const PartScene& scene, const CellRange& cells)
    : scene_(scene), cells_(cells), columns_(cells.columns + 3), rows_(cells.rows + 3) {
  polish();
  if (scene_.polish.rim_depth > 0.0) take_off_rim();
  land();
  sharpen();
}

void PartTile::polish() {
  const std::int64_t reach_x = scene_.filter[0].reach();
  const std::int64_t reach_y = scene_.filter[1].reach();
  const std::int64_t wide = columns_ + 2 * reach_x;
  const std::int64_t high = rows_ + 2 * reach_y;
  std::vector<double> raw(static_cast<std::size_t>(wide * high));
  scene_.heights.fill({cells_.column - 1 - reach_x, cells_.row - 1 - reach_y, wide, high},
                      raw.data());
  std::vector<double> heights(static_cast<std::size_t>(columns_ * high));
  std::vector<double> slopes(heights.size());
  for (std::int64_t j = 0; j < high; ++j) {
    const double* const in = &raw[static_cast<std::size_t>(j * wide + reach_x)];
    average(in, 1, scene_.filter[0], columns_, &heights[static_cast<std::size_t>(j * columns_)]);
    differentiate(in, 1, scene_.filter[0], columns_,
                  &slopes[static_cast<std::size_t>(j * columns_)]);
  }
  const auto nodes = static_cast<std::size_t>(columns_ * rows_);
  z_.resize(nodes);
  slope_x_.resize(nodes);
  slope_y_.resize(nodes);
  for (std::int64_t j = 0; j < rows_; ++j) {
    const auto from = static_cast<std::size_t>((j + reach_y) * columns_);
    const auto to = static_cast<std::size_t>(j * columns_);
    average(&heights[from], columns_, scene_.filter[1], columns_, &z_[to]);
    average(&slopes[from], columns_, scene_.filter[1], columns_, &slope_x_[to]);
    differentiate(&heights[from], columns_, scene_.filter[1], columns_, &slope_y_[to]);
  }
}

Eigen::Vector2d PartTile::place(std::int64_t i, std::int64_t j) const {
  return {static_cast<double>(cells_.column - 1 + i) * scene_.base.axis(0).spacing,
          static_cast<double>(cells_.row - 1 + j) * scene_.base.axis(1).spacing};
}

void PartTile::take_off_rim() {
  const PolishModel& model = scene_.polish;
  for (std::int64_t j = 0; j < rows_; ++j) {
    for (std::int64_t i = 0; i < columns_; ++i) {
      const Eigen::Vector2d at = place(i, j);
      const auto n = static_cast<std::size_t>(j * columns_ + i);
      const double left = rim_loss(model, at.x());
      const double right = rim_loss(model, scene_.lens_size.x() - at.x());
      const double low = rim_loss(model, at.y());
      const double high = rim_loss(model, scene_.lens_size.y() - at.y());
      z_[n] -= left + right + low + high;
      slope_x_[n] += (left - right) / model.rim_length;
      slope_y_[n] += (low - high) / model.rim_length;
    }
  }
}

void PartTile::land() {
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(static_cast<double>(scene_.margin));
  points_.resize(z_.size());
  landing_.resize(z_.size());
  for (std::int64_t j = 0; j < rows_; ++j) {
    for (std::int64_t i = 0; i < columns_; ++i) {
      const auto n = static_cast<std::size_t>(j * columns_ + i);
      points_[n] = scene_.light.grown(place(i, j), z_[n]);
      landing_[n] = scene_.light.land(points_[n], {slope_x_[n], slope_y_[n]}) + margin;
    }
  }
}

/// As SurfaceTile::sharpen_landing().
void PartTile::sharpen() {
  std::vector<Eigen::Vector2d> sharp = landing_;
  for (std::int64_t j = 1; j + 1 < rows_; ++j) {
    for (std::int64_t i = 1; i + 1 < columns_; ++i) {
      const auto n = static_cast<std::size_t>(j * columns_ + i);
      const auto up = static_cast<std::size_t>(columns_);
      const Eigen::Vector2d bends = landing_[n - 1] + landing_[n + 1] + landing_[n - up] +
                                    landing_[n + up] + landing_[n - up - 1] + landing_[n + up + 1] -
                                    6.0 * landing_[n];
      if (bends.allFinite()) sharp[n] -= bends / 24.0;
    }
  }
  landing_.swap(sharp);
}

double PartTile::flux_of(std::size_t a, std::size_t b, std::size_t c) const {
  return scene_.light.intake({points_[a], points_[b], points_[c]}) / scene_.light.lens_area();
}

void PartTile::deposit(const FluxAccumulator& image) const {
  const auto up = static_cast<std::size_t>(columns_);
  for (std::int64_t j = 1; j <= cells_.rows; ++j) {
    for (std::int64_t i = 1; i <= cells_.columns; ++i) {
      const auto a = static_cast<std::size_t>(j * columns_ + i);
      const std::size_t c = a + up + 1;
      lensforge::deposit({landing_[a], landing_[a + 1], landing_[c], flux_of(a, a + 1, c)}, image);
      lensforge::deposit({landing_[a], landing_[c], landing_[a + up], flux_of(a, c, a + up)},
                         image);
    }
  }
}

}  // namespace lensforge
