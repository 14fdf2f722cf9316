// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "cam/contact/profile_cutter.h"
#include "cam/path/operation.h"
#include "cam/path/stock_map.h"
#include "cam/workshop/tool.h"
#include "cam/workshop/workshop.h"
#include "core/compute/executor.h"

namespace lensforge {

/// Records moves: passes them to the sink many at a time, sums them up, and removes their cuts from
/// the stock.
class RoughMoves {
 public:
  /// All references must outlive this. The caller calls flush().
  RoughMoves(const Tool& tool, StockMap& stock, const MoveSink& sink, OperationSummary& summary);

  void rapid(const Eigen::Vector3d& end);
  void feed(MoveKind kind, const Eigen::Vector3d& end);
  /// Passes the moves still held to the sink.
  void flush();

  /// False before the first move: the tool's place is unknown.
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

/// Parallel passes over a rectangle, and the sampling of the surface along them.
struct PassLayout {
  Eigen::AlignedBox2d area;      ///< Of the tool's axis, mm.
  Eigen::AlignedBox2d material;  ///< Region of the axis where the tool is over the blank, mm.
  PassAxis along = PassAxis::kX;
  double stepover = 1.0;  ///< Maximum distance of passes, mm, > 0.
  double spacing = 0.1;   ///< Maximum distance of nodes along them, mm, > 0.
};

/// Tips of the tool in the order of travel, mm, lens frame; at least two.
using TipPath = std::vector<Eigen::Vector3d>;

/// A part of a pass. Where a clamp lifts the tip off the surface, the part runs level.
struct PassPart {
  TipPath path;
  bool lifted = false;  ///< By a clamp.
};

/// Minimum heights of the tip along parallel passes, at evenly spaced nodes. A straight move
/// between neighbouring nodes that is nowhere below them stays above the floor over its whole
/// length, because each node is as high as the floor over the intervals beside it (TipFloor::over).
class PassGrid {
 public:
  /// @throw Interrupted if `control` asks for an end.
  PassGrid(const TipFloor& floor, const PassLayout& layout, const Executor& executor,
           const RunControl& control);

  [[nodiscard]] std::int64_t passes() const { return passes_; }
  /// Distance of neighbouring passes as laid out, mm.
  [[nodiscard]] double stepover() const { return stepover_; }
  /// Lowest of all nodes, mm.
  [[nodiscard]] double lowest() const;
  /// Maximum height of a node above the floor at its own place, mm; between nodes it can be more by
  /// the floor's slope times half a spacing.
  [[nodiscard]] Extreme excess() const;

  /// The parts of a pass with something to cut between the heights `previous` and `level`: nodes
  /// over the material and below `previous`, and one more at either end. The tip follows the nodes
  /// but never goes below `level`; chords are nowhere below the nodes and at most a tenth of the
  /// spacing above them. A pass is divided beside every clamp, and no part goes up or down along
  /// one; RoughLinks connects the parts.
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
  std::int64_t count_;  ///< Nodes per pass.
  double stepover_;
  double spacing_;
  std::vector<double> nodes_;
  std::vector<double> ground_;   ///< Nodes without clamps; empty if there are none.
  std::vector<Extreme> excess_;  ///< One per pass.
};

/// Inputs of the links of an operation. All references must outlive them.
struct LinkSite {
  const Workshop& workshop;
  const Tool& tool;
  const TipFloor& floor;
  StockMap& stock;
  double safe_z = 0.0;  ///< Of rapid moves, mm.
  double ramp_angle_deg = 3.0;
  double helix_radius = 0.0;  ///< Of the axis's circle when entering, mm; 0 for ramps.
  double spacing = 0.1;       ///< Distance of points at which floor and stock are sampled, mm.
};

/// Height of the highest point of blank and clamps, mm.
double highest_obstacle(const Workshop& workshop, const Eigen::AlignedBox3d& blank);

/// Height of rapid moves in a workshop: Process::safe_height above blank and clamps, mm.
double safe_height_of(const Workshop& workshop, const Eigen::AlignedBox3d& blank);

/// Links from one pass to the next.
class RoughLinks {
 public:
  RoughLinks(const LinkSite& site, RoughMoves& moves);

  /// Moves to the beginning of `path` and into any material there, no steeper against path and
  /// floor than the ramp angle: down a helix through that beginning, counter-clockwise (climb for a
  /// tool that turns clockwise), if one of four circles is nowhere too steep; else to and fro along
  /// the path. Ends at the beginning of the path.
  void enter(const TipPath& path);

  /// Goes straight to `end` at feed, no lower than `level` and the floor; may cut.
  /// @return false, without moving, if the floor on the way is above the blank, if a clamp lifts
  ///         it, or if the end is so far below that the tool would have to plunge.
  bool cross(const Eigen::Vector3d& end, double level);

  /// Goes up to the safe height.
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

/// Common inputs of the operations before finishing. All references must outlive them.
struct RoughSite {
  const ProfileCutter& surface;  ///< A height field over its box's rectangle.
  const Workshop& workshop;      ///< Validated.
  StockMap& stock;               ///< Current stock; the operation takes its cut from it.
};

/// Result of an operation before finishing.
struct RoughResult {
  /// Its certificate: gouge 0 into the surface with the allowance over the whole of every move;
  /// excess over the drop curve with the allowance at all sampled points; chords between them add
  /// at most a tenth of their spacing.
  OperationSummary summary;
  Extreme deepest_cut;  ///< Material above the cutter's silhouette, mm, from StockMap::cut().
  Extreme most_left;    ///< Material left on the surface, mm, from most_left().
};

/// The blank of a workshop around a surface, in cells of 0.1 mm, or larger ones on blanks above 200
/// mm.
StockMap whole_blank(const Workshop& workshop, const Eigen::AlignedBox3d& surface);

/// Distance beyond a surface's rectangle to which cut_rough() and cut_semi() remove material in a
/// blank that is wider than that by more than a tool's radius, mm. @param top  of the blank, mm.
double rough_reach(const Workshop& workshop, const Eigen::AlignedBox3d& surface, double top);

/// Cuts the blank down to the surface plus the allowance, level by level. Passes on a level run at
/// its height where the surface is below it, and follow the surface near where the level above
/// ended. The depth of cut is the stepdown plus only what passes leave between them on slopes.
/// Beyond the lens it clears the room that later tools, with their shanks, need.
///
/// The tool enters material along its pass, to and fro, no steeper than the ramp angle against the
/// pass, or down a helix where one fits (EntryStyle), never straight down. Between neighbouring
/// passes it stays down; elsewhere it takes the quicker of a link at feed just above all remaining
/// material and a rapid at the safe height. It goes around clamps; a warning states what stays
/// uncut under them.
/// @throw Interrupted if `control` asks for an end; `sink` has then received part of a cut.
RoughResult cut_rough(const RoughSite& site, const Executor& executor, const MoveSink& sink,
                      const RunControl& control);

/// One raster on the surface plus its allowance; enters and links as cut_rough() does.
RoughResult cut_semi(const RoughSite& site, const Executor& executor, const MoveSink& sink,
                     const RunControl& control);

}  // namespace lensforge
