// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace lensforge {

/// Purpose of a motion of the tool.
enum class MoveKind : std::uint8_t {
  kRapid,   ///< In air, as fast as the axes go.
  kPlunge,  ///< Down into material at the plunge feed, or a ramp or helix at it.
  kLink,    ///< At feed, in air or over finished surface.
  kCut,     ///< At the cutting feed.
};

/// One motion of the tool's tip from its current place to `end`: mm, lens frame (not the
/// program's).
struct PathMove {
  MoveKind kind = MoveKind::kCut;
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  /// Arcs lie in a plane x = const (G19), y = const (G18) or z = const (G17, a helix where z
  /// changes): the number of the axis that the plane is normal to, or -1 for a straight move.
  int arc_axis = -1;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< Of the arc.
  bool clockwise = false;  ///< G2: seen from the positive end of the normal axis.
  double feed = 0.0;       ///< mm/min; 0 for rapids.
};

/// Takes the moves of an operation in order, many at a time; the span is valid during the call.
using MoveSink = std::function<void(std::span<const PathMove>)>;

/// A short piece of a move.
struct MovePiece {
  Eigen::Vector3d from;
  Eigen::Vector3d to;
  double lowest;  ///< No point of the part is below this, mm.
  double reach;   ///< No point of it is farther than this from its middle, seen from above, mm.

  [[nodiscard]] Eigen::Vector2d middle() const { return 0.5 * (from + to).head<2>(); }
};

/// Cuts a straight move or an arc that begins at `begin` into pieces at most `length` mm long and
/// passes them to `take` in order; at least one piece.
void split_move(const Eigen::Vector3d& begin, const PathMove& move, double length,
                const std::function<void(const MovePiece&)>& take);

/// The largest value found, and its place.
struct Extreme {
  double value = 0.0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< Tip, mm, lens frame.
};

/// Bounds on every move of a finishing operation over its whole length, not only at its ends,
/// against the exact drop curve.
struct PathCertificate {
  Extreme gouge;   ///< Maximum depth of the path below the drop curve, mm, ≥ 0.
  Extreme excess;  ///< Maximum height of the path above it, mm, ≥ 0.
  /// Largest difference of mean slope over any 5 µm of a move where the ball shapes the surface,
  /// not only the rim, rad.
  Extreme slope;
};

/// Summary of one operation; mm, lens frame.
struct OperationSummary {
  std::string name;  ///< "rough", "semi", "finish", "cross", "pencil"
  int tool = 1;      ///< Tool::number
  bool complete = false;
  std::int64_t passes = 0;
  std::int64_t moves = 0;
  std::int64_t arcs = 0;
  double cutting_length = 0.0;
  double rapid_length = 0.0;
  double stepover = 0.0;    ///< As cut.
  double stepdown = 0.0;    ///< 0 where there are no levels.
  double allowance = 0.0;   ///< Material left on the surface on purpose.
  Eigen::AlignedBox3d tip;  ///< Of all moves at feed.
  PathCertificate certificate;
  bool certified = false;  ///< True if `certificate` was computed.
  std::vector<std::string> warnings;
  std::vector<std::string> remarks;  ///< Certified errors above what was aimed at.
};

/// Tabs that hold the part in its frame until it is snapped out.
struct TabOptions {
  int count = 4;        ///< ≥ 0
  double width = 3.0;   ///< Along the outline, at its narrowest, mm, > 0.
  double height = 0.8;  ///< Above the underside, mm, > 0.
};

}  // namespace lensforge
