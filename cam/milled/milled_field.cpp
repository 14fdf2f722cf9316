// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/milled_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "cam/milled/ball_sweep.h"
#include "core/error.h"

namespace lensforge {
namespace {

/// Nodes along either side of the blocks that are cut at once. On the benchmark's raster at 10 µm
/// (MilledNodes) 16 is best.
constexpr std::int64_t kBlockSide = 16;
constexpr std::size_t kBlockNodes = kBlockSide * kBlockSide;

/// Side of the cells that spans are sorted into, in radii.
constexpr double kCellPerRadius = 0.5;

/// Cells of a grid at most, but for four a move: memory stays in proportion.
constexpr double kMostCells = 4e6;

/// Far above the rounding of a height, mm: passing a span over never changes a bit of the result.
constexpr double kBoundMargin = 1e-9;

/// Far above the rounding of a span's box to single precision, mm.
constexpr double kRounding = 1e-3;

std::size_t index_of(std::int64_t value) { return static_cast<std::size_t>(value); }

float below(double value) {
  return std::nextafter(static_cast<float>(value), -std::numeric_limits<float>::infinity());
}

float above(double value) {
  return std::nextafter(static_cast<float>(value), std::numeric_limits<float>::infinity());
}

Eigen::AlignedBox3d box_of(const BallPath& path, const BallMove& move, double from, double to) {
  if (move.arc >= 0) {
    return part_of(path.arcs()[static_cast<std::size_t>(move.arc)], from, to).bounds();
  }
  Eigen::AlignedBox3d box(Eigen::Vector3d(move.start + from * (move.end - move.start)));
  return box.extend(Eigen::Vector3d(move.start + to * (move.end - move.start)));
}

double run_of(const BallPath& path, const BallMove& move) {
  if (move.arc >= 0) return path.arcs()[static_cast<std::size_t>(move.arc)].length();
  return (move.end - move.start).head<2>().norm();
}

double cell_of(const BallPath& path) {
  Eigen::AlignedBox3d box;
  for (const BallMove& move : path.moves()) box.extend(box_of(path, move, 0.0, 1.0));
  const double cells = kMostCells + 4.0 * static_cast<double>(path.moves().size());
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  if (!path.moves().empty()) size = box.sizes();
  return std::max({kCellPerRadius * path.radius(), std::sqrt(size.x() * size.y() / cells),
                   std::max(size.x(), size.y()) / cells});
}

}  // namespace

/// Nodes of a window that are cut at once, and what has cut them deepest so far.
struct MilledField::Block {
  std::int64_t column = 0, row = 0;  ///< First node, in the window.
  std::int64_t columns = 0, rows = 0;
  std::array<double, kBlockSide> x{}, y{};
  std::array<double, kBlockNodes> z{};
  std::array<std::int32_t, kBlockNodes> move{};  ///< −1: the blank's top.
  std::array<std::int32_t, kBlockNodes> path{};
  std::int32_t cutting = 0;  ///< The path that is being tried.
  double radius = 0.0;       ///< Of its ball.

  Block(const GridWindow& window, std::int64_t block, double blank_top) {
    const std::int64_t across = (window.columns + kBlockSide - 1) / kBlockSide;
    column = block % across * kBlockSide;
    row = block / across * kBlockSide;
    columns = std::min(kBlockSide, window.columns - column);
    rows = std::min(kBlockSide, window.rows - row);
    for (std::int64_t i = 0; i < columns; ++i) x[index_of(i)] = window.x(column + i);
    for (std::int64_t j = 0; j < rows; ++j) y[index_of(j)] = window.y(row + j);
    z.fill(blank_top);
    move.fill(-1);
  }

  [[nodiscard]] double x_end() const { return x[index_of(columns - 1)]; }
  [[nodiscard]] double y_end() const { return y[index_of(rows - 1)]; }

  [[nodiscard]] double highest() const {
    double highest = z[0];
    for (std::int64_t j = 0; j < rows; ++j) {
      for (std::int64_t i = 0; i < columns; ++i) {
        highest = std::max(highest, z[index_of(j * kBlockSide + i)]);
      }
    }
    return highest;
  }

  /// How near the span comes to the block, squared.
  [[nodiscard]] double distance2(const Span& span) const {
    const double dx = std::max({x[0] - span.x_max, span.x_min - x_end(), 0.0});
    const double dy = std::max({y[0] - span.y_max, span.y_min - y_end(), 0.0});
    return dx * dx + dy * dy;
  }

  void offer(std::size_t node, double height, std::int32_t by) {
    if (height > z[node]) return;
    if (height == z[node] && (move[node] < 0 || path[node] != cutting || by >= move[node])) return;
    z[node] = height;
    move[node] = by;
    path[node] = cutting;
  }

