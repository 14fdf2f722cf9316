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
  double rpm = 0.0;            ///< S
  bool mist = false;           ///< M7
  bool flood = false;          ///< M8
  int tool = 0;                ///< T
  int loaded_tool = 0;         ///< That of the last M6.
  int tool_length = 0;         ///< H of G43, or the loaded tool's number; 0 after G49.
  double stated_length = 0.0;  ///< Z of G43.1, mm; 0 after G49.
  /// G64: how far corners may be cut, mm; 0 is without limit. Nothing outside G64.
  std::optional<double> blending;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  /// Where G54 … G59 begin, offsets of the controller but the tool's length included; its `$#`
  /// tells.
  std::array<Eigen::Vector3d, 6> origins{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                         Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                         Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::optional<Eigen::Vector3d> g28;  ///< Where G28 goes.
  std::optional<Eigen::Vector3d> g30;

  /// Where the coordinates in force begin.
  [[nodiscard]] Eigen::Vector3d origin() const { return lengthened(origins[system_index()]); }
  /// Where each of G54 … G59 begins with the tool's length in force.
  [[nodiscard]] std::array<Eigen::Vector3d, 6> tool_origins() const {
    std::array<Eigen::Vector3d, 6> all = origins;
    for (Eigen::Vector3d& origin : all) origin = lengthened(origin);
    return all;
  }

 private:
  [[nodiscard]] std::size_t system_index() const {
    return static_cast<std::size_t>(coordinate_system);
  }
  [[nodiscard]] Eigen::Vector3d lengthened(const Eigen::Vector3d& origin) const {
    return origin + stated_length * Eigen::Vector3d::UnitZ();
  }
};

}  // namespace lensforge
