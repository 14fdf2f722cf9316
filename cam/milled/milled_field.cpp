// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/milled_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "cam/milled/ball_sweep.h"
#include "core/compute/scalar.h"
#include "core/error.h"

namespace lensforge {
namespace {

/// Nodes along either side of the blocks that are cut together; 16 is fastest on the benchmark's
/// raster at 10 µm (MilledNodes).
constexpr std::int64_t kCutBlockSide = 16;
constexpr std::size_t kBlockNodes = kCutBlockSide * kCutBlockSide;

/// Side of the cells that spans are sorted into, in radii.
constexpr double kCellPerRadius = 0.5;

/// Maximum number of cells of a grid, unless four per move are more: bounds memory.
constexpr double kMaxCells = 4e6;

/// Far above the rounding of a height, mm: skipping a span never changes a bit of the result.
constexpr double kBoundMargin = 1e-9;

/// Far above the rounding of a span's box to single precision, mm.
constexpr double kRounding = 1e-3;

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
  const double cells = kMaxCells + 4.0 * static_cast<double>(path.moves().size());
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  if (!path.moves().empty()) size = box.sizes();
  return std::max({kCellPerRadius * path.radius(), std::sqrt(size.x() * size.y() / cells),
                   std::max(size.x(), size.y()) / cells});
}

}  // namespace

/// Cache of slopes that moves leave: neighbouring nodes mostly need the same one.
class MilledField::MoveSlopes {
 public:
  explicit MoveSlopes(const std::vector<BallPath>& paths) : paths_(paths) {}

  Eigen::Vector2d at(std::size_t path, std::int32_t move, const Eigen::Vector2d& q) {
    const double radius = paths_[path].radius();
    if (path != path_ || move != move_) prepare(path, move);
    if (straight_) {
      return ball_slope(straight_->centre(straight_->foot(radius, q.x(), q.y())), radius, q);
    }
    if (graph_) return ball_slope(graph_->centre(graph_->foot(radius, q.x(), q.y())), radius, q);
    return ball_slope(arc_->centre(radius, q.x(), q.y()), radius, q);
  }

 private:
  void prepare(std::size_t path, std::int32_t move) {
    path_ = path;
    move_ = move;
    straight_.reset();
    graph_.reset();
    const BallMove& way = paths_[path].moves()[static_cast<std::size_t>(move)];
    if (way.arc < 0) {
      straight_.emplace(way);
      return;
    }
    arc_.emplace(paths_[path].arcs()[static_cast<std::size_t>(way.arc)]);
    graph_ = arc_->graph(paths_[path].radius());
  }

  const std::vector<BallPath>& paths_;
  std::size_t path_ = 0;
  std::int32_t move_ = -1;
  std::optional<StraightSweep> straight_;
  std::optional<GraphArc> graph_;
  std::optional<ArcSweep> arc_;
};

/// Nodes of a block: columns and rows [first, second).
struct MilledField::NodeRange {
  std::pair<std::int64_t, std::int64_t> columns;
  std::pair<std::int64_t, std::int64_t> rows;
};

/// Nodes of a window that are cut together, and the deepest cut at each so far.
struct MilledField::Block {
  std::int64_t column = 0, row = 0;  ///< First node, in the window.
  std::int64_t columns = 0, rows = 0;
  std::array<double, kCutBlockSide> x{}, y{};
  std::array<double, kBlockNodes> z{};
  std::array<std::int32_t, kBlockNodes> move{};  ///< −1: the blank's top.
  std::array<std::int32_t, kBlockNodes> path{};
  std::int32_t cutting = 0;  ///< The path being tried.
  double radius = 0.0;       ///< Of its ball.
  // A plane approximately parallel to the surface, see lay_plane().
  Eigen::Vector2d slope{0.0, 0.0};
  double secant = 1.0;
  Eigen::Vector2d touch{0.0, 0.0};  ///< From a ball's centre to its contact with such a plane.
  std::array<double, kBlockNodes> plane{};

  Block(const GridWindow& window, std::int64_t block, double blank_top) {
    const std::int64_t across = (window.columns + kCutBlockSide - 1) / kCutBlockSide;
    column = block % across * kCutBlockSide;
    row = block / across * kCutBlockSide;
    columns = std::min(kCutBlockSide, window.columns - column);
    rows = std::min(kCutBlockSide, window.rows - row);
    for (std::int64_t i = 0; i < columns; ++i) x[index_of(i)] = window.x(column + i);
    for (std::int64_t j = 0; j < rows; ++j) y[index_of(j)] = window.y(row + j);
    z.fill(-kUncut);  // Beyond the window: never the highest.
    for (std::int64_t j = 0; j < rows; ++j) {
      const auto begin = z.begin() + j * kCutBlockSide;
      std::fill(begin, begin + columns, blank_top);
    }
    move.fill(-1);
  }

