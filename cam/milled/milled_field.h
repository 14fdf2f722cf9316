// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "cam/milled/ball_sweep.h"
#include "core/lens/surface_field.h"

namespace lensforge {

/// Surface that programs leave of a blank: the lower envelope of the balls swept along every move,
/// in double precision; slopes are those of the ball that touched the node last
/// (MilledField.EqualsBruteForce…).
///
/// `cut` is 0 where the blank's top was not touched; else the piece of the path (BallPath), counted
/// through all paths from 1.
class MilledField final : public SurfaceField {
 public:
  /// @param paths      of one blank, each of one ball; moves above the blank cost nothing.
  /// @param blank_top  mm, lens frame.
  MilledField(std::vector<BallPath> paths, double blank_top);

  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override;

 private:
  /// A part of a move no longer than a cell: box of the ball's centre seen from above and its least
  /// z, rounded outwards.
  struct Span {
    float x_min, x_max, y_min, y_max, z_min;
    std::int32_t move;
  };
  /// Spans in the cell of their box's centre.
  struct SpanGrid {
    Eigen::Vector2d origin{0.0, 0.0};
    double cell = 0.0;  ///< Side of a cell, mm.
    std::int64_t columns = 0;
    std::int64_t rows = 0;
    std::vector<std::int64_t> begin;  ///< First span of each cell, row by row, and the end.
    std::vector<Span> spans;
    std::int32_t first_cut = 1;  ///< Of the path's pieces.
  };
  /// A span; above a plane through the block, where its ball touches a parallel one, and a height
  /// below which it cuts no node of the block.
  struct Candidate {
    double bound;
    double touch_height;
    std::int64_t span;
  };
  class MoveSlopes;
  struct NodeRange;
  struct Block;

  static std::vector<Span> spans_of(const BallPath& path, double blank_top);
  static SpanGrid make_grid(const std::vector<Span>& spans, double cell);
  template <class Action>
  static void for_each_span(const SpanGrid& grid, const Block& block, const Action& action);
  static Eigen::Vector2d mean_slope(const SpanGrid& grid, const std::vector<Candidate>& spans);
  [[nodiscard]] std::vector<Candidate> candidates_of(std::size_t path, Block& block) const;
  void cut_block(std::size_t path, Block& block) const;
  void write_block(const Block& block, SurfacePatch& patch) const;

  std::vector<BallPath> paths_;
  std::vector<SpanGrid> grids_;
  double blank_top_;
};

}  // namespace lensforge