  /// Columns of row j that the span's ball can reach: [first, second).
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> columns_under(const Span& span,
                                                                    std::int64_t j) const {
    const double at = y[index_of(j)];
    const double dy = std::max({at - span.y_max, span.y_min - at, 0.0});
    const double room = radius * radius - dy * dy;
    if (room < 0.0) return {0, 0};
    const double half = std::sqrt(room);
    std::int64_t begin = 0;
    std::int64_t end = columns;
    while (begin < end && x[index_of(begin)] < span.x_min - half) ++begin;
    while (end > begin && x[index_of(end - 1)] > span.x_max + half) --end;
    return {begin, end};
  }

  void cut_straight(const StraightSweep& sweep, const Span& span) {
    std::array<double, kBlockSide> height{};
    for (std::int64_t j = 0; j < rows; ++j) {
      const auto [begin, end] = columns_under(span, j);
      const double qy = y[index_of(j)];
      for (std::int64_t i = begin; i < end; ++i) {
        const double qx = x[index_of(i)];
        const double s = sweep.foot(radius, qx, qy);
        height[index_of(i)] = ball_below(sweep.centre(s), radius, qx, qy);
      }
      for (std::int64_t i = begin; i < end; ++i) {
        offer(index_of(j * kBlockSide + i), height[index_of(i)], span.move);
      }
    }
  }

  void cut_arc(const ArcSweep& sweep, const Span& span) {
    for (std::int64_t j = 0; j < rows; ++j) {
      const auto [begin, end] = columns_under(span, j);
      for (std::int64_t i = begin; i < end; ++i) {
        const double qx = x[index_of(i)];
        const double qy = y[index_of(j)];
        offer(index_of(j * kBlockSide + i),
              ball_below(sweep.centre(radius, qx, qy), radius, qx, qy), span.move);
      }
    }
  }
};

MilledField::MilledField(std::vector<BallPath> paths, double blank_top)
    : paths_(std::move(paths)), blank_top_(blank_top) {
  std::int32_t cut = 1;
  for (const BallPath& path : paths_) {
    grids_.push_back(make_grid(spans_of(path, blank_top), cell_of(path)));
    grids_.back().first_cut = cut;
    cut += path.pieces();
  }
}

/// Every move in parts no longer than a cell; those that stay above the blank are left out.
std::vector<MilledField::Span> MilledField::spans_of(const BallPath& path, double blank_top) {
  const double cell = cell_of(path);
  std::vector<Span> spans;
  spans.reserve(path.moves().size());
  for (std::size_t m = 0; m < path.moves().size(); ++m) {
    const BallMove& move = path.moves()[m];
    const int parts = std::max(1, static_cast<int>(std::ceil(run_of(path, move) / cell)));
    for (int k = 0; k < parts; ++k) {
      const Eigen::AlignedBox3d box =
          box_of(path, move, k / double(parts), (k + 1) / double(parts));
      if (box.min().z() - path.radius() >= blank_top) continue;
      spans.push_back({below(box.min().x()), above(box.max().x()), below(box.min().y()),
                       above(box.max().y()), below(box.min().z()), static_cast<std::int32_t>(m)});
    }
  }
  return spans;
}

/// Counting sort of the spans by cell.
MilledField::SpanGrid MilledField::make_grid(const std::vector<Span>& spans, double cell) {
  SpanGrid grid;
  grid.cell = cell;
  if (spans.empty()) return grid;
  const auto centre = [](const Span& span) {
    return Eigen::Vector2d(0.5 * (double{span.x_min} + double{span.x_max}),
                           0.5 * (double{span.y_min} + double{span.y_max}));
  };
  Eigen::AlignedBox2d box;
  for (const Span& span : spans) box.extend(centre(span));
  grid.origin = box.min();
  grid.columns = static_cast<std::int64_t>(box.sizes().x() / cell) + 1;
  grid.rows = static_cast<std::int64_t>(box.sizes().y() / cell) + 1;
  const auto cell_of_span = [&](const Span& span) {
    const Eigen::Vector2d at = (centre(span) - grid.origin) / cell;
    const auto column = std::min(static_cast<std::int64_t>(at.x()), grid.columns - 1);
    return index_of(std::min(static_cast<std::int64_t>(at.y()), grid.rows - 1) * grid.columns +
                    column);
  };
  grid.begin.assign(index_of(grid.columns * grid.rows) + 1, 0);
  for (const Span& span : spans) ++grid.begin[cell_of_span(span) + 1];
  for (std::size_t c = 1; c < grid.begin.size(); ++c) grid.begin[c] += grid.begin[c - 1];
  std::vector<std::int64_t> next(grid.begin.begin(), grid.begin.end() - 1);
  grid.spans.resize(spans.size());
  for (const Span& span : spans) grid.spans[index_of(next[cell_of_span(span)]++)] = span;
  return grid;
}

/// Spans that may cut into the block, those first that may cut deepest.
std::vector<MilledField::Candidate> MilledField::candidates_of(const SpanGrid& grid,
                                                               const Block& block) {
  const double reach = block.radius + 0.5 * grid.cell + kRounding;
  const auto cell_at = [&](double at, double origin, std::int64_t count) {
    const double cell = std::floor((at - origin) / grid.cell);
    return static_cast<std::int64_t>(std::clamp(cell, 0.0, static_cast<double>(count - 1)));
  };
  const std::int64_t first = cell_at(block.x[0] - reach, grid.origin.x(), grid.columns);
  const std::int64_t last = cell_at(block.x_end() + reach, grid.origin.x(), grid.columns);
  const std::int64_t row_begin = cell_at(block.y[0] - reach, grid.origin.y(), grid.rows);
  const std::int64_t row_end = cell_at(block.y_end() + reach, grid.origin.y(), grid.rows);
  const double highest = block.highest();
  std::vector<Candidate> candidates;
  for (std::int64_t row = row_begin; row <= row_end; ++row) {
    const std::int64_t end = grid.begin[index_of(row * grid.columns + last + 1)];
    for (std::int64_t s = grid.begin[index_of(row * grid.columns + first)]; s < end; ++s) {
      const Span& span = grid.spans[index_of(s)];
      const double room = block.radius * block.radius - block.distance2(span);
      if (room < 0.0) continue;
      const double bound = double{span.z_min} - std::sqrt(room) - kBoundMargin;
      if (bound <= highest) candidates.push_back({bound, s});
    }
  }
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.bound < b.bound || (a.bound == b.bound && a.span < b.span);
  });
  return candidates;
}

