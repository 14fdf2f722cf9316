// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "machine/gcode/gcode_motion.h"

namespace lensforge {

/// The part of an arc between two shares of its sweep, without its rise.
Arc part_of(const Arc& arc, double from, double to);

/// A straight or circular way of the ball's centre; mm, lens frame.
struct BallMove {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  std::int32_t piece = 0;  ///< See BallPath.
  std::int32_t arc = -1;   ///< In BallPath::arcs(); −1 for a straight move.
};

/// All motions of a program's ball-end mill as ways of the ball's centre.
///
/// Moves are numbered by pieces, each of which leaves one smooth strip: a new one begins where the
/// path is broken, where its heading has turned by more than 60° since the piece began (the next
/// row of a raster), and where it goes over a ridge, that is turns downwards by more than
/// kRidgeAngle at once or as sharply as a ball that rolls over a ridge of radius kRidgeRadius.
class BallPath {
 public:
  static constexpr double kRidgeAngle = 0.01;   ///< rad
  static constexpr double kRidgeRadius = 0.02;  ///< mm

  /// @param radius    of the ball, mm, > 0.
  /// @param z_offset  program Z − lens-frame z, mm.
  BallPath(double radius, double z_offset);

  /// Appends a motion of the tool's tip as the program has it. Arcs become sub-arcs of at most a
  /// third of a turn, helices chords within kHelixError of them.
  void add(const GcodeMotion& motion);

  [[nodiscard]] double radius() const { return radius_; }
  [[nodiscard]] const std::vector<BallMove>& moves() const { return moves_; }
  /// Of the moves that are not straight: of the ball's centre, rise 0.
  [[nodiscard]] const std::vector<Arc>& arcs() const { return arcs_; }
  /// Pieces are numbered 0 … pieces() − 1.
  [[nodiscard]] std::int32_t pieces() const { return piece_ + 1; }

  static constexpr double kHelixError = 1e-6;  ///< mm

 private:
  /// The way's direction where it begins or ends.
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
  double lift_;  ///< From the tip as written to the ball's centre, mm.
  std::vector<BallMove> moves_;
  std::vector<Arc> arcs_;
  std::int32_t piece_ = -1;
  Eigen::Vector2d piece_heading_ = Eigen::Vector2d::Zero();  ///< Where the piece began.
  Tangent last_;                                             ///< Where the last move ended.
  double last_length_ = 0.0;
  bool after_ridge_ = false;
};

}  // namespace lensforge
