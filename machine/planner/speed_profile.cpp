// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/planner/speed_profile.h"

#include <algorithm>
#include <cmath>

namespace lensforge {

/// With up and down ramps that meet, the peak follows from v² = v0² + 2as on both:
/// peak² = a·length + (entry² + exit²)/2.
SpeedProfile::SpeedProfile(double length, double entry, double exit, double nominal,
                           double acceleration)
    : length_(length), entry_(entry), exit_(exit), acceleration_(acceleration) {
  const double triangle = std::sqrt(acceleration * length + 0.5 * (entry * entry + exit * exit));
  peak_ = std::max({std::min(triangle, nominal), entry, exit});
  up_ = (peak_ - entry) / acceleration;
  down_ = (peak_ - exit) / acceleration;
  const double ramps = 0.5 * (entry + peak_) * up_ + 0.5 * (exit + peak_) * down_;
  along_ = peak_ > 0.0 ? std::max(0.0, length - ramps) / peak_ : 0.0;
}

ProfilePoint SpeedProfile::at(double time) const {
  ProfilePoint point;
  if (time < up_) {
    point.speed = entry_ + acceleration_ * time;
    point.distance = 0.5 * (entry_ + point.speed) * time;
  } else if (time < up_ + along_) {
    point.speed = peak_;
    point.distance = 0.5 * (entry_ + peak_) * up_ + peak_ * (time - up_);
  } else {
    const double left = std::max(0.0, duration() - time);
    point.speed = exit_ + acceleration_ * left;
    point.distance = length_ - 0.5 * (exit_ + point.speed) * left;
  }
  point.distance = std::clamp(point.distance, 0.0, length_);
  return point;
}

}  // namespace lensforge
