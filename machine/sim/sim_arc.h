// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>

namespace lensforge {

/// The chords that the simulated controller runs instead of an arc.
struct SimArc {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  int plane = 17;
  double turn = 0.0;  ///< rad, counter-clockwise positive.
  int chords = 1;

  /// End of chord 1 … chords.
  [[nodiscard]] Eigen::Vector3d chord_end(int chord) const;
  /// Length of the true arc.
  [[nodiscard]] double length() const;
};

/// What a line says of an arc, mm.
struct SimArcWords {
  int plane = 17;
  bool clockwise = false;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  std::optional<double> radius;
  double tolerance = 0.002;
};

/// Fills `arc`. @return 0, or the number of the error: 33, 34.
int lay_arc(const Eigen::Vector3d& start, const Eigen::Vector3d& end, const SimArcWords& words,
            SimArc& arc);

}  // namespace lensforge
