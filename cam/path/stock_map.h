// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <vector>

#include "cam/contact/profile_cutter.h"
#include "cam/path/operation.h"
#include "cam/workshop/tool.h"
#include "core/compute/executor.h"

namespace lensforge {

/// Height of material that cells of a StockMap, upper bounds, may show where there is none, mm.
inline constexpr double kThinMaterial = 0.01;

/// Result of a cut of a StockMap.
struct StockCut {
  /// Maximum height of the material above the cutter's silhouette, mm, and the tip there: the depth
  /// of cut, sampled at the centres of cells; 0 in air.
  Extreme deepest;
  /// Maximum lowering of a cell, mm; 0 where the cutter was before. For a cutter so narrow that it
  /// may pass without lowering any cell, the depth.
  double taken = 0.0;
};

/// Remaining stock during a cut: for each cell of a grid an upper bound of the material's height. A
/// cell is lowered only to where the cutter has swept all of it. The bound exceeds the true height
/// by at most the rise of the cutter's silhouette and path over a cell.
class StockMap {
 public:
  /// @param blank  box of the material, mm, lens frame.
  /// @param cell   maximum side of a cell, mm, > 0.
  StockMap(const Eigen::AlignedBox3d& blank, double cell);

  /// Removes the material that the cutter sweeps on a straight move of its tip. mm.
  StockCut cut(const CutterProfile& profile, const Eigen::Vector3d& from,
               const Eigen::Vector3d& to);

  /// Lowest height of the tip over p at which the profile certainly touches no material, mm;
  /// kNoContact if there is none under it. @param above  is returned instead of any lower height;
  /// higher values make the search faster.
  [[nodiscard]] double drop(const CutterProfile& profile, const Eigen::Vector2d& p,
                            double above = kNoContact);

  /// True if the profile over p covers part of the blank, seen from above.
  [[nodiscard]] bool under(const CutterProfile& profile, const Eigen::Vector2d& p) const;

  [[nodiscard]] const Eigen::AlignedBox3d& blank() const { return blank_; }
  /// Side of a cell, mm.
  [[nodiscard]] double cell() const { return cell_; }
  /// No material is above this, mm.
  [[nodiscard]] double highest();
  /// Cells along x and along y.
  [[nodiscard]] Eigen::Vector2i shape() const { return {columns_, rows_}; }
  [[nodiscard]] Eigen::Vector2d centre(int column, int row) const;
  [[nodiscard]] double height(int column, int row) const { return heights_[index(column, row)]; }

 private:
  /// Square of cells with an upper bound of their heights, updated on demand.
  struct Block {
    double highest;
    bool stale;
  };
  /// Cells or blocks that a disc may touch: first and last, both included.
  struct Window {
    int column_begin, column_end, row_begin, row_end;
  };

  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  [[nodiscard]] Window cells_in(const Eigen::Vector2d& p, double radius) const;
  [[nodiscard]] double distance(const Eigen::Vector2d& p, const Window& cells) const;
  void stamp(const CutterProfile& profile, const Eigen::Vector3d& tip, StockCut& cut);
  [[nodiscard]] Window cells_of(int block_column, int block_row) const;
  double block_height(int block_column, int block_row);

  Eigen::AlignedBox3d blank_;
  double cell_;
  int columns_;
  int rows_;
  int block_columns_;
  std::vector<double> heights_;
  std::vector<Block> blocks_;
  Eigen::Vector3d last_tip_{HUGE_VAL, HUGE_VAL, HUGE_VAL};  ///< Where the last cut ended.
  CutterProfile last_profile_;
};

/// The most material left on a surface: height of the stock above it, as an upper bound at the
/// cells' centres, and the place. Between centres it can be more by the surface's slope times 0.71
/// cells. @param surface  a height field.
Extreme most_left(const StockMap& stock, const ProfileCutter& surface, const Executor& executor);

}  // namespace lensforge
