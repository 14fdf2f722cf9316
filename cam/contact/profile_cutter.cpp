// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/profile_cutter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "cam/contact/profile_contact.h"
#include "core/compute/float_bounds.h"

namespace lensforge {
namespace {

/// Cells per triangle: two triangles a cell keep the pyramid as small as the items.
constexpr double kCellsPerTriangle = 0.5;

std::size_t index_of(std::int64_t value) { return static_cast<std::size_t>(value); }

}  // namespace

/// One tool on its way down. Local coordinates are relative to the lowest corner of the mesh's box.
struct ProfileCutter::Search {
  const CutterProfile& profile;
  Eigen::Vector2d p;
  double x, y;  ///< p, local.
  CutterLocation best{};

  void offer(double tip, std::int32_t triangle) {
    if (tip > best.tip) best = {tip, triangle};
  }

  /// Highest that anything in the box could lift the tip.
  [[nodiscard]] double most(const Node& box) const {
    const double dx = std::max({box.x_min - x, x - box.x_max, 0.0});
    const double dy = std::max({box.y_min - y, y - box.y_max, 0.0});
    return box.z_max - profile.height(std::sqrt(dx * dx + dy * dy));
  }

  /// Where the box's highest point lifts the tip wherever in the box it is.
  [[nodiscard]] double least(const Node& box) const {
    const double dx = std::max(x - box.x_min, box.x_max - x);
    const double dy = std::max(y - box.y_min, box.y_max - y);
    return box.z_max - profile.height(std::sqrt(dx * dx + dy * dy));
  }
};

ProfileCutter::ProfileCutter(const SurfaceMesh& mesh) {
  const std::int64_t count = mesh.triangle_count();
  if (count == 0) return;
  for (std::int64_t t = 0; t < count; ++t) {
    for (int k = 0; k < 3; ++k) bounds_.extend(mesh.corner(t, k));
  }
  const Eigen::Vector2d size = bounds_.sizes().head<2>();
  const double cells = kCellsPerTriangle * static_cast<double>(count) + 1.0;
  const double cell = std::max(std::sqrt(size.prod() / cells), size.maxCoeff() / cells);
  sort_into_cells(mesh, cell > 0.0 ? cell : 1.0);
  build_pyramid();
}

/// Counting sort of the triangles by the cell of their boxes' centres.
void ProfileCutter::sort_into_cells(const SurfaceMesh& mesh, double cell) {
  const auto count = index_of(mesh.triangle_count());
  const Eigen::Vector3d size = bounds_.sizes();
  Level cells{static_cast<int>(size.x() / cell) + 1, static_cast<int>(size.y() / cell) + 1, {}};
  begin_.assign(index_of(cells.columns) * index_of(cells.rows) + 1, 0);
  std::vector<std::size_t> cell_of(count);
  for (std::size_t t = 0; t < count; ++t) {
    Eigen::AlignedBox3d box;
    for (int k = 0; k < 3; ++k) box.extend(mesh.corner(static_cast<std::int64_t>(t), k));
    const Eigen::Vector3d centre = box.center() - bounds_.min();
    const int column = std::min(static_cast<int>(centre.x() / cell), cells.columns - 1);
    const int row = std::min(static_cast<int>(centre.y() / cell), cells.rows - 1);
    cell_of[t] = index_of(row) * index_of(cells.columns) + index_of(column);
    ++begin_[cell_of[t] + 1];
  }
  for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
  std::vector<std::int64_t> next(begin_.begin(), begin_.end() - 1);
  boxes_.resize(count);
  corners_.resize(count);
  triangle_of_.resize(count);
  item_of_.resize(count);
  for (std::size_t t = 0; t < count; ++t) {
    const auto item = index_of(next[cell_of[t]]++);
    const auto triangle = static_cast<std::int64_t>(t);
    Eigen::Matrix3d& corners = corners_[item];
    corners << mesh.corner(triangle, 0), mesh.corner(triangle, 1), mesh.corner(triangle, 2);
    const Eigen::Vector3d low = corners.rowwise().minCoeff() - bounds_.min();
    const Eigen::Vector3d high = corners.rowwise().maxCoeff() - bounds_.min();
    boxes_[item] = {
        float_below(low.x()),  float_above(high.x()),           float_below(low.y()),
        float_above(high.y()), static_cast<std::int32_t>(item), corners.row(2).maxCoeff()};
    triangle_of_[item] = static_cast<std::int32_t>(t);
    item_of_[t] = static_cast<std::int32_t>(item);
  }
  levels_.push_back(std::move(cells));
}

void ProfileCutter::build_pyramid() {
  constexpr float kFar = std::numeric_limits<float>::infinity();
  constexpr Node kEmpty{kFar, -kFar, kFar, -kFar, -1, kNoContact};
  const auto include = [](Node& all, const Node& one) {
    all.x_min = std::min(all.x_min, one.x_min);
    all.x_max = std::max(all.x_max, one.x_max);
    all.y_min = std::min(all.y_min, one.y_min);
    all.y_max = std::max(all.y_max, one.y_max);
    if (one.z_max > all.z_max) {
      all.z_max = one.z_max;
      all.top = one.top;
    }
  };
  levels_[0].nodes.assign(begin_.size() - 1, kEmpty);
  for (std::size_t cell = 0; cell + 1 < begin_.size(); ++cell) {
    for (std::int64_t item = begin_[cell]; item < begin_[cell + 1]; ++item) {
      include(levels_[0].nodes[cell], boxes_[index_of(item)]);
    }
  }
  while (levels_.back().nodes.size() > 1) {
    const Level& fine = levels_.back();
    Level coarse{(fine.columns + 1) / 2, (fine.rows + 1) / 2, {}};
    coarse.nodes.assign(index_of(coarse.columns) * index_of(coarse.rows), kEmpty);
    for (int row = 0; row < fine.rows; ++row) {
      for (int column = 0; column < fine.columns; ++column) {
        const auto from = index_of(row) * index_of(fine.columns) + index_of(column);
        const auto to = index_of(row / 2) * index_of(coarse.columns) + index_of(column / 2);
        include(coarse.nodes[to], fine.nodes[from]);
      }
    }
    levels_.push_back(std::move(coarse));
  }
}

CutterLocation ProfileCutter::drop(const CutterProfile& profile, const Eigen::Vector2d& p,
                                   const CutterLocation& near) const {
  if (levels_.empty()) return {};
  Search search{profile, p, p.x() - bounds_.min().x(), p.y() - bounds_.min().y()};
  if (near.rests()) try_item(item_of_[index_of(near.triangle)], search);
  if (search.most(levels_.back().nodes[0]) > search.best.tip) {
    search_node(levels_.size() - 1, 0, 0, search);
  }
  return search.best;
}

double ProfileCutter::rest_on(const CutterProfile& profile, const Eigen::Vector2d& p,
                              const CutterLocation& near) const {
  if (!near.rests()) return kNoContact;
  const std::int32_t item = item_of_[index_of(near.triangle)];
  return profile_triangle_tip(profile, p, corners_[index_of(item)]);
}

void ProfileCutter::search_node(std::size_t level, int column, int row, Search& search) const {
  if (level == 0) {
    search_cell(index_of(row) * index_of(levels_[0].columns) + index_of(column), search);
    return;
  }
  struct Child {
    double most;
    int column, row;
  };
  std::array<Child, 4> children{};
  std::size_t count = 0;
  const Level& below_it = levels_[level - 1];
  for (int k = 0; k < 4; ++k) {
    const int c = 2 * column + k % 2;
    const int r = 2 * row + k / 2;
    if (c >= below_it.columns || r >= below_it.rows) continue;
    const Node& node = below_it.nodes[index_of(r) * index_of(below_it.columns) + index_of(c)];
    const double most = search.most(node);
    if (!(most > search.best.tip)) continue;
    const double least = search.least(node);
    if (least > search.best.tip) search.offer(least, triangle_of_[index_of(node.top)]);
    std::size_t place = count++;  // The most promising first.
    for (; place > 0 && children[place - 1].most < most; --place) {
      children[place] = children[place - 1];
    }
    children[place] = {most, c, r};
  }
  for (std::size_t k = 0; k < count; ++k) {
    if (!(children[k].most > search.best.tip)) return;
    search_node(level - 1, children[k].column, children[k].row, search);
  }
}

void ProfileCutter::search_cell(std::size_t cell, Search& search) const {
  for (std::int64_t item = begin_[cell]; item < begin_[cell + 1]; ++item) {
    if (search.most(boxes_[index_of(item)]) > search.best.tip) try_item(item, search);
  }
}

void ProfileCutter::try_item(std::int64_t item, Search& search) const {
  search.offer(
      profile_triangle_tip(search.profile, search.p, corners_[index_of(item)], search.best.tip),
      triangle_of_[index_of(item)]);
}

}  // namespace lensforge
