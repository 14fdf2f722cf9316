// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace lensforge {

/// Plane of an arc: G17, G18, G19.
enum class ArcPlane { kXY, kZX, kYZ };

/// A circular arc, or a helix, from a start point; mm and radians.
struct Arc {
  int first = 0;   ///< Axis from which the angle is measured.
  int second = 1;  ///< Axis at a right angle to it, counter-clockwise.
  int third = 2;   ///< Axis normal to the plane.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< At the height of the start point.
  double radius = 0.0;
  double begin = 0.0;  ///< Angle of the start point.
  double sweep = 0.0;  ///< Counter-clockwise positive; ±2π for a full circle.
  double rise = 0.0;   ///< Along `third` over the whole sweep.

  /// Length of the path.
  [[nodiscard]] double length() const;
  /// The point after the fraction `part` (0 … 1) of the sweep.
  [[nodiscard]] Eigen::Vector3d at(double part) const;
  /// The box around all of it.
  [[nodiscard]] Eigen::AlignedBox3d bounds() const;
};

/// Shape of an arc as stated by its words, mm.
struct ArcRequest {
  ArcPlane plane = ArcPlane::kXY;
  bool clockwise = false;                            ///< G2, seen from the third axis's tip.
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< I J K: from the start to the centre.
  std::optional<double> radius;                      ///< R; negative for more than half a turn.
};

/// An arc, or the reason for which there is none.
struct ArcResult {
  Arc arc;
  std::string reason;  ///< Empty for an arc.
};

/// The arc from `start` to `end`. With I J K, equal points in the plane give a full circle, and the
/// two radii may differ by up to 0.005 mm, or by up to both 0.5 mm and a thousandth of the radius.
/// This is Grbl's own rule.
ArcResult make_arc(const Eigen::Vector3d& start, const Eigen::Vector3d& end,
                   const ArcRequest& request);

/// One motion of a program: machine coordinates, mm.
struct GcodeMotion {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  std::optional<Arc> arc;              ///< Straight without one.
  bool rapid = false;                  ///< G0, G28, G30: at the axes' maximum rates.
  double feed = 0.0;                   ///< mm/min; 0 for a rapid. G93 is converted with the length.
  std::int64_t line = 0;               ///< Line in the file, from 1.
  std::int64_t offset = 0;             ///< Offset of the line's first byte.
  std::optional<std::int64_t> number;  ///< The line's N word.

  /// Length of the path.
  [[nodiscard]] double length() const { return arc ? arc->length() : (end - start).norm(); }
  /// The box around all of it.
  [[nodiscard]] Eigen::AlignedBox3d bounds() const {
    if (arc) return arc->bounds();
    Eigen::AlignedBox3d box(start);
    return box.extend(end);
  }
};

/// Spindle state commanded by a program.
enum class SpindleTurn { kOff, kClockwise, kCounterClockwise };

/// Active motion mode. kNone after G80.
enum class MotionMode { kRapid, kFeed, kArcClockwise, kArcCounterClockwise, kNone };

/// The active modes and the tool's position. Lengths in mm, machine coordinates.
struct GcodeState {
  MotionMode motion = MotionMode::kRapid;
  ArcPlane plane = ArcPlane::kXY;
  std::optional<bool> inches;  ///< G20 or G21; empty until one was read.
  bool absolute = true;        ///< G90
  bool inverse_time = false;   ///< G93
  std::optional<double> feed;  ///< F under G94, mm/min.
  int coordinate_system = 0;   ///< 0 for G54 … 5 for G59.
  SpindleTurn spindle = SpindleTurn::kOff;
  double rpm = 0.0;            ///< S
  bool mist = false;           ///< M7
  bool flood = false;          ///< M8
  int tool = 0;                ///< T
  int loaded_tool = 0;         ///< T at the last M6.
  int tool_length = 0;         ///< H of G43, or the loaded tool's number; 0 after G49.
  double stated_length = 0.0;  ///< Z of G43.1, mm; 0 after G49.
  /// G64: corner tolerance, mm; 0 is unlimited. Empty outside G64.
  std::optional<double> blending;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  /// Origins of G54 … G59, including the controller's offsets (`$#`) except the tool's length.
  std::array<Eigen::Vector3d, 6> origins{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                         Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                         Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::optional<Eigen::Vector3d> g28;  ///< Target of G28.
  std::optional<Eigen::Vector3d> g30;

  /// Origin of the active coordinates.
  [[nodiscard]] Eigen::Vector3d origin() const { return lengthened(origins[system_index()]); }
  /// Origins of G54 … G59 with the active tool length.
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
