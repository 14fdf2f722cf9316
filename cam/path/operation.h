// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

namespace lensforge {

/// A number that was found to be the largest, and where.
struct Extreme {
  double value = 0.0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< Tip, mm, lens frame.
};

/// What is known of every move of a finishing operation over its whole length, not only at its
/// ends, against the exact drop curve.
struct PathCertificate {
  Extreme gouge;   ///< Deepest that the path runs below the drop curve, mm, ≥ 0.
  Extreme excess;  ///< Highest that it runs above, mm, ≥ 0.
  /// Largest difference of mean slope over any 5 µm of a move where the ball shapes the surface,
  /// not only the rim, rad.
  Extreme slope;
};

/// What one operation came to; mm, lens frame.
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
  bool certified = false;  ///< Whether `certificate` was computed.
  std::vector<std::string> warnings;
};

}  // namespace lensforge
