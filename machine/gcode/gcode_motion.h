// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>

#include "machine/gcode/arc.h"

namespace lensforge {

/// One motion of a program: machine coordinates, mm.
struct GcodeMotion {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  std::optional<Arc> arc;              ///< Straight without one.
  bool rapid = false;                  ///< G0, G28, G30: as fast as the axes go.
  double feed = 0.0;                   ///< mm/min; of a rapid 0. G93 is converted by the length.
  std::int64_t line = 0;               ///< In the file, counted from 1.
  std::int64_t offset = 0;             ///< Of the line's first byte.
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

}  // namespace lensforge
