// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "cam/path/operation.h"

namespace lensforge {

/// A tool's path, thinned out to be looked at; mm, lens frame.
struct ReportPath {
  std::string operation;
  std::vector<std::vector<Eigen::Vector3f>> strips;  ///< Each drawn as one line.
  std::int64_t every = 1;                            ///< One strip in so many was kept.
};

/// Thins a path of any length out in constant memory. Whole strips are kept or left out, so that no
/// line is drawn where the tool never went: a strip ends where the tool is lifted, and where it
/// turns back (the next pass of a zig-zag).
class PathSketch {
 public:
  /// @param spacing  of the points that are kept along a strip, mm, > 0.
  /// @param most     points that are kept, ≥ 2.
  PathSketch(std::string operation, double spacing, std::size_t most = 40000);

  /// Takes the next moves, in order; fits MoveSink.
  void add(std::span<const PathMove> moves);

  /// What was kept so far, with the strip that is not ended yet.
  [[nodiscard]] ReportPath path() const;

 private:
  void begin_strip();
  void thin_out();

  ReportPath kept_;
  double spacing_;
  std::size_t most_;
  std::size_t points_ = 0;   ///< In kept_.strips.
  std::int64_t strips_ = 0;  ///< Ended so far.
  std::vector<Eigen::Vector3f> strip_;
  Eigen::Vector2d heading_ = Eigen::Vector2d::Zero();  ///< Where the strip began.
  Eigen::Vector3d last_ = Eigen::Vector3d::Zero();
  bool started_ = false;
};

}  // namespace lensforge
