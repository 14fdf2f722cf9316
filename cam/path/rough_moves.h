// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "cam/path/move.h"
#include "cam/path/operation.h"
#include "cam/path/stock_map.h"
#include "cam/workshop/tool.h"

namespace lensforge {

/// Writes moves down: hands them to the sink many at a time, adds them up, and takes what they cut
/// from the stock.
class RoughMoves {
 public:
  /// All references must outlive this; flush() is the caller's.
  RoughMoves(const Tool& tool, StockMap& stock, const MoveSink& sink, OperationSummary& summary);

  void rapid(const Eigen::Vector3d& end);
  void feed(MoveKind kind, const Eigen::Vector3d& end);
  /// The moves that are still held go to the sink.
  void flush();

  /// False before the first move: nothing is known of where the tool is.
  [[nodiscard]] bool placed() const { return placed_; }
  [[nodiscard]] const Eigen::Vector3d& at() const { return at_; }
  [[nodiscard]] const Extreme& deepest_cut() const { return deepest_; }

 private:
  void push(const PathMove& move);

  const Tool& tool_;
  CutterProfile profile_;
  StockMap& stock_;
  const MoveSink& sink_;
  OperationSummary& summary_;
  std::vector<PathMove> held_;
  bool placed_ = false;
  Eigen::Vector3d at_ = Eigen::Vector3d::Zero();
  Extreme deepest_;
};

}  // namespace lensforge
