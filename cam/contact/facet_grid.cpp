// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/facet_grid.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <string>

#include "core/error.h"

namespace lensforge {
namespace {

template <class Action>
void for_each_cell(const Eigen::Vector2i& low, const Eigen::Vector2i& high, int columns,
                   const Action& action) {
  for (int row = low.y(); row <= high.y(); ++row) {
    for (int column = low.x(); column <= high.x(); ++column) {
      action(static_cast<std::size_t>(std::int64_t{row} * columns + column));
    }
  }
}

}  // namespace

FacetGrid::FacetGrid(const SurfaceMesh& mesh) : mesh_(mesh) {
  LF_CHECK(mesh.triangle_count() > 0, std::to_string(mesh.triangle_count()));
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) box_.extend(box_of(t));
  const double side =
      std::max(std::sqrt(2.0 * box_.volume() / static_cast<double>(mesh.triangle_count())),
               box_.sizes().maxCoeff() / 1e6);
  cells_ = (box_.sizes() / side).array().ceil().cast<int>().max(1);
  begin_.assign(static_cast<std::size_t>(std::int64_t{cells_.x()} * cells_.y()) + 1, 0);
  const auto for_each = [&](const auto& action) {
    for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
      const Eigen::AlignedBox2d box = box_of(t);
      for_each_cell(cell_at(box.min()), cell_at(box.max()), cells_.x(),
                    [&](std::size_t cell) { action(cell, static_cast<std::int32_t>(t)); });
    }
  };
  for_each([&](std::size_t cell, std::int32_t) { ++begin_[cell + 1]; });
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  triangles_.resize(static_cast<std::size_t>(begin_.back()));
  std::vector<std::int64_t> next(begin_.begin(), begin_.end() - 1);
  for_each([&](std::size_t cell, std::int32_t t) {
    triangles_[static_cast<std::size_t>(next[cell]++)] = t;
  });
}

Eigen::AlignedBox2d FacetGrid::box_of(std::int64_t triangle) const {
  Eigen::AlignedBox2d box;
  for (int k = 0; k < 3; ++k) box.extend(Eigen::Vector2d(mesh_.corner(triangle, k).head<2>()));
  const Eigen::Vector2d rim(kRim, kRim);
  return {box.min() - rim, box.max() + rim};
}

Eigen::Vector2i FacetGrid::cell_at(const Eigen::Vector2d& xy) const {
  const Eigen::Array2d share = (xy - box_.min()).array() / box_.sizes().array();
  const Eigen::Array2d cell = (share * cells_.array().cast<double>()).floor();
  return cell.max(0.0).min(cells_.array().cast<double>() - 1.0).cast<int>();
}

std::vector<std::int32_t> FacetGrid::near(const Eigen::AlignedBox2d& box) const {
  std::vector<std::int32_t> found;
  for_each_cell(cell_at(box.min()), cell_at(box.max()), cells_.x(), [&](std::size_t cell) {
    found.insert(found.end(), triangles_.begin() + begin_[cell],
                 triangles_.begin() + begin_[cell + 1]);
  });
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  std::erase_if(found, [&](std::int32_t t) { return !box_of(t).intersects(box); });
  return found;
}

}  // namespace lensforge
