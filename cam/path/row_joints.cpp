// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/row_joints.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lensforge {
namespace {

/// How far joints are moved, in gaps between them.
constexpr double kJointRoom = 0.45;

/// Steps of the grid to either side among which a place for a joint is sought, and heights that
/// need no better place, in units of the last decimal.
constexpr int kGridTries = 8;
constexpr double kOnGrid = 0.05;

/// How far a joint between straight pieces may be cut off by being moved, in RowProfile::finest; of
/// a coarse grid as much as heights are left off it: otherwise joints could not be moved by a step.
constexpr double kCutOff = 4.0;

/// Steps of the grid by which a level end is lengthened at most.
constexpr int kEndTries = 64;

/// How far a height is off the grid, in units of the last decimal.
double off_grid(double z, const ProgramGrid& grid) {
  const double units = (z - grid.z_zero) / grid.resolution;
  return std::abs(units - std::nearbyint(units));
}

/// The place at most `tries` steps of the grid from u at which a line through (u, z) is nearest to
/// a height of the grid.
double best_step(double u, double z, double slope, int tries, const ProgramGrid& grid) {
  const double first = grid.place(u) - u;
  double best = u;
  double least = HUGE_VAL;
  for (int k = 0; k <= 2 * tries && least > kOnGrid; ++k) {
    const double step = grid.resolution * (k % 2 == 0 ? k / 2 : -(k + 1) / 2);
    const double off = off_grid(z + slope * (first + step), grid);
    if (off >= least) continue;
    least = off;
    best = u + step;
  }
  return best;
}

/// First to where the curve crosses the nearest height of the grid, if that is near, which leaves
/// what the curve rises within a step; then by whole steps.
double place_on_grid(const RowProfile& profile, std::size_t joint, const ProgramGrid& grid,
                     std::size_t& hint) {
  const double u = profile.joints[joint];
  if (joint == 0 || joint + 1 == profile.joints.size()) return u;
  const double left = u - profile.joints[joint - 1];
  const double right = profile.joints[joint + 1] - u;
  const double before = profile.at(u - left, hint);
  const double z = profile.at(u, hint);
  const double after = profile.at(u + right, hint);
  const double corner = std::abs((after - z) / right - (z - before) / left);
  const double cut_off = std::max(kCutOff * profile.finest, kOnGrid * grid.resolution);
  const double room = std::min(kJointRoom * std::min(left, right), cut_off / corner);
  const double slope = (after - before) / (left + right);
  const double shift = (grid.height(z) - z) / slope;
  const double moved = std::abs(shift) <= room ? shift : 0.0;
  const double steps = std::floor((room - std::abs(moved)) / grid.resolution);
  const int tries = static_cast<int>(std::min<double>(steps, kGridTries));
  return best_step(u + moved, moved != 0.0 ? profile.at(u + moved, hint) : z, slope, tries, grid);
}

/// The place at most kEndTries steps from u, which lies on the grid, whose height is best.
double best_end(const RowProfile& profile, double u, double step, const ProgramGrid& grid) {
  std::size_t hint = step < 0.0 ? profile.u.size() : 0;
  double best = u;
  double least = HUGE_VAL;
  for (int k = 0; k <= kEndTries; ++k) {
    const double place = grid.place(u + k * step);
    const double off = off_grid(profile.at(place, hint), grid);
    if (off >= least) continue;
    least = off;
    best = place;
  }
  return best;
}

}  // namespace

double to_resolution(double value, double resolution) {
  // Dividing by the inverse, a power of ten, gives the double next to the decimal number.
  const double inverse = std::round(1.0 / resolution);
  return std::round(value * inverse) / inverse;
}

RowJoints row_joints(const RowProfile& profile, const ProgramGrid& grid) {
  RowJoints joints;
  joints.exact.reserve(profile.joints.size());
  joints.written.reserve(profile.joints.size());
  joints.height.reserve(profile.joints.size());
  std::size_t hint = 0;
  for (std::size_t i = 0; i < profile.joints.size(); ++i) {
    const double joint = place_on_grid(profile, i, grid, hint);
    const double u = grid.place(joint);
    if (!joints.written.empty() && u <= joints.written.back().x()) continue;
    const double z = profile.at(std::clamp(u, profile.u.front(), profile.u.back()), hint);
    joints.height.push_back(z);
    joints.written.emplace_back(u, grid.height(z));
    joints.exact.emplace_back(joint, profile.at(joint, hint));
  }
  return joints;
}

void level_ends(const ProgramGrid& grid, RowProfile& profile) {
  const double r = grid.resolution;
  const double first = grid.place(profile.joints[1] + r);
  const double last = grid.place(profile.joints[profile.joints.size() - 2] - r);
  const double begin = best_end(profile, first, r, grid);
  const double end = best_end(profile, last, -r, grid);
  if (!(begin < end)) return;
  std::size_t hint = 0;
  const double z_begin = profile.at(begin, hint);
  const double z_end = profile.at(end, hint);
  RowProfile ends;
  ends.error = profile.error;
  ends.finest = profile.finest;
  ends.shaped_from = profile.shaped_from;
  ends.shaped_to = profile.shaped_to;
  ends.u = {profile.u.front(), begin};
  ends.z = {z_begin, z_begin};
  ends.joints = {profile.joints.front(), begin};
  for (std::size_t i = 0; i < profile.u.size(); ++i) {
    if (!(profile.u[i] > begin && profile.u[i] < end)) continue;
    ends.u.push_back(profile.u[i]);
    ends.z.push_back(profile.z[i]);
  }
  for (const double joint : profile.joints) {
    if (joint > begin && joint < end) ends.joints.push_back(joint);
  }
  const double to = profile.u.back();
  ends.u.insert(ends.u.end(), {end, to});
  ends.z.insert(ends.z.end(), {z_end, z_end});
  ends.joints.insert(ends.joints.end(), {end, to});
  profile = std::move(ends);
}

}  // namespace lensforge
