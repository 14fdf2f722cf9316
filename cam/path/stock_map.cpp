// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/stock_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/error.h"

namespace lensforge {
namespace {

constexpr int kBlock = 16;  ///< Cells along a block's side.

}  // namespace

StockMap::StockMap(const Eigen::AlignedBox3d& blank, double cell) : blank_(blank), cell_(cell) {
  LF_CHECK(cell > 0.0 && !blank.isEmpty(), std::to_string(cell));
  const Eigen::Vector3d size = blank.sizes();
  columns_ = std::max(1, static_cast<int>(std::ceil(size.x() / cell - 1e-9)));
  rows_ = std::max(1, static_cast<int>(std::ceil(size.y() / cell - 1e-9)));
  heights_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_),
                  blank.max().z());
  block_columns_ = (columns_ + kBlock - 1) / kBlock;
  const int block_rows = (rows_ + kBlock - 1) / kBlock;
  blocks_.assign(static_cast<std::size_t>(block_columns_) * static_cast<std::size_t>(block_rows),
                 {blank.max().z(), false});
}

Eigen::Vector2d StockMap::centre(int column, int row) const {
  return blank_.min().head<2>() + cell_ * Eigen::Vector2d(column + 0.5, row + 0.5);
}

StockMap::Window StockMap::cells_in(const Eigen::Vector2d& p, double radius) const {
  const Eigen::Vector2d local = p - blank_.min().head<2>();
  const auto at = [&](double place, int cells) {
    return static_cast<int>(std::clamp(std::floor(place / cell_), -1.0, 1.0 * cells));
  };
  return {std::max(0, at(local.x() - radius, columns_)),
          std::min(columns_ - 1, at(local.x() + radius, columns_)),
          std::max(0, at(local.y() - radius, rows_)),
          std::min(rows_ - 1, at(local.y() + radius, rows_))};
}

/// Distance from p to the nearest point of a rectangle of cells.
double StockMap::distance(const Eigen::Vector2d& p, const Window& cells) const {
  const Eigen::Vector2d local = p - blank_.min().head<2>();
  const double dx = std::max(
      {cells.column_begin * cell_ - local.x(), local.x() - (cells.column_end + 1) * cell_, 0.0});
  const double dy =
      std::max({cells.row_begin * cell_ - local.y(), local.y() - (cells.row_end + 1) * cell_, 0.0});
  return std::sqrt(dx * dx + dy * dy);
}

bool StockMap::under(const CutterProfile& profile, const Eigen::Vector2d& p) const {
  const Window cells = cells_in(p, profile.radius);
  if (cells.column_begin > cells.column_end || cells.row_begin > cells.row_end) return false;
  return distance(p, {0, columns_ - 1, 0, rows_ - 1}) <= profile.radius;
}

StockCut StockMap::cut(const CutterProfile& profile, const Eigen::Vector3d& from,
                       const Eigen::Vector3d& to) {
  StockCut cut;
  const auto steps = std::max<std::int64_t>(
      1, static_cast<std::int64_t>(std::ceil((to - from).head<2>().norm() / cell_)));
  // Where the same cutter was last, everything is already cut.
  const bool goes_on = last_tip_ == from && last_profile_ == profile;
  for (std::int64_t i = goes_on ? 1 : 0; i <= steps; ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(steps);
    stamp(profile, from + part * (to - from), cut);
  }
  last_tip_ = to;
  last_profile_ = profile;
  // A disc of this radius certainly contains a whole cell.
  if (profile.radius < std::numbers::sqrt2 * cell_) cut.taken = cut.deepest.value;
  return cut;
}

