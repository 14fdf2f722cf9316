// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/descent.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/text/number_text.h"

namespace lensforge {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// What cells of the stock map may show of material where there is none, mm.
constexpr double kThinMaterial = 0.01;

/// What a way may sink below surface and ramp, mm: passes are above the floor by its slope times
/// their spacing at most (PassGrid), which is less on slopes up to 0.9 with the default spacing.
constexpr double kSlack = 0.1;

/// F words are rounded.
constexpr double kFeedRounding = 1e-3;

}  // namespace

DescentRule descent_rule(const Process& process, const std::string& operation) {
  if (operation == "rough") {
    return {process.rough.ramp_angle_deg, process.rough.allowance, process.rough.spacing, {}};
  }
  if (operation == "semi") {
    return {process.semi.ramp_angle_deg, process.semi.allowance, process.semi.spacing, {}};
  }
  return {process.rough.ramp_angle_deg, 0.0, 0.0, {}};
}

std::string SteepDescent::sentence(const std::string& program) const {
  return program + " line " + std::to_string(first.line) + ": in '" + operation + "' tool " +
         std::to_string(tool.number) + " goes down into material at " + decimal_text(angle_deg, 0) +
         " degrees and F" + trimmed_decimal(feed, 0) + ", at x " + decimal_text(place.x(), 2) +
         " y " + decimal_text(place.y(), 2) +
         (moves > 1 ? ", and in " + std::to_string(moves - 1) + " more moves" : "") +
         "; steeper than its ramp of " + trimmed_decimal(ramp_angle_deg, 1) +
         " degrees it may only at its plunge feed, F" + trimmed_decimal(tool.plunge, 0);
}

void DescentCheck::begin(const std::string& operation, const Tool& tool, const DescentRule& rule) {
  operation_ = operation;
  tool_ = tool;
  const Eigen::AlignedBox3d& all = surface_.bounds();
  const Eigen::AlignedBox2d whole(Eigen::Vector2d(all.min().head<2>()),
                                  Eigen::Vector2d(all.max().head<2>()));
  floor_.emplace(surface_, tool, rule.allowance, rule.rim.isEmpty() ? whole : rule.rim);
  ramp_angle_deg_ = rule.ramp_angle_deg;
  ramp_ = std::tan(rule.ramp_angle_deg * kDegree);
  allowed_ = std::max(kSlack, rule.spacing);
  last_ = {};
  rest();
}

/// The surface is asked only where what is known without it does not do.
void DescentCheck::take(const PathMove& move, const MovePiece& piece, double taken,
                        const ProgramPlace& place) {
  if (move.feed <= tool_.plunge * (1.0 + kFeedRounding)) return rest();
  if (sunk_ == 0.0) start_ = piece.from;
  const Eigen::Vector3d way = piece.to - piece.from;
  const double down = std::min(-way.z(), taken > kThinMaterial ? taken : 0.0);
  sunk_ = std::max(0.0, sunk_ + down - ramp_ * way.head<2>().norm());
  if (sunk_ <= allowed_) return;
  sunk_ = std::max(0.0, sunk_ - surface_drop(piece.to));
  start_ = piece.to;
  if (sunk_ <= allowed_) return;
  note(move, piece, place);
  rest();
}

/// How much lower the surface lets the tip go at the end of the stretch, mm, ≥ 0.
double DescentCheck::surface_drop(const Eigen::Vector3d& to) {
  const double before = floor_->over_surface(start_.head<2>(), 0.0, trace_);
  const double after = floor_->over_surface(to.head<2>(), 0.0, trace_);
  return std::isfinite(before) && std::isfinite(after) ? std::max(0.0, before - after) : 0.0;
}

void DescentCheck::note(const PathMove& move, const MovePiece& piece, const ProgramPlace& place) {
  const auto same = [&](const SteepDescent& other) {
    return other.operation == operation_ && other.tool.number == tool_.number;
  };
  auto found = std::find_if(descents_.begin(), descents_.end(), same);
  if (found == descents_.end()) {
    const Eigen::Vector3d way = piece.to - piece.from;
    SteepDescent first;
    first.operation = operation_;
    first.tool = tool_;
    first.first = place;
    first.place = piece.to;
    first.angle_deg = std::atan2(-way.z(), way.head<2>().norm()) / kDegree;
    first.feed = move.feed;
    first.ramp_angle_deg = ramp_angle_deg_;
    descents_.push_back(first);
    found = descents_.end() - 1;
  } else if (last_.program == place.program && last_.line == place.line) {
    return;
  }
  last_ = place;
  ++found->moves;
}

}  // namespace lensforge
