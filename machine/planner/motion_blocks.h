// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>

#include "machine/gcode/gcode_motion.h"
#include "machine/planner/planner_settings.h"

namespace lensforge {

/// One straight piece as the controller plans it: mm, s.
struct PlanBlock {
  double length = 0.0;
  double acceleration = 0.0;      ///< Along it, no axis beyond its own.
  double nominal = 0.0;           ///< Speed asked for, no axis beyond its own.
  double max_entry_square = 0.0;  ///< At the corner before it, (mm/s)²; 0 after a standstill.
  std::int64_t line = 0;          ///< Of the program.
  bool begins_line = false;       ///< First piece of its line.
};

/// Turns motions into the pieces that a Grbl-family planner holds: arcs into chords within the arc
/// tolerance, lengths rounded to steps, speeds and accelerations limited per axis, and corners by
/// junction deviation.
class MotionBlocks {
 public:
  explicit MotionBlocks(const PlannerSettings& settings);

  /// Hands the pieces of `motion` to `take`; none if it is less than a step.
  void split(const GcodeMotion& motion, const std::function<void(const PlanBlock&)>& take);

  /// The next piece starts from a standstill.
  void stand_still() { moving_ = false; }

 private:
  struct Piece {
    Eigen::Vector3d end;
    double speed;  ///< Asked for, mm/s; of a rapid infinite.
  };
  bool make_block(const Piece& piece, PlanBlock& block);
  [[nodiscard]] double max_entry_square(const Eigen::Vector3d& unit, double nominal) const;
  [[nodiscard]] Eigen::Vector3d on_steps(const Eigen::Vector3d& point) const;

  PlannerSettings settings_;
  Eigen::Vector3d rate_;  ///< mm/s
  bool placed_ = false;
  bool moving_ = false;
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d previous_unit_ = Eigen::Vector3d::Zero();
  double previous_nominal_ = 0.0;
};

/// Chords of an arc of `radius` and `sweep` (either sign) that stay within `tolerance` of it.
int arc_chords(double radius, double sweep, double tolerance);

}  // namespace lensforge