/// Once none of the spans that are left can cut below the highest node the block is done.
void MilledField::cut_block(std::size_t path, Block& block) const {
  const SpanGrid& grid = grids_[path];
  if (grid.spans.empty()) return;
  block.cutting = static_cast<std::int32_t>(path);
  block.radius = paths_[path].radius();
  for (const Candidate& candidate : candidates_of(grid, block)) {
    if (candidate.bound > block.highest()) break;
    const Span& span = grid.spans[index_of(candidate.span)];
    const BallMove& move = paths_[path].moves()[static_cast<std::size_t>(span.move)];
    if (move.arc < 0) {
      block.cut_straight(StraightSweep(move), span);
    } else {
      block.cut_arc(ArcSweep(paths_[path].arcs()[static_cast<std::size_t>(move.arc)]), span);
    }
  }
}

void MilledField::write_block(const Block& block, SurfacePatch& patch) const {
  for (std::int64_t j = 0; j < block.rows; ++j) {
    for (std::int64_t i = 0; i < block.columns; ++i) {
      const std::size_t from = index_of(j * kBlockSide + i);
      const std::size_t to = index_of((block.row + j) * patch.window.columns + block.column + i);
      patch.z[to] = block.z[from];
      Eigen::Vector2d slope = Eigen::Vector2d::Zero();
      std::int32_t cut = 0;
      if (block.move[from] >= 0) {
        const auto p = static_cast<std::size_t>(block.path[from]);
        const BallMove& move = paths_[p].moves()[static_cast<std::size_t>(block.move[from])];
        slope = slope_at(p, move, {block.x[index_of(i)], block.y[index_of(j)]});
        cut = grids_[p].first_cut + move.piece;
      }
      patch.slope_x[to] = slope.x();
      patch.slope_y[to] = slope.y();
      patch.cut[to] = cut;
    }
  }
}

Eigen::Vector2d MilledField::slope_at(std::size_t path, const BallMove& move,
                                      const Eigen::Vector2d& q) const {
  const double radius = paths_[path].radius();
  if (move.arc < 0) {
    const StraightSweep sweep(move);
    return ball_slope(sweep.centre(sweep.foot(radius, q.x(), q.y())), radius, q);
  }
  const ArcSweep sweep(paths_[path].arcs()[static_cast<std::size_t>(move.arc)]);
  return ball_slope(sweep.centre(radius, q.x(), q.y()), radius, q);
}

void MilledField::sample(const GridWindow& window, const Executor& executor,
                         SurfacePatch& patch) const {
  resize_patch(window, true, patch);
  const std::int64_t across = (window.columns + kBlockSide - 1) / kBlockSide;
  const std::int64_t blocks = across * ((window.rows + kBlockSide - 1) / kBlockSide);
  const auto cut = [&](std::int64_t b) {
    Block block(window, b, blank_top_);
    for (std::size_t path = 0; path < paths_.size(); ++path) cut_block(path, block);
    write_block(block, patch);
  };
  parallel_for(executor, "milled surface", blocks, cut, 4);
}

}  // namespace lensforge
