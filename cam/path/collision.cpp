// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/collision.h"

#include <algorithm>
#include <cmath>

#include "cam/contact/profile_cutter.h"
#include "cam/path/operation.h"
#include "core/compute/scalar.h"
#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Depth by which a path may sink below surface and ramp, mm: passes are above the floor by at most
/// its slope times their spacing (PassGrid), which is less on slopes up to 0.9 with the default
/// spacing.
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

/// Samples the surface only where the rest leaves the result open.
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

/// Maximum descent that the surface allows the tip at the end of the stretch, mm, ≥ 0.
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

namespace {

/// Length of pieces of moves, mm: a cell of the stock map on blanks up to 200 mm.
constexpr double kPiece = 0.1;

/// Depth in the stock map's material below which a rapid move counts as in air, mm: the map
/// overstates material beside the cutter's path by the silhouette's rise over a cell.
constexpr double kRapidMargin = 0.05;

/// Depth below the table that is only rounding of a sum, mm.
constexpr double kTableMargin = 1e-9;

bool only_rises(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return to.z() >= from.z() && from.head<2>() == to.head<2>();
}

}  // namespace

/// One part of the tool that is too low somewhere.
struct CollisionCheck::Touch {
  const std::string& part;
  std::string obstacle;
  Eigen::Vector3d place;
  double depth;
};

std::string Collision::sentence() const {
  return "in '" + operation + "' tool " + std::to_string(tool) + " (" + part + ") touches " +
         obstacle + " in " + std::to_string(moves) + (moves == 1 ? " move" : " moves") +
         ", first at x " + decimal_text(first_place.x(), 1) + " y " +
         decimal_text(first_place.y(), 1) + ", by " + decimal_text(worst.value, 2) +
         " mm at most, at x " + decimal_text(worst.place.x(), 1) + " y " +
         decimal_text(worst.place.y(), 1);
}

CollisionCheck::CollisionCheck(const ProfileCutter& surface, const Workshop& workshop,
                               StockMap stock)
    : surface_(surface), workshop_(workshop), stock_(std::move(stock)), descents_(surface) {}

void CollisionCheck::begin(const std::string& operation, const Tool& tool,
                           const DescentRule& rule) {
  operation_ = operation;
  tool_ = &tool;
  placed_ = false;
  move_ = 0;
  highest_ = stock_.highest();
  parts_ = {{cutting_profile(tool), "cutter"}};
  for (const CutterProfile& profile : shank_profiles(tool)) {
    const bool flutes = parts_.size() == 1;
    parts_.push_back(
        {profile, flutes ? "tool above its flutes"
                         : "section of " + decimal_text(2.0 * profile.radius, 1) + " mm"});
  }
  last_move_.assign(collisions_.size(), -1);
  descents_.begin(operation, tool, rule);
}

void CollisionCheck::check(std::span<const PathMove> moves, const ProgramPlace& place) {
  LF_CHECK(tool_ != nullptr, "begin() first");
  place_ = place;
  for (const PathMove& move : moves) {
    if (!placed_) at_ = move.end;
    placed_ = true;
    check_table(move);
    check_boxes(move);
    check_material(move);
    at_ = move.end;
    ++move_;
  }
}

void CollisionCheck::place(const Eigen::Vector3d& at) {
  at_ = at;
  placed_ = true;
  descents_.rest();
}

/// No part of a tool is lower than its tip. An arc in an upright plane may hang below its ends.
void CollisionCheck::check_table(const PathMove& move) {
  const double table = stock_.blank().min().z() - kTableMargin;
  const bool hangs = move.arc_axis == 0 || move.arc_axis == 1;
  if (!hangs && std::min(at_.z(), move.end.z()) >= table) return;
  split_move(at_, move, kPiece, [&](const MovePiece& piece) {
    const double lowest = hangs ? piece.lowest : std::min(piece.from.z(), piece.to.z());
    if (lowest < table) note({parts_.front().name, kTableObstacle, piece.to, table - lowest});
  });
}

void CollisionCheck::check_boxes(const PathMove& move) {
  for (const KeepOut& box : workshop_.keep_outs) {
    const Eigen::AlignedBox3d body(box.low, box.high);
    split_move(at_, move, kPiece, [&](const MovePiece& piece) {
      if (piece.lowest >= box.high.z()) return;
      for (const Part& part : parts_) {
        const CutterProfile swept = widened(part.profile, piece.reach);
        const double depth = profile_box_tip(swept, piece.middle(), body) - piece.lowest;
        if (depth > 0.0) note({part.name, "the keep-out box '" + box.name + "'", piece.to, depth});
      }
    });
  }
}

/// Parts above all material need no search; the cutter is checked in rapid moves.
void CollisionCheck::check_material(const PathMove& move) {
  const bool rapid = move.kind == MoveKind::kRapid;
  if (rapid) descents_.rest();
  if (rapid && only_rises(at_, move.end)) return;
  split_move(at_, move, kPiece, [&](const MovePiece& piece) {
    for (std::size_t i = rapid ? 0 : 1; i < parts_.size(); ++i) {
      const CutterProfile& profile = parts_[i].profile;
      const double margin = i == 0 ? kRapidMargin : 0.0;
      const double lowest = piece.lowest + margin;
      if (lowest + profile.base >= highest_) continue;
      const double depth =
          stock_.drop(widened(profile, piece.reach), piece.middle(), lowest) - lowest;
      if (depth <= 0.0) continue;
      note({parts_[i].name, material_at(profile, piece.middle(), piece.lowest), piece.to, depth});
    }
    if (rapid) return;
    const double taken = stock_.cut(parts_[0].profile, piece.from, piece.to).taken;
    descents_.take(move, piece, taken, place_);
  });
}

std::string CollisionCheck::material_at(const CutterProfile& profile, const Eigen::Vector2d& p,
                                        double lowest) const {
  return surface_.drop(profile, p).tip > lowest ? "the lens" : "the blank";
}

void CollisionCheck::note(const Touch& touch) {
  const auto same = [&](const Collision& other) {
    return other.operation == operation_ && other.tool == tool_->number &&
           other.part == touch.part && other.obstacle == touch.obstacle;
  };
  auto found = std::find_if(collisions_.begin(), collisions_.end(), same);
  if (found == collisions_.end()) {
    Collision first;
    first.operation = operation_;
    first.tool = tool_->number;
    first.part = touch.part;
    first.obstacle = touch.obstacle;
    first.first_place = touch.place;
    collisions_.push_back(first);
    last_move_.push_back(-1);
    found = collisions_.end() - 1;
  }
  std::int64_t& last = last_move_[static_cast<std::size_t>(found - collisions_.begin())];
  if (last != move_) ++found->moves;
  last = move_;
  if (touch.depth > found->worst.value) found->worst = {touch.depth, touch.place};
}

}  // namespace lensforge