/// Lowers the cells that lie wholly under the cutter to its silhouette at their farthest corner. A
/// ball's rises by more than d²/(2R): material below that is skipped without a root.
void StockMap::stamp(const CutterProfile& profile, const Eigen::Vector3d& tip, StockCut& cut) {
  const Window cells = cells_in(tip.head<2>(), profile.radius);
  const double half = 0.5 * cell_;
  const double rise = profile.flat() == 0.0 ? 0.5 / profile.corner : 0.0;
  const double lowest = tip.z() + profile.base;
  for (int row = cells.row_begin; row <= cells.row_end; ++row) {
    const double dy = std::fabs(blank_.min().y() + row * cell_ + half - tip.y());
    for (int column = cells.column_begin; column <= cells.column_end; ++column) {
      double& height = heights_[index(column, row)];
      const double dx = std::fabs(blank_.min().x() + column * cell_ + half - tip.x());
      if (height <= lowest + rise * (dx * dx + dy * dy)) continue;
      const double centre = std::sqrt(dx * dx + dy * dy);
      const double depth = height - tip.z() - profile.height(centre);
      if (depth > cut.deepest.value) cut.deepest = {depth, tip};
      const double far = std::sqrt((dx + half) * (dx + half) + (dy + half) * (dy + half));
      const double lowered = tip.z() + profile.height(far);
      if (!(lowered < height)) continue;
      cut.taken = std::max(cut.taken, height - lowered);
      height = lowered;
      blocks_[static_cast<std::size_t>(row / kBlock) * static_cast<std::size_t>(block_columns_) +
              static_cast<std::size_t>(column / kBlock)]
          .stale = true;
    }
  }
}

StockMap::Window StockMap::cells_of(int block_column, int block_row) const {
  return {block_column * kBlock, std::min(columns_, (block_column + 1) * kBlock) - 1,
          block_row * kBlock, std::min(rows_, (block_row + 1) * kBlock) - 1};
}

double StockMap::block_height(int block_column, int block_row) {
  Block& block =
      blocks_[static_cast<std::size_t>(block_row) * static_cast<std::size_t>(block_columns_) +
              static_cast<std::size_t>(block_column)];
  if (!block.stale) return block.highest;
  const Window cells = cells_of(block_column, block_row);
  block = {kNoContact, false};
  for (int row = cells.row_begin; row <= cells.row_end; ++row) {
    for (int column = cells.column_begin; column <= cells.column_end; ++column) {
      block.highest = std::max(block.highest, height(column, row));
    }
  }
  return block.highest;
}

double StockMap::highest() {
  double highest = kNoContact;
  for (int row = 0; row * kBlock < rows_; ++row) {
    for (int column = 0; column < block_columns_; ++column) {
      highest = std::max(highest, block_height(column, row));
    }
  }
  return highest;
}

double StockMap::drop(const CutterProfile& profile, const Eigen::Vector2d& p, double above) {
  double best = above;
  const Window all = cells_in(p, profile.radius);
  for (int block_row = all.row_begin / kBlock; block_row * kBlock <= all.row_end; ++block_row) {
    for (int block_column = all.column_begin / kBlock; block_column * kBlock <= all.column_end;
         ++block_column) {
      const Window block = cells_of(block_column, block_row);
      const double nearest = profile.height(distance(p, block));
      if (!(block_height(block_column, block_row) - nearest > best)) continue;
      const Window cells = {std::max(all.column_begin, block.column_begin),
                            std::min(all.column_end, block.column_end),
                            std::max(all.row_begin, block.row_begin),
                            std::min(all.row_end, block.row_end)};
      for (int row = cells.row_begin; row <= cells.row_end; ++row) {
        for (int column = cells.column_begin; column <= cells.column_end; ++column) {
          const double near = distance(p, {column, column, row, row});
          best = std::max(best, height(column, row) - profile.height(near));
        }
      }
    }
  }
  return best;
}

Extreme most_left(const StockMap& stock, const ProfileCutter& surface, const Executor& executor) {
  const Eigen::Vector2i shape = stock.shape();
  std::vector<Extreme> rows(static_cast<std::size_t>(shape.y()));
  const auto search = [&](std::int64_t row) {
    Extreme& most = rows[static_cast<std::size_t>(row)];
    CutterLocation last;
    for (int column = 0; column < shape.x(); ++column) {
      const Eigen::Vector2d p = stock.centre(column, static_cast<int>(row));
      last = surface.drop({}, p, last);
      if (!last.rests()) continue;
      const double left = stock.height(column, static_cast<int>(row)) - last.tip;
      if (left > most.value) most = {left, {p.x(), p.y(), last.tip}};
    }
  };
  parallel_for(executor, "material left", shape.y(), search, 1);
  const auto less = [](const Extreme& a, const Extreme& b) { return a.value < b.value; };
  return *std::max_element(rows.begin(), rows.end(), less);
}

}  // namespace lensforge