  [[nodiscard]] double x_end() const { return x[index_of(columns - 1)]; }
  [[nodiscard]] double y_end() const { return y[index_of(rows - 1)]; }

  /// Measures heights in bounds from a plane through (x[0], y[0], 0) from now on.
  void lay_plane(const Eigen::Vector2d& gradient) {
    slope = gradient;
    secant = std::sqrt(1.0 + gradient.squaredNorm());
    touch = gradient * (radius / secant);
    for (std::int64_t j = 0; j < rows; ++j) {
      for (std::int64_t i = 0; i < columns; ++i) {
        plane[index_of(j * kCutBlockSide + i)] = plane_at(x[index_of(i)], y[index_of(j)]);
      }
    }
  }

  [[nodiscard]] double plane_at(double at_x, double at_y) const {
    return slope.x() * (at_x - x[0]) + slope.y() * (at_y - y[0]);
  }

  /// Height of the highest node above the plane.
  [[nodiscard]] double highest_node() const {
    using Nodes = Eigen::Map<const Eigen::Array<double, kBlockNodes, 1>>;
    return (Nodes(z.data()) - Nodes(plane.data())).maxCoeff();
  }

  /// True if a ball with its centre in the span can be over a node.
  [[nodiscard]] bool reached_by(const Span& span) const {
    const double dx = std::max({x[0] - span.x_max, span.x_min - x_end(), 0.0});
    const double dy = std::max({y[0] - span.y_max, span.y_min - y_end(), 0.0});
    return dx * dx + dy * dy <= radius * radius;
  }

  /// Minimum height above the plane at which a ball of the span, a part of `way`, touches a plane
  /// parallel to it: R·√(1 + g²) below the centre.
  [[nodiscard]] double touch_height(const Span& span, const BallMove& way) const {
    const double along_x = slope.x() * ((slope.x() > 0.0 ? span.x_max : span.x_min) - x[0]);
    const double along_y = slope.y() * ((slope.y() > 0.0 ? span.y_max : span.y_min) - y[0]);
    double least = double{span.z_min} - along_x - along_y;
    if (way.arc < 0) {
      least = std::max(least, std::min(way.start.z() - plane_at(way.start.x(), way.start.y()),
                                       way.end.z() - plane_at(way.end.x(), way.end.y())));
    }
    return least - radius * secant - kBoundMargin;
  }

  /// Squared distance from that contact to the nearest node. As the ball's curvature is at least
  /// 1/R, it is higher over a node that far away by at least distance²/(2R).
  [[nodiscard]] double beside2(const Span& span) const {
    const double px = touch.x();
    const double py = touch.y();
    const double dx = std::max({x[0] - (span.x_max + px), span.x_min + px - x_end(), 0.0});
    const double dy = std::max({y[0] - (span.y_max + py), span.y_min + py - y_end(), 0.0});
    return dx * dx + dy * dy;
  }

  void offer(std::size_t node, double height, std::int32_t by) {
    if (height > z[node]) return;
    if (height == z[node] && (move[node] < 0 || path[node] != cutting || by >= move[node])) return;
    z[node] = height;
    move[node] = by;
    path[node] = cutting;
  }

  /// Nodes over which the span's ball can be below `highest`.
  [[nodiscard]] NodeRange nodes_under(const Candidate& candidate, const Span& span,
                                      double highest) const {
    const double room = 2.0 * radius * (highest - candidate.touch_height);
    const double half = std::sqrt(std::max(room, 0.0)) + kBoundMargin;
    const auto range = [&](const auto& at, std::int64_t count, double low, double high) {
      std::int64_t begin = 0;
      std::int64_t end = count;
      while (begin < end && at[index_of(begin)] < low - half) ++begin;
      while (end > begin && at[index_of(end - 1)] > high + half) --end;
      return std::make_pair(begin, end);
    };
    return {range(x, columns, span.x_min + touch.x(), span.x_max + touch.x()),
            range(y, rows, span.y_min + touch.y(), span.y_max + touch.y())};
  }

