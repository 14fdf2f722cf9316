// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/tip_floor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cam/contact/profile_cutter.h"

namespace lensforge {

TipFloor::TipFloor(const ProfileCutter& surface, const Tool& tool, double allowance,
                   std::span<const KeepOut> keep_outs, double clearance)
    : surface_(surface),
      rim_(surface.bounds().min().head<2>(), surface.bounds().max().head<2>()),
      keep_outs_(keep_outs),
      clearance_(clearance),
      hold_(hold_of(tool, allowance)) {
  for (const CutterProfile& part : whole_profile(tool)) {
    parts_.push_back(grown(part, allowance));
    whole_.push_back(widened(part, clearance));
  }
}

TipFloor::TipFloor(const ProfileCutter& surface, const Tool& tool, double allowance,
                   const Eigen::AlignedBox2d& rim)
    : TipFloor(surface, tool, allowance, {}, 0.0) {
  rim_ = rim;
}

double TipFloor::hold_of(const Tool& tool, double allowance) {
  const CutterProfile cutter = grown(whole_profile(tool).front(), allowance);
  return cutter.flat() + cutter.corner / std::numbers::sqrt2;
}

/// The place whose height the tip keeps over p.
Eigen::Vector2d TipFloor::held(const Eigen::Vector2d& p) const {
  const Eigen::Vector2d rim = p.cwiseMax(rim_.min()).cwiseMin(rim_.max());
  const double beyond = (p - rim).norm();
  return beyond > hold_ ? rim + (p - rim) * (hold_ / beyond) : p;
}

double TipFloor::at_least(const Eigen::Vector2d& p, const Trace& trace) const {
  const Eigen::Vector2d held = this->held(p);
  double floor = kNoContact;
  for (std::size_t part = 0; part < trace.size(); ++part) {
    floor = std::max(floor, surface_.rest_on(parts_[part], held, trace[part]));
  }
  return floor;
}

double TipFloor::over(const Eigen::Vector2d& p, double reach, Trace& trace) const {
  return std::max(over_surface(p, reach, trace), over_clamps(p, reach));
}

double TipFloor::over_surface(const Eigen::Vector2d& p, double reach, Trace& trace) const {
  trace.resize(parts_.size());
  const Eigen::Vector2d held = this->held(p);
  double floor = kNoContact;
  for (std::size_t part = 0; part < parts_.size(); ++part) {
    // A shank is usually so high that not even the surface's highest point could reach it.
    if (surface_.bounds().max().z() - parts_[part].base <= floor) continue;
    trace[part] = surface_.drop(widened(parts_[part], reach), held, trace[part]);
    floor = std::max(floor, trace[part].tip);
  }
  return floor;
}

double TipFloor::over_clamps(const Eigen::Vector2d& p, double reach) const {
  double floor = kNoContact;
  for (const KeepOut& box : keep_outs_) {
    for (const CutterProfile& part : whole_) {
      const double tip =
          profile_box_tip(widened(part, reach), p, Eigen::AlignedBox3d(box.low, box.high));
      floor = std::max(floor, tip + clearance_);
    }
  }
  return floor;
}

}  // namespace lensforge
