// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "machine/gcode/gcode_motion.h"

namespace lensforge {

/// The part of an arc between two shares of its sweep, without its rise.
Arc part_of(const Arc& arc, double from, double to);

/// A straight or circular move of the ball's centre; mm, lens frame.
struct BallMove {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  std::int32_t piece = 0;  ///< See BallPath.
  std::int32_t arc = -1;   ///< In BallPath::arcs(); −1 for a straight move.
};

/// All motions of a program's ball-end mill as moves of the ball's centre.
///
/// Moves are numbered by pieces, each of which leaves one smooth strip. A new piece begins where
/// the path is interrupted, where its heading has turned by more than 60° since the piece began
/// (the next row of a raster), and where it goes over a ridge: where it turns downwards by more
/// than kRidgeAngle at once, or as sharply as a ball that rolls over a ridge of radius
/// kRidgeRadius.
class BallPath {
 public:
  static constexpr double kRidgeAngle = 0.01;   ///< rad
  static constexpr double kRidgeRadius = 0.02;  ///< mm

  /// @param radius    of the ball, mm, > 0.
  /// @param z_offset  program Z − lens-frame z, mm.
  BallPath(double radius, double z_offset);

  /// Appends a motion of the tool's tip in program coordinates. Arcs become sub-arcs of at most a
  /// third of a turn, helices chords within kHelixError of them.
  void add(const GcodeMotion& motion);

  [[nodiscard]] double radius() const { return radius_; }
  [[nodiscard]] const std::vector<BallMove>& moves() const { return moves_; }
  /// Arcs of the ball's centre for the moves that are not straight; rise 0.
  [[nodiscard]] const std::vector<Arc>& arcs() const { return arcs_; }
  /// Pieces are numbered 0 … pieces() − 1.
  [[nodiscard]] std::int32_t pieces() const { return piece_ + 1; }

  static constexpr double kHelixError = 1e-6;  ///< mm

 private:
  /// Direction of the path at an end of a move.
  struct Tangent {
    Eigen::Vector2d heading = Eigen::Vector2d::Zero();  ///< Unit; zero for straight up or down.
    double incline = 0.0;                               ///< Angle above the horizontal, rad.
  };

  static Tangent make_tangent(const Eigen::Vector3d& direction);
  void add_straight(const Eigen::Vector3d& start, const Eigen::Vector3d& end);
  void add_arc(const Arc& arc);
  void add_move(BallMove move, const Eigen::Vector3d& begin, const Eigen::Vector3d& end);
  [[nodiscard]] bool begins_piece(const BallMove& move, const Tangent& begin, const Tangent& end,
                                  double length) const;
  [[nodiscard]] bool rolls_over_ridge(const BallMove& move) const;

  double radius_;
  double lift_;  ///< From the programmed tip to the ball's centre, mm.
  std::vector<BallMove> moves_;
  std::vector<Arc> arcs_;
  std::int32_t piece_ = -1;
  Eigen::Vector2d piece_heading_ = Eigen::Vector2d::Zero();  ///< Where the piece began.
  Tangent last_;                                             ///< Where the last move ended.
  double last_length_ = 0.0;
  bool after_ridge_ = false;
};

// The lower envelope of a ball that is swept along one move.
//
// Notation: R ball radius, c(s) path of its centre, q a place seen from above. The ball cuts down
// to
//     z(q) = min over s of  c.z(s) − √(R² − |q − c.xy(s)|²).
// The minimum lies at an end of the path or where the derivative is zero; the surface's normal
// there is the ball's, (c − (q, z))/R. In a vertical plane at the distance w from that of the path
// the ball is a circle of radius r = √(R² − w²).

/// Height of a place over which no ball passes.
inline constexpr double kUncut = std::numeric_limits<double>::infinity();

/// Height of the lower side of a ball around `centre` over q; kUncut outside of it.
inline double ball_below(const Eigen::Vector3d& centre, double radius, double x, double y) {
  const double dx = x - centre.x();
  const double dy = y - centre.y();
  const double room = radius * radius - (dx * dx + dy * dy);
  // The root is taken in any case: a branch around it is often mispredicted.
  const double below = centre.z() - std::sqrt(std::max(room, 0.0));
  return room >= 0.0 ? below : kUncut;
}

/// Slopes of a ball's lower side over q. @pre q is under the ball.
inline Eigen::Vector2d ball_slope(const Eigen::Vector3d& centre, double radius,
                                  const Eigen::Vector2d& q) {
  const Eigen::Vector2d offset = q - centre.head<2>();
  return offset / std::sqrt(std::max(radius * radius - offset.squaredNorm(), 0.0));
}

/// A straight move, prepared. On a line of slope m the derivative is zero at
/// s = s_q − r m/√(1 + m²), and z is convex in s, so that s clamped to the move is the minimum.
struct StraightSweep {
  double x = 0.0, y = 0.0, z = 0.0;  ///< Start.
  double ux = 0.0, uy = 0.0;         ///< Heading; zero for a vertical move.
  double run = 0.0;                  ///< Length seen from above.
  double slope = 0.0;                ///< m
  double sine = 0.0;                 ///< m/√(1 + m²)

