// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/rough_links.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lensforge {
namespace {

/// Material no thicker than this is entered without a ramp: what a cell of the stock map, which is
/// an upper bound, may show where there is none, mm.
constexpr double kThinMaterial = 0.01;

/// A path cut off after some length seen from above, with that length up to each point.
struct Prefix {
  TipPath points;
  std::vector<double> lengths;
};

Prefix prefix_of(const TipPath& path, double length) {
  Prefix prefix{{path.front()}, {0.0}};
  for (std::size_t i = 1; i < path.size() && prefix.lengths.back() < length; ++i) {
    const double step = (path[i] - path[i - 1]).head<2>().norm();
    const double part = std::min(1.0, (length - prefix.lengths.back()) / step);
    prefix.points.emplace_back(path[i - 1] + part * (path[i] - path[i - 1]));
    prefix.lengths.push_back(prefix.lengths.back() + part * step);
  }
  return prefix;
}

double length_of(const TipPath& path) {
  double length = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) length += (path[i] - path[i - 1]).head<2>().norm();
  return length;
}

Eigen::Vector3d at_height(const Eigen::Vector3d& p, double z) { return {p.x(), p.y(), z}; }

}  // namespace

double safe_height_of(const Workshop& workshop, const Eigen::AlignedBox3d& blank) {
  double top = blank.max().z();
  for (const KeepOut& box : workshop.keep_outs) top = std::max(top, box.high.z());
  return top + workshop.process.safe_height;
}

RoughLinks::RoughLinks(const LinkSite& site, RoughMoves& moves)
    : site_(site), moves_(moves), parts_(whole_profile(site.tool)) {}

void RoughLinks::enter(const TipPath& path) {
  const Eigen::Vector3d& begin = path.front();
  travel(begin);
  const double air = site_.stock.drop(parts_.front(), begin.head<2>());
  const double lift = air - begin.z();
  if (lift > kThinMaterial) ramp(path, lift);
  moves_.feed(MoveKind::kPlunge, begin);
}

/// Forth and back along the first of the path, as often as its length asks for, sinking all the
/// way.
void RoughLinks::ramp(const TipPath& path, double lift) {
  const double need = 0.5 * lift / std::tan(site_.ramp_angle_deg * std::numbers::pi / 180.0);
  const double leg = std::min(need, length_of(path));
  const double rounds = std::ceil(need / leg - 1e-9);
  const double sink = 0.5 * lift / rounds;  // A leg.
  const Prefix prefix = prefix_of(path, leg);
  const std::size_t last = prefix.points.size() - 1;
  const auto go = [&](std::size_t i, double above) {
    moves_.feed(MoveKind::kPlunge, at_height(prefix.points[i], prefix.points[i].z() + above));
  };
  double above = lift;
  go(0, above);
  for (double round = 0.0; round < rounds; ++round) {
    for (std::size_t i = 1; i <= last; ++i) go(i, above - sink * prefix.lengths[i] / leg);
    above -= sink;
    for (std::size_t i = last; i > 0; --i) {
      go(i - 1, above - sink * (1.0 - prefix.lengths[i - 1] / leg));
    }
    above -= sink;
  }
}

bool RoughLinks::cross(const Eigen::Vector3d& end, double level) {
  const Eigen::Vector3d begin = moves_.at();
  const double length = (end - begin).head<2>().norm();
  const auto steps =
      std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil(length / site_.spacing)));
  TipFloor::Trace trace;
  std::vector<double> floors;
  for (std::int64_t i = 0; i < steps; ++i) {
    const double part = (static_cast<double>(i) + 0.5) / static_cast<double>(steps);
    const Eigen::Vector2d p = (begin + part * (end - begin)).head<2>();
    floors.push_back(site_.floor.over(p, 0.5 * length / static_cast<double>(steps), trace));
    if (floors.back() >= site_.stock.blank().max().z()) return false;
  }
  if (std::max(level, floors.back()) > end.z() + kThinMaterial) return false;
  for (std::int64_t i = 0; i <= steps; ++i) {
    double z = i == steps ? std::max(level, end.z()) : level;
    if (i > 0) z = std::max(z, floors[static_cast<std::size_t>(i - 1)]);
    if (i < steps) z = std::max(z, floors[static_cast<std::size_t>(i)]);
    const double part = static_cast<double>(i) / static_cast<double>(steps);
    if (i > 0 || z > begin.z()) {
      moves_.feed(MoveKind::kCut, at_height(begin + part * (end - begin), z));
    }
  }
  if (moves_.at().z() > end.z()) moves_.feed(MoveKind::kCut, end);
  return true;
}

void RoughLinks::retract() {
  if (moves_.placed()) moves_.rapid(at_height(moves_.at(), site_.safe_z));
}

/// Height of the tip above which nothing of the tool touches material over p.
double RoughLinks::air_above(const Eigen::Vector2d& p) {
  double height = kNoContact;
  for (const CutterProfile& part : parts_) {
    height = std::max(height, site_.stock.drop(widened(part, 0.5 * site_.spacing), p));
  }
  return height;
}

/// A height at which the whole tool goes straight to `to` above all material and clear of clamps;
/// nothing if that is no lower than the safe height, or slower.
std::optional<double> RoughLinks::clear_height(const Eigen::Vector3d& to) {
  const Eigen::Vector3d& from = moves_.at();
  const Eigen::Vector3d& rate = site_.workshop.machine.max_rate;
  const double length = (to - from).head<2>().norm();
  const double rapid =
      length / rate.head<2>().minCoeff() + (2.0 * site_.safe_z - from.z() - to.z()) / rate.z();
  if (length / site_.tool.feed > rapid) return std::nullopt;
  const auto steps =
      std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil(length / site_.spacing)));
  double height = std::max(from.z(), to.z());
  TipFloor::Trace trace;
  for (std::int64_t i = 0; i <= steps; ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(steps);
    const Eigen::Vector2d p = (from + part * (to - from)).head<2>();
    height = std::max({height, air_above(p), site_.floor.over(p, 0.5 * site_.spacing, trace)});
  }
  const double climb = 2.0 * height - from.z() - to.z();
  if ((length + climb) / site_.tool.feed > rapid) return std::nullopt;
  return height;
}

/// To a place above `to` from which the tool is fed down through air, or to the material there.
void RoughLinks::travel(const Eigen::Vector3d& to) {
  const std::optional<double> height = moves_.placed() ? clear_height(to) : std::nullopt;
  if (height) {
    moves_.feed(MoveKind::kLink, at_height(moves_.at(), *height));
    moves_.feed(MoveKind::kLink, at_height(to, *height));
    return;
  }
  retract();
  moves_.rapid(at_height(to, site_.safe_z));
  const double clear = std::max(to.z(), air_above(to.head<2>())) + site_.workshop.process.clearance;
  if (clear < site_.safe_z) moves_.rapid(at_height(to, clear));
}

}  // namespace lensforge