  /// Offers the surface of a move at every node of a range, line by line along x or y:
  /// `below(across, along, room, height)` computes it for the nodes of a line, as in GraphArc.
  template <class Below>
  void cut_lines(bool along_x, const NodeRange& range, std::int32_t by, const Below& below) {
    using Line = Eigen::Array<double, Eigen::Dynamic, 1, Eigen::ColMajor, kCutBlockSide, 1>;
    const auto& [nodes, lines] =
        along_x ? std::tie(range.columns, range.rows) : std::tie(range.rows, range.columns);
    const auto& [at, across] = along_x ? std::tie(x, y) : std::tie(y, x);
    const std::int64_t step = along_x ? 1 : kCutBlockSide;
    const std::int64_t line_step = along_x ? kCutBlockSide : 1;
    const Eigen::Map<const Eigen::ArrayXd> along(at.data() + nodes.first,
                                                 nodes.second - nodes.first);
    Line room(along.size());
    Line height(along.size());
    for (std::int64_t line = lines.first; line < lines.second; ++line) {
      below(across[index_of(line)], along, room, height);
      for (std::int64_t k = 0; k < along.size(); ++k) {
        if (room[k] < 0.0) continue;
        offer(index_of(line * line_step + (nodes.first + k) * step), height[k], by);
      }
    }
  }

  void cut_straight(const StraightSweep& sweep, std::int32_t by, const NodeRange& range) {
    cut_lines(true, range, by, [&](double qy, const auto& qx, auto& room, auto& height) {
      sweep.below(radius, qy, qx, room, height);
    });
  }

  void cut_graph(const GraphArc& arc, std::int32_t by, const NodeRange& range) {
    const auto below = [&](double across, const auto& along, auto& room, auto& height) {
      arc.below(radius, across, along, room, height);
    };
    cut_lines(arc.along_x, range, by, below);
  }