  explicit StraightSweep(const BallMove& move) {
    const Eigen::Vector3d way = move.end - move.start;
    run = way.head<2>().norm();
    x = move.start.x();
    y = move.start.y();
    z = run > 0.0 ? move.start.z() : std::min(move.start.z(), move.end.z());
    if (!(run > 0.0)) return;
    ux = way.x() / run;
    uy = way.y() / run;
    slope = way.z() / run;
    sine = slope / std::sqrt(1.0 + slope * slope);
  }

  /// s of the ball that cuts deepest over q.
  [[nodiscard]] double foot(double radius, double qx, double qy) const {
    const double dx = qx - x;
    const double dy = qy - y;
    const double w = ux * dy - uy * dx;
    const double r = std::sqrt(std::max(radius * radius - w * w, 0.0));
    return std::min(std::max(ux * dx + uy * dy - r * sine, 0.0), run);
  }

  [[nodiscard]] Eigen::Vector3d centre(double s) const {
    return {x + s * ux, y + s * uy, z + s * slope};
  }

  /// Values of ball_below() for that ball over places of a line along x, with the same bits and
  /// without a branch. @param room  below 0 where the ball does not pass over.
  template <class Places, class Values>
  void below(double radius, double qy, const Places& qx, Values& room, Values& height) const {
    const double squared = radius * radius;
    const double dy = qy - y;
    const Values dx = qx - x;
    const Values reach = (squared - (ux * dy - uy * dx).square()).max(0.0).sqrt();
    const Values s = (ux * dx + uy * dy - reach * sine).max(0.0).min(run);
    room = squared - ((qx - (x + s * ux)).square() + (qy - (y + s * uy)).square());
    height = (z + s * slope) - room.max(0.0).sqrt();
  }
};

/// A prepared circular move in a vertical plane along an axis, which is a graph over that axis and
/// has a smaller curvature than the ball. All arcs of finishing rows are such moves.
///
/// Where z's derivative along the path is zero, the path bends down by at most 1/ρ and the ball's
/// lower side up by 1/r ≥ 1/R > 1/ρ, so this is the only minimum of z: the zero, clamped to the
/// move, is the minimum. The line from the arc's centre through the ball's meets the circle of
/// radius r at a right angle, so that q lies under the ball at the distance ρ − r from the arc's
/// centre on a cap and at ρ + r in a bowl.
struct GraphArc {
  bool along_x = true;
  double x = 0.0, y = 0.0, z = 0.0;  ///< Centre.
  double rho = 0.0;                  ///< Radius.
  double side = 1.0;                 ///< 1 for a cap, −1 for a bowl.
  double low = 0.0, high = 0.0;      ///< Ends of the move, along its axis from the centre.

  /// Place of the ball that cuts deepest over q, along the axis from the arc's centre.
  [[nodiscard]] double foot(double radius, double qx, double qy) const {
    const double across = along_x ? qy - y : qx - x;
    const double out = along_x ? qx - x : qy - y;
    const double r = std::sqrt(std::max(radius * radius - across * across, 0.0));
    return std::min(std::max(out * (rho / (rho - side * r)), low), high);
  }

  [[nodiscard]] Eigen::Vector3d centre(double h) const {
    const double top = z + side * std::sqrt(std::max(rho * rho - h * h, 0.0));
    return {along_x ? x + h : x, along_x ? y : y + h, top};
  }

  /// The same as StraightSweep::below(), over places of a line along the axis.
  /// @param across  the places' other coordinate. @param out  their coordinates along the axis.
  template <class Places, class Values>
  void below(double radius, double across, const Places& out, Values& room, Values& height) const {
    const double beside = across - (along_x ? y : x);
    const double middle = along_x ? x : y;
    const double squared = radius * radius;
    const double r = std::sqrt(std::max(squared - beside * beside, 0.0));
    const Values h = ((out - middle) * (rho / (rho - side * r))).max(low).min(high);
    room = squared - ((out - (middle + h)).square() + beside * beside);
    height = (z + side * (rho * rho - h.square()).max(0.0).sqrt()) - room.max(0.0).sqrt();
  }
};

/// A circular move, prepared: an arc in a horizontal plane or in one along an axis.
class ArcSweep {
 public:
  /// @pre the arc turns less than half a turn and does not rise.
  explicit ArcSweep(const Arc& arc);

  /// The arc as a GraphArc, if it is one for a ball of this radius.
  [[nodiscard]] std::optional<GraphArc> graph(double radius) const;

  /// Centre of the ball that cuts deepest over q; if none cuts there, that of any ball that does
  /// not.
  [[nodiscard]] Eigen::Vector3d centre(double radius, double qx, double qy) const;

 private:
  [[nodiscard]] bool contains(double first, double second) const;
  [[nodiscard]] Eigen::Vector3d point(double first, double second) const;

  int first_, second_, third_;
  Eigen::Vector3d centre_;
  double radius_;
  double turn_;            ///< 1 counter-clockwise, −1 clockwise.
  Eigen::Vector2d begin_;  ///< Start and end relative to the centre, in the plane.
  Eigen::Vector2d end_;
};

}  // namespace lensforge
