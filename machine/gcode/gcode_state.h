// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "machine/gcode/arc.h"

namespace lensforge {

/// What a program asks of the spindle.
enum class SpindleTurn { kOff, kClockwise, kCounterClockwise };

/// Motion words in force. kNone after G80.
enum class MotionMode { kRapid, kFeed, kArcClockwise, kArcCounterClockwise, kNone };

/// The words in force, and where the tool is. Lengths in mm, machine coordinates.
struct GcodeState {
  MotionMode motion = MotionMode::kRapid;
  ArcPlane plane = ArcPlane::kXY;
  std::optional<bool> inches;  ///< G20 or G21; nothing until one of them was read.
  bool absolute = true;        ///< G90
  bool inverse_time = false;   ///< G93
  std::optional<double> feed;  ///< F under G94, mm/min.
  int coordinate_system = 0;   ///< 0 for G54 … 5 for G59.
  SpindleTurn spindle = SpindleTurn::kOff;
  double rpm = 0.0;     ///< S
  bool mist = false;    ///< M7
  bool flood = false;   ///< M8
  int tool = 0;         ///< T
  int tool_length = 0;  ///< H of G43; 0 after G49.
  /// G64: how far corners may be cut, mm; 0 is without limit. Nothing outside G64.
  std::optional<double> blending;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  /// Where G54 … G59 begin, offsets of the controller included; its `$#` tells.
  std::array<Eigen::Vector3d, 6> origins{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                         Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                         Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::optional<Eigen::Vector3d> g28;  ///< Where G28 goes.
  std::optional<Eigen::Vector3d> g30;

  [[nodiscard]] const Eigen::Vector3d& origin() const {
    return origins[static_cast<std::size_t>(coordinate_system)];
  }
};

}  // namespace lensforge
