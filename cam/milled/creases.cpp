// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/creases.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"

namespace lensforge {
namespace {

/// Excess heights of two nodes beside a crease, mm.
struct NodePair {
  double first = 0.0;
  double second = 0.0;
};

/// Jumps whose x and y parts are this close count along y, regardless of rounding: diagonals of
/// square meshes.
constexpr double kTie = 1.0 + 1e-6;

/// A line of nodes along one axis of a patch.
class NodeLine {
 public:
  NodeLine(const SurfacePatch& patch, int axis)
      : patch_(patch),
        axis_(axis),
        step_(axis == 0 ? 1 : patch.window.columns),
        count_(axis == 0 ? patch.window.columns : patch.window.rows),
        spacing_(patch.window.spacing[axis]) {}

  /// Excess height of a node. @param at  from the line's begin. @param node  index in the patch.
  [[nodiscard]] double rise(std::int64_t at, std::int64_t node) const {
    if (at == 0 || at + 1 == count_) return 0.0;
    return beside_crease(at - 1, node - step_).second + beside_crease(at, node).first;
  }

 private:
  /// Excess at the crease, if there is one, between a node and the next.
  [[nodiscard]] NodePair beside_crease(std::int64_t at, std::int64_t node) const {
    if (at == 0 || at + 2 == count_ || cut(node) == cut(node + step_)) return {};
    const std::int64_t next = node + step_;
    const std::optional<double> bend_before = bend(node - step_, node);
    const std::optional<double> bend_after = bend(next, next + step_);
    const double before = bend_before.value_or(bend_after.value_or(0.0));
    const double after = bend_after.value_or(before);
    const double h = spacing_;
    const double climb = height(next) - height(node);
    const double share = meeting_share(climb - h * slope(next) + 0.5 * h * h * after,
                                       climb - h * slope(node) - 0.5 * h * h * before);
    const double jump = slope(next) - slope(node) - h * ((1.0 - share) * after + share * before);
    if (!counts(jump, across(next) - across(node))) return {};
    const double b2 = share * share - share + 1.0 / 6.0;
    const double b3 = share * (share - 0.5) * (share - 1.0);
    return {jump * h * (0.5 * (1.0 - share) * b2 + b3 / 3.0),
            jump * h * (0.5 * share * b2 - b3 / 3.0)};
  }

  template <class Value>
  static Value value(const std::vector<Value>& values, std::int64_t node) {
    return values[static_cast<std::size_t>(node)];
  }
  [[nodiscard]] std::int32_t cut(std::int64_t node) const { return value(patch_.cut, node); }
  [[nodiscard]] double height(std::int64_t node) const { return value(patch_.z, node); }
  [[nodiscard]] double slope(std::int64_t node) const {
    return value(axis_ == 0 ? patch_.slope_x : patch_.slope_y, node);
  }
  [[nodiscard]] double across(std::int64_t node) const {
    return value(axis_ == 0 ? patch_.slope_y : patch_.slope_x, node);
  }
  /// Derivative of the slope between two nodes; nothing across two pieces.
  [[nodiscard]] std::optional<double> bend(std::int64_t first, std::int64_t second) const {
    if (cut(first) != cut(second)) return std::nullopt;
    return (slope(second) - slope(first)) / spacing_;
  }
  [[nodiscard]] bool counts(double along, double other) const {
    const double x = std::abs(axis_ == 0 ? along : other);
    const double y = std::abs(axis_ == 0 ? other : along);
    return (x > kTie * y) == (axis_ == 0);
  }

