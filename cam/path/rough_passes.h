// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "cam/path/operation.h"
#include "cam/path/stock_map.h"
#include "cam/path/tip_floor.h"
#include "cam/workshop/tool.h"
#include "cam/workshop/workshop.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"

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

/// Parallel passes over a rectangle and how closely the surface is asked for along them.
struct PassLayout {
  Eigen::AlignedBox2d area;      ///< Of the tool's axis, mm.
  Eigen::AlignedBox2d material;  ///< Where the axis is when the tool is over the blank, mm.
  PassAxis along = PassAxis::kX;
  double stepover = 1.0;  ///< Between passes at most, mm, > 0.
  double spacing = 0.1;   ///< Between nodes along them at most, mm, > 0.
};

/// Tips of the tool in the order of travel, mm, lens frame; two at least.
using TipPath = std::vector<Eigen::Vector3d>;

/// A part of a pass. Where a clamp lifts the tip off the surface, the part runs level.
struct PassPart {
  TipPath path;
  bool lifted = false;  ///< By a clamp.
};

/// The lowest that the tip may run along parallel passes. Heights belong to nodes, evenly spaced;
/// a straight move between neighbouring nodes that is nowhere below them stays above the floor over
/// its whole length, because each node is as high as the floor over the intervals beside it
/// (TipFloor::over), not only as the floor at its place.
class PassGrid {
 public:
  /// @throw Interrupted if `control` asks for an end.
  PassGrid(const TipFloor& floor, const PassLayout& layout, const Executor& executor,
           const RunControl& control);

  [[nodiscard]] std::int64_t passes() const { return passes_; }
  /// Of neighbouring passes as laid out, mm.
  [[nodiscard]] double stepover() const { return stepover_; }
  /// Lowest of all nodes, mm.
  [[nodiscard]] double lowest() const;
  /// Highest that a node is above the floor at its very place, mm; between nodes it can be more by
  /// the floor's slope times half a spacing.
  [[nodiscard]] Extreme excess() const;

  /// The parts of a pass that have something to cut between the heights `previous` and `level`:
  /// where its nodes are over the material and below `previous`, with one node beyond at either
  /// end. The tip follows the nodes but never goes below `level`; chords are nowhere below the
  /// nodes and at most a tenth of the spacing above them. A pass is divided beside every clamp, and
  /// no part goes up or down along one: how the tool gets from part to part is for links.
  [[nodiscard]] std::vector<PassPart> parts(std::int64_t pass, double level, double previous) const;

 private:
  [[nodiscard]] Eigen::Vector2d place(std::int64_t pass, double node) const;
  [[nodiscard]] double node(std::int64_t pass, std::int64_t i) const {
    return nodes_[static_cast<std::size_t>(pass * count_ + i)];
  }
  void fill(std::int64_t pass, const TipFloor& floor);
  [[nodiscard]] bool lifted(std::int64_t pass, std::int64_t i, double level) const;
  void divide(std::int64_t pass, std::int64_t begin, std::int64_t end, double level,
              double previous, std::vector<PassPart>& parts) const;
  [[nodiscard]] TipPath level_part(std::int64_t pass, std::int64_t begin, std::int64_t end,
                                   double level) const;
  [[nodiscard]] TipPath chords(std::int64_t pass, std::int64_t begin, std::int64_t end,
                               double level) const;

  PassLayout layout_;
  std::int64_t passes_;
  std::int64_t count_;  ///< Nodes a pass.
  double stepover_;
  double spacing_;
  std::vector<double> nodes_;
  std::vector<double> ground_;   ///< Nodes as they were without clamps; empty where there are none.
  std::vector<Extreme> excess_;  ///< One a pass.
};

/// What links need to know of an operation. All references must outlive them.
struct LinkSite {
  const Workshop& workshop;
  const Tool& tool;
  const TipFloor& floor;
  StockMap& stock;
  double safe_z = 0.0;  ///< Of rapid moves, mm.
  double ramp_angle_deg = 3.0;
  double helix_radius = 0.0;  ///< Of the axis' circle when entering, mm; 0 for ramps.
  double spacing = 0.1;       ///< Of points at which floor and stock are asked for, mm.
};

/// Nothing of blank and clamps is higher than this, mm.
double highest_obstacle(const Workshop& workshop, const Eigen::AlignedBox3d& blank);

/// Height of rapid moves in a workshop: Process::safe_height above blank and clamps, mm.
double safe_height_of(const Workshop& workshop, const Eigen::AlignedBox3d& blank);

/// Ways from one pass to the next.
class RoughLinks {
 public:
  RoughLinks(const LinkSite& site, RoughMoves& moves);

  /// To the beginning of `path` and into the material there, if there is any, no steeper against
  /// path and floor than the ramp angle: down a helix through that beginning, counter-clockwise,
  /// which a tool that turns clockwise cuts in climb, where one of four circles is nowhere steep;
  /// else along the path, to and fro. Ends at the beginning of the path.
  void enter(const TipPath& path);

  /// Straight to `end` at feed, no lower than `level` and the floor, which may cut.
  /// @return false, and does nothing, if the floor on the way is above the blank, if a clamp lifts
  ///         it, or if the end is so far below the way that the tool would have to plunge to it.
  bool cross(const Eigen::Vector3d& end, double level);

  /// Up to the safe height.
  void retract();

 private:
  [[nodiscard]] std::optional<double> clear_height(const Eigen::Vector3d& to);
  [[nodiscard]] double air_above(const Eigen::Vector2d& p);
  void travel(const Eigen::Vector3d& to);
  bool helix(const TipPath& path);
  void lift_to_floor(TipPath& circle) const;
  void wind_down(const TipPath& circle);
  void ramp(const TipPath& path, double lift);

  LinkSite site_;
  RoughMoves& moves_;
  std::vector<CutterProfile> parts_;
};

}  // namespace lensforge
