// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/ball_blend.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lensforge {
namespace {

/// Places of a row of the smaller ball at which profiles are summed: their mean is then exact to
/// 1e-5 of a scallop.
constexpr int kPlaces = 128;

/// Values of a table over the zone; between them it is linear.
constexpr std::size_t kTable = 257;

/// Halvings: to the last bit.
constexpr int kHalvings = 60;

/// How the smaller ball bends off on its way out of the zone, 1/mm: no more sharply than a lens,
/// and at the end of its row 6 µm above the surface, more than that rises over the row's level end.
constexpr double kExit = 0.15;

/// From 0 at 0 to 1 at 1, level at both.
double eased(double t) { return t * t * (3.0 - 2.0 * t); }

/// Scallops over one row of the larger ball.
struct Profiles {
  std::vector<double> small;
  std::vector<double> large;

  explicit Profiles(const BallBlend::Rows& rows) {
    const double period = rows.every * rows.pitch;
    const int places = kPlaces * rows.every;
    for (int i = 0; i < places; ++i) {
      const double x = period * (i + 0.5) / places;
      const double from_small = std::remainder(x, rows.pitch);
      const double from_large = std::remainder(x, period);
      small.push_back(from_small * from_small / (2.0 * rows.small_radius));
      large.push_back(from_large * from_large / (2.0 * rows.large_radius));
    }
  }

  [[nodiscard]] double mean_of_lower(double small_lift, double large_lift) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < small.size(); ++i) {
      sum += std::min(small[i] + small_lift, large[i] + large_lift);
    }
    return sum / static_cast<double>(small.size());
  }
};

/// The lift of the larger ball with which the mean is what it is to be; it grows with the lift.
double lift_for(const Profiles& profiles, double small_lift, double mean, double low, double high) {
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (profiles.mean_of_lower(small_lift, middle) < mean ? low : high) = middle;
  }
  return high;
}

}  // namespace

BallBlend::BallBlend(const Rows& rows) {
  const double crest = rows.pitch * rows.pitch / (8.0 * rows.small_radius);
  const double large_pitch = rows.every * rows.pitch;
  const double large_crest = large_pitch * large_pitch / (8.0 * rows.large_radius);
  const double mean = crest / 3.0;
  const double alone = mean - large_crest / 3.0;  // Of the larger ball where it cuts alone.
  clear_ = std::max(alone, 0.0) + large_crest;
  const Profiles profiles(rows);
  for (std::size_t i = 0; i < kTable; ++i) {
    const double t = static_cast<double>(i) / (kTable - 1);
    const double small = clear_ * eased(t);
    const double lift = lift_for(profiles, small, mean, alone, crest + large_crest);
    large_lift_.push_back(std::max(i == 0 ? crest : lift, 0.0));
  }
}

double BallBlend::small_lift(double distance) const {
  const double t = std::clamp(distance / kWidth, 0.0, 1.0);
  const double out = std::max(distance - kWidth, 0.0);
  return clear_ * eased(t) + kExit * out * out;
}

double BallBlend::large_lift(double distance) const {
  const double at = std::clamp(distance / kWidth, 0.0, 1.0) * (kTable - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), kTable - 2);
  const double part = at - static_cast<double>(i);
  return (1.0 - part) * large_lift_[i] + part * large_lift_[i + 1];
}

}  // namespace lensforge