  const SurfacePatch& patch_;
  int axis_;
  std::int64_t step_;   ///< From node to node, in the patch.
  std::int64_t count_;  ///< Nodes.
  double spacing_;
};

}  // namespace

double meeting_share(double at_first, double at_second) {
  const bool crosses = (at_first < 0.0) != (at_second < 0.0);
  const double from = crosses ? std::abs(at_first) : std::sqrt(std::abs(at_first));
  const double to = crosses ? std::abs(at_second) : std::sqrt(std::abs(at_second));
  return from + to > 0.0 ? from / (from + to) : 0.5;
}

void correct_crease_sums(const Executor& executor, SurfacePatch& patch) {
  if (patch.cut.empty()) return;
  const NodeLine along_x(patch, 0);
  const NodeLine along_y(patch, 1);
  std::vector<double> heights(patch.z.size());
  const auto correct_row = [&](std::int64_t j) {
    for (std::int64_t i = 0; i < patch.window.columns; ++i) {
      const std::int64_t n = j * patch.window.columns + i;
      heights[static_cast<std::size_t>(n)] =
          patch.z[static_cast<std::size_t>(n)] + along_x.rise(i, n) + along_y.rise(j, n);
    }
  };
  parallel_for(executor, "sums across creases", patch.window.rows, correct_row, 4);
  patch.z = std::move(heights);
}

CreaseMapper::CreaseMapper(const GridWindow& grid, const CreaseMapOptions& options)
    : options_(options), grid_(grid) {
  LF_CHECK(options.cell > 0.0, std::to_string(options.cell));
  const Eigen::Vector2d size = grid.node(grid.columns - 1, grid.rows - 1) - grid.node(0, 0);
  const auto parts = [&](double side) {
    return std::max<std::int64_t>(1, std::llround(std::ceil(side / options.cell - 1e-9)));
  };
  columns_ = parts(size.x());
  rows_ = parts(size.y());
  cells_.resize(static_cast<std::size_t>(columns_ * rows_));
}

std::int64_t CreaseMapper::cell_at(double at, int axis) const {
  const auto cell = static_cast<std::int64_t>((at - grid_.node(0, 0)[axis]) / options_.cell);
  return std::min(cell, (axis == 0 ? columns_ : rows_) - 1);
}

/// Tiles share their rims: the first row and column count only at the grid's border. Rows of the
/// map are filled in parallel, each by one thread.
void CreaseMapper::add(const CellRange& tile, const SurfacePatch& patch, const Executor& executor) {
  const GridWindow& window = patch.window;
  // The tile's first node, counted in the patch.
  const std::int64_t column = grid_.first_column + tile.column - window.first_column;
  const std::int64_t row = grid_.first_row + tile.row - window.first_row;
  const std::int64_t column_begin = column + (tile.column > 0 ? 1 : 0);
  const std::int64_t row_begin = row + (tile.row > 0 ? 1 : 0);
  std::vector<std::pair<std::int64_t, std::int64_t>> bands;
  for (std::int64_t j = row_begin; j <= row + tile.rows; ++j) {
    const bool same = !bands.empty() && cell_at(window.y(j), 1) == cell_at(window.y(j - 1), 1);
    if (!same) bands.emplace_back(j, j);
    ++bands.back().second;
  }
  parallel_for(executor, "crease map", std::ssize(bands), [&](std::int64_t b) {
    const auto [first, last] = bands[static_cast<std::size_t>(b)];
    for (std::int64_t j = first; j < last; ++j)
      add_row(patch, j, column_begin, column + tile.columns + 1);
  });
}

void CreaseMapper::add_row(const SurfacePatch& patch, std::int64_t row, std::int64_t begin,
                           std::int64_t end) {
  const GridWindow& window = patch.window;
  const std::int64_t cell_row = cell_at(window.y(row), 1);
  for (std::int64_t i = begin; i < end; ++i) {
    const auto n = static_cast<std::size_t>(row * window.columns + i);
    Cell& cell = cells_[static_cast<std::size_t>(cell_row * columns_ + cell_at(window.x(i), 0))];
    ++cell.nodes;
    if (!(patch.depth[n] > 0.0)) continue;
    ++cell.fillets;
    if (patch.depth[n] <= cell.deepest.depth) continue;
    cell.deepest = {window.node(i, row), patch.depth[n], patch.width[n]};
  }
}

CreaseMap CreaseMapper::map() const {
  CreaseMap map;
  map.columns = columns_;
  map.rows = rows_;
  map.cell = options_.cell;
  map.origin = grid_.node(0, 0);
  std::int64_t nodes = 0;
  std::int64_t fillets = 0;
  for (const Cell& cell : cells_) {
    nodes += cell.nodes;
    fillets += cell.fillets;
    map.depth.push_back(static_cast<float>(cell.deepest.depth));
    map.share.push_back(
        cell.nodes > 0 ? static_cast<float>(cell.fillets) / static_cast<float>(cell.nodes) : 0.0F);
  }
  map.fillets = nodes > 0 ? static_cast<double>(fillets) / static_cast<double>(nodes) : 0.0;
  map.worst = worst();
  return map;
}

/// Deepest spots first, none close to another.
std::vector<CreaseSpot> CreaseMapper::worst() const {
  std::vector<CreaseSpot> spots;
  for (const Cell& cell : cells_) {
    if (cell.deepest.depth > 0.0) spots.push_back(cell.deepest);
  }
  std::stable_sort(spots.begin(), spots.end(),
                   [](const CreaseSpot& a, const CreaseSpot& b) { return a.depth > b.depth; });
  std::vector<CreaseSpot> worst;
  for (const CreaseSpot& spot : spots) {
    if (worst.size() == options_.spots) break;
    const bool crowded = std::any_of(worst.begin(), worst.end(), [&](const CreaseSpot& other) {
      return (spot.place - other.place).norm() < options_.apart;
    });
    if (!crowded) worst.push_back(spot);
  }
  return worst;
}

}  // namespace lensforge
