// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/rough_moves.h"

namespace lensforge {
namespace {

constexpr std::size_t kHeld = 4096;  ///< Moves handed on at a time.

}  // namespace

RoughMoves::RoughMoves(const Tool& tool, StockMap& stock, const MoveSink& sink,
                       OperationSummary& summary)
    : tool_(tool), profile_(cutting_profile(tool)), stock_(stock), sink_(sink), summary_(summary) {}

void RoughMoves::rapid(const Eigen::Vector3d& end) {
  if (placed_) summary_.rapid_length += (end - at_).norm();
  push({MoveKind::kRapid, end});
}

void RoughMoves::feed(MoveKind kind, const Eigen::Vector3d& end) {
  PathMove move{kind, end};
  move.feed = kind == MoveKind::kPlunge ? tool_.plunge : tool_.feed;
  const Extreme depth = stock_.cut(profile_, at_, end).deepest;
  if (depth.value > deepest_.value) deepest_ = depth;
  summary_.cutting_length += (end - at_).norm();
  summary_.tip.extend(at_);
  summary_.tip.extend(end);
  push(move);
}

void RoughMoves::push(const PathMove& move) {
  held_.push_back(move);
  ++summary_.moves;
  at_ = move.end;
  placed_ = true;
  if (held_.size() >= kHeld) flush();
}

void RoughMoves::flush() {
  if (!held_.empty()) sink_(held_);
  held_.clear();
}

}  // namespace lensforge
