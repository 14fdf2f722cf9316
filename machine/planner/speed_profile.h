// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge {

/// Where a motion is after some time.
struct ProfilePoint {
  double distance = 0.0;  ///< mm from its begin.
  double speed = 0.0;     ///< mm/s
};

/// Speed over a straight piece: up at a constant acceleration, along, down. mm, s.
class SpeedProfile {
 public:
  /// @param entry,exit  speeds at its ends, mm/s; reachable from one another over `length`.
  /// @param nominal     the speed that it may not pass between them.
  SpeedProfile(double length, double entry, double exit, double nominal, double acceleration);

  /// Seconds for the whole of it.
  [[nodiscard]] double duration() const { return up_ + along_ + down_; }
  /// @pre 0 ≤ time ≤ duration()
  [[nodiscard]] ProfilePoint at(double time) const;

 private:
  double length_;
  double entry_;
  double exit_;
  double acceleration_;
  double peak_;
  double up_;
  double along_;
  double down_;
};

}  // namespace lensforge