  void cut_arc(const ArcSweep& sweep, std::int32_t by, const NodeRange& range) {
    if (const std::optional<GraphArc> graph = sweep.graph(radius)) {
      cut_graph(*graph, by, range);
      return;
    }
    for (std::int64_t j = range.rows.first; j < range.rows.second; ++j) {
      for (std::int64_t i = range.columns.first; i < range.columns.second; ++i) {
        const double qx = x[index_of(i)];
        const double qy = y[index_of(j)];
        offer(index_of(j * kCutBlockSide + i),
              ball_below(sweep.centre(radius, qx, qy), radius, qx, qy), by);
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

/// Divides every move into parts no longer than a cell, without those that stay above the blank.
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
      spans.push_back({float_below(box.min().x()), float_above(box.max().x()),
                       float_below(box.min().y()), float_above(box.max().y()),
                       float_below(box.min().z()), static_cast<std::int32_t>(m)});
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

/// Calls `action` with the number of every span that may be over a node of the block.
template <class Action>
void MilledField::for_each_span(const SpanGrid& grid, const Block& block, const Action& action) {
  const double reach = block.radius + 0.5 * grid.cell + kRounding;
  const auto cell_at = [&](double at, double origin, std::int64_t count) {
    const double cell = std::floor((at - origin) / grid.cell);
    return static_cast<std::int64_t>(std::clamp(cell, 0.0, static_cast<double>(count - 1)));
  };
  const std::int64_t first = cell_at(block.x[0] - reach, grid.origin.x(), grid.columns);
  const std::int64_t last = cell_at(block.x_end() + reach, grid.origin.x(), grid.columns);
  const std::int64_t row_begin = cell_at(block.y[0] - reach, grid.origin.y(), grid.rows);
  const std::int64_t row_end = cell_at(block.y_end() + reach, grid.origin.y(), grid.rows);
  for (std::int64_t row = row_begin; row <= row_end; ++row) {
    const std::int64_t end = grid.begin[index_of(row * grid.columns + last + 1)];
    for (std::int64_t s = grid.begin[index_of(row * grid.columns + first)]; s < end; ++s) {
      if (block.reached_by(grid.spans[index_of(s)])) action(s);
    }
  }
}

/// Gradient of the plane that best fits the centres of spans. Any plane gives the same results; a
/// better one tries fewer spans.
Eigen::Vector2d MilledField::mean_slope(const SpanGrid& grid, const std::vector<Candidate>& spans) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (const Candidate& candidate : spans) {
    const Span& span = grid.spans[index_of(candidate.span)];
    const Span& first = grid.spans[index_of(spans.front().span)];
    const Eigen::Vector3d at(double{span.x_min} - double{first.x_min},
                             double{span.y_min} - double{first.y_min},
                             double{span.z_min} - double{first.z_min});
    sum += at;
    squares += at * at.transpose();
  }
  const auto count = static_cast<double>(spans.size());
  const Eigen::Matrix3d spread = squares - sum * sum.transpose() / count;
  const double determinant = spread.topLeftCorner<2, 2>().determinant();
  constexpr double kOneLine = 1e-3;  // Below this share of the square there is no plane to be
                                     // found.
  const double trace = spread.topLeftCorner<2, 2>().trace();
  if (!(determinant > kOneLine * trace * trace)) return Eigen::Vector2d::Zero();
  const Eigen::Vector2d slope =
      spread.topLeftCorner<2, 2>().inverse() * spread.topRightCorner<2, 1>();
  return slope.cwiseMax(-1.0).cwiseMin(1.0);
}

/// Spans that may cut into the block, those with the deepest possible cut below its plane first.
std::vector<MilledField::Candidate> MilledField::candidates_of(std::size_t path,
                                                               Block& block) const {
  const SpanGrid& grid = grids_[path];
  std::vector<Candidate> candidates;
  for_each_span(grid, block, [&](std::int64_t s) { candidates.push_back({0.0, 0.0, s}); });
  if (candidates.empty()) return candidates;
  block.lay_plane(mean_slope(grid, candidates));
  const double highest = block.highest_node();
  std::size_t kept = 0;
  for (Candidate candidate : candidates) {
    const Span& span = grid.spans[index_of(candidate.span)];
    const BallMove& move = paths_[path].moves()[static_cast<std::size_t>(span.move)];
    candidate.touch_height = block.touch_height(span, move);
    candidate.bound = candidate.touch_height + block.beside2(span) / (2.0 * block.radius);
    if (candidate.bound <= highest) candidates[kept++] = candidate;
  }
  candidates.resize(kept);
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.bound < b.bound || (a.bound == b.bound && a.span < b.span);
  });
  return candidates;
}

/// Ends when none of the remaining spans can cut below the highest node.
void MilledField::cut_block(std::size_t path, Block& block) const {
  const SpanGrid& grid = grids_[path];
  if (grid.spans.empty()) return;
  block.cutting = static_cast<std::int32_t>(path);
  block.radius = paths_[path].radius();
  for (const Candidate& candidate : candidates_of(path, block)) {
    const double highest = block.highest_node();
    if (candidate.bound > highest) break;
    const Span& span = grid.spans[index_of(candidate.span)];
    const NodeRange range = block.nodes_under(candidate, span, highest);
    const BallMove& move = paths_[path].moves()[static_cast<std::size_t>(span.move)];
    if (move.arc < 0) {
      block.cut_straight(StraightSweep(move), span.move, range);
    } else {
      block.cut_arc(ArcSweep(paths_[path].arcs()[static_cast<std::size_t>(move.arc)]), span.move,
                    range);
    }
  }
}

void MilledField::write_block(const Block& block, SurfacePatch& patch) const {
  MoveSlopes slopes(paths_);
  for (std::int64_t j = 0; j < block.rows; ++j) {
    for (std::int64_t i = 0; i < block.columns; ++i) {
      const std::size_t from = index_of(j * kCutBlockSide + i);
      const std::size_t to = index_of((block.row + j) * patch.window.columns + block.column + i);
      patch.z[to] = block.z[from];
      Eigen::Vector2d slope = Eigen::Vector2d::Zero();
      std::int32_t cut = 0;
      if (block.move[from] >= 0) {
        const auto p = static_cast<std::size_t>(block.path[from]);
        const std::int32_t move = block.move[from];
        slope = slopes.at(p, move, {block.x[index_of(i)], block.y[index_of(j)]});
        cut = grids_[p].first_cut + paths_[p].moves()[static_cast<std::size_t>(move)].piece;
      }
      patch.slope_x[to] = slope.x();
      patch.slope_y[to] = slope.y();
      patch.cut[to] = cut;
    }
  }
}

void MilledField::sample(const GridWindow& window, const Executor& executor,
                         SurfacePatch& patch) const {
  resize_patch(window, true, patch);
  const std::int64_t across = (window.columns + kCutBlockSide - 1) / kCutBlockSide;
  const std::int64_t blocks = across * ((window.rows + kCutBlockSide - 1) / kCutBlockSide);
  const auto cut = [&](std::int64_t b) {
    Block block(window, b, blank_top_);
    for (std::size_t path = 0; path < paths_.size(); ++path) cut_block(path, block);
    write_block(block, patch);
  };
  parallel_for(executor, "milled surface", blocks, cut, 4);
}

}  // namespace lensforge
