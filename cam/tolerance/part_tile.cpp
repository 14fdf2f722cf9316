// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/part_tile.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cam/leakage/surface_tile.h"
#include "cam/milled/polished_field.h"
#include "core/surface/corners.h"
#include "design/optics/image_triangle.h"

namespace lensforge {
namespace {

/// Between four nodes a period, as many as a ripple has (PartModel), linear interpolation leaves
/// sinc²(1/4) of a sine's amplitude; this makes up for it.
constexpr double kRippleGain = 0.125 * std::numbers::pi * std::numbers::pi;

/// Pixels a millimetre of the part, below which its light is all in one place.
constexpr double kLeastScale = 1e-6;

/// The cell that a node lies in: node −1 lies in cell −1.
std::int64_t cell_of(std::int64_t node, std::int64_t parts) {
  return node >= 0 ? node / parts : -((-node + parts - 1) / parts);
}

/// out[n] = Σ weight[k] (in[n − k step] + in[n + (k + shift) step]) for n = 0 … count − 1.
void average(const double* in, std::int64_t step, const LineFilter& filter, std::int64_t count,
             double* out) {
  std::fill(out, out + count, 0.0);
  for (std::int64_t k = 0; k <= filter.reach(); ++k) {
    const double weight = filter.average[static_cast<std::size_t>(k)];
    const double* const before = in - k * step;
    const double* const after = in + (k + filter.shift) * step;
    for (std::int64_t n = 0; n < count; ++n) out[n] += weight * (before[n] + after[n]);
  }
}

/// The same with the difference of both sides.
void differentiate(const double* in, std::int64_t step, const LineFilter& filter,
                   std::int64_t count, double* out) {
  std::fill(out, out + count, 0.0);
  for (std::int64_t k = 0; k <= filter.reach(); ++k) {
    const double weight = filter.slope[static_cast<std::size_t>(k)];
    const double* const before = in - k * step;
    const double* const after = in + (k + filter.shift) * step;
    for (std::int64_t n = 0; n < count; ++n) out[n] += weight * (after[n] - before[n]);
  }
}

}  // namespace

PartTile::PartTile(const PartScene& scene, const CellRange& cells)
    : scene_(scene), cells_(cells), x_(nodes_of(0)), y_(nodes_of(1)) {
  polish();
  if (scene_.polish.rim_depth > 0.0) take_off_rim();
  land();
  sharpen();
  for (int axis = 0; axis < 2; ++axis) {
    if (scene_.axes[static_cast<std::size_t>(axis)].ripples) add_ripple(axis);
  }
}

PartTile::Nodes PartTile::nodes_of(int axis) const {
  const SceneAxis& scene = scene_.axes[static_cast<std::size_t>(axis)];
  const std::int64_t from = axis == 0 ? cells_.column : cells_.row;
  const std::int64_t cells = axis == 0 ? cells_.columns : cells_.rows;
  const std::int64_t reach = scene.filters.front().reach();
  Nodes nodes{};
  nodes.parts = scene.parts();
  nodes.first = nodes.parts * from - 1;
  nodes.count = nodes.parts * cells + 3;
  nodes.base = cell_of(nodes.first, nodes.parts) - reach;
  // Behind the last node's cell there is one more base where filters lie between nodes.
  const std::int64_t last =
      cell_of(nodes.first + nodes.count - 1, nodes.parts) + scene.filters.back().shift + reach;
  nodes.bases = last - nodes.base + 1;
  nodes.spacing = scene_.base.axis(axis).spacing / static_cast<double>(nodes.parts);
  return nodes;
}

const LineFilter& PartTile::filter_of(const SceneAxis& axis, std::int64_t node) {
  const std::int64_t part = node - axis.parts() * cell_of(node, axis.parts());
  return axis.filters[static_cast<std::size_t>(part)];
}

/// One row of the base along x. Nodes of one part of their cells lie in a row of their own first.
void PartTile::polish_line(const double* raw, double* heights, double* slopes) const {
  std::vector<double> line(static_cast<std::size_t>(2 * x_.bases));
  for (std::int64_t first = 0; first < x_.parts; ++first) {
    const std::int64_t node = x_.first + first;
    const LineFilter& filter = filter_of(scene_.axes[0], node);
    const double* const in = raw + cell_of(node, x_.parts) - x_.base;
    const std::int64_t count = (x_.count - first + x_.parts - 1) / x_.parts;
    double* const means = line.data();
    double* const rises = means + x_.bases;
    average(in, 1, filter, count, means);
    differentiate(in, 1, filter, count, rises);
    for (std::int64_t n = 0; n < count; ++n) {
      heights[first + n * x_.parts] = means[n];
      slopes[first + n * x_.parts] = rises[n];
    }
  }
}

void PartTile::polish() {
  std::vector<double> raw(static_cast<std::size_t>(x_.bases * y_.bases));
  scene_.heights.fill({x_.base, y_.base, x_.bases, y_.bases}, raw.data());
  std::vector<double> heights(static_cast<std::size_t>(x_.count * y_.bases));
  std::vector<double> slopes(heights.size());
  for (std::int64_t j = 0; j < y_.bases; ++j) {
    polish_line(&raw[static_cast<std::size_t>(j * x_.bases)], &heights[index(0, j)],
                &slopes[index(0, j)]);
  }
  const auto nodes = static_cast<std::size_t>(x_.count * y_.count);
  z_.resize(nodes);
  slope_x_.resize(nodes);
  slope_y_.resize(nodes);
  for (std::int64_t j = 0; j < y_.count; ++j) {
    const LineFilter& filter = filter_of(scene_.axes[1], y_.first + j);
    const std::size_t from = index(0, cell_of(y_.first + j, y_.parts) - y_.base);
    average(&heights[from], x_.count, filter, x_.count, &z_[index(0, j)]);
    average(&slopes[from], x_.count, filter, x_.count, &slope_x_[index(0, j)]);
    differentiate(&heights[from], x_.count, filter, x_.count, &slope_y_[index(0, j)]);
  }
}

Eigen::Vector2d PartTile::place(std::int64_t i, std::int64_t j) const {
  return {static_cast<double>(x_.first + i) * x_.spacing,
          static_cast<double>(y_.first + j) * y_.spacing};
}

void PartTile::take_off_rim() {
  const PolishModel& model = scene_.polish;
  for (std::int64_t j = 0; j < y_.count; ++j) {
    for (std::int64_t i = 0; i < x_.count; ++i) {
      const Eigen::Vector2d at = place(i, j);
      const std::size_t n = index(i, j);
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
  for (std::int64_t j = 0; j < y_.count; ++j) {
    for (std::int64_t i = 0; i < x_.count; ++i) {
      const std::size_t n = index(i, j);
      points_[n] = scene_.light.grown(place(i, j), z_[n]);
      landing_[n] = scene_.light.land(points_[n], {slope_x_[n], slope_y_[n]}) + margin;
    }
  }
}

void PartTile::sharpen() {
  std::vector<Eigen::Vector2d> sharp = landing_;
  for (std::int64_t j = 1; j + 1 < y_.count; ++j) {
    for (std::int64_t i = 1; i + 1 < x_.count; ++i) {
      const std::size_t n = index(i, j);
      sharp[n] = sharp_landing(landing_, n, x_.count);
    }
  }
  landing_.swap(sharp);
}

/// How strongly the ripple is polished and how far a slope moves light hardly changes over a tile:
/// both are taken in its middle.
void PartTile::add_ripple(int axis) {
  const std::size_t middle = index(x_.count / 2, y_.count / 2);
  const Eigen::Vector2d moved =
      scene_.light.moved_by(points_[middle], {slope_x_[middle], slope_y_[middle]}, axis);
  if (!moved.allFinite()) return;
  const double factor =
      scene_.heights.sigma_factor(cells_.column + cells_.columns / 2, cells_.row + cells_.rows / 2);
  const Eigen::Vector2d step =
      kRippleGain * scene_.ripple.kept(factor) * seen_by_source(axis) * moved;
  for (std::int64_t j = 0; j < y_.count; ++j) {
    for (std::int64_t i = 0; i < x_.count; ++i) {
      const std::size_t n = index(i, j);
      landing_[n] +=
          scene_.ripple.slope(place(i, j)[axis], {slope_x_[n], slope_y_[n]}, axis) * step;
    }
  }
}

/// What a source leaves of the light that a ripple moves over a pixel's border: from every
/// direction of its disc the border lies at another place of the ripple. What is left is a blur
/// (PartModel).
double PartTile::seen_by_source(int axis) const {
  const std::size_t low = index(0, 0);
  const std::size_t high = axis == 0 ? index(x_.count - 1, 0) : index(0, y_.count - 1);
  const double length = axis == 0 ? static_cast<double>(x_.count - 1) * x_.spacing
                                  : static_cast<double>(y_.count - 1) * y_.spacing;
  const double pixels_per_mm = std::abs((landing_[high] - landing_[low])[axis]) / length;
  return scene_.ripple.seen_by_disc(scene_.source[axis] / std::max(pixels_per_mm, kLeastScale));
}

double PartTile::flux_of(std::size_t a, std::size_t b, std::size_t c) const {
  return scene_.light.intake({points_[a], points_[b], points_[c]}) / scene_.whole;
}

void PartTile::deposit(const FluxAccumulator& image) const {
  const auto up = static_cast<std::size_t>(x_.count);
  for (std::int64_t j = 1; j + 2 < y_.count; ++j) {
    for (std::int64_t i = 1; i + 2 < x_.count; ++i) {
      const std::size_t a = index(i, j);
      const std::size_t c = a + up + 1;
      lensforge::deposit({landing_[a], landing_[a + 1], landing_[c], flux_of(a, a + 1, c)}, image);
      lensforge::deposit({landing_[a], landing_[c], landing_[a + up], flux_of(a, c, a + up)},
                         image);
    }
  }
}

}  // namespace lensforge
