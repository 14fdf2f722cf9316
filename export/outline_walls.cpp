// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/outline_walls.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace lensforge {
namespace {

constexpr double kQuarter = 0.5 * std::numbers::pi;

using Points = std::vector<Eigen::Vector2d>;

Eigen::AlignedBox2d box_around(const Points& points) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : points) box.extend(p);
  return box;
}

/// A rectangle whose corners are arcs, the one at its upper right first.
std::vector<OutlineWall> rounded_walls(const Eigen::AlignedBox2d& box, double radius) {
  const Eigen::Vector2d low = box.min() + Eigen::Vector2d::Constant(radius);
  const Eigen::Vector2d high = box.max() - Eigen::Vector2d::Constant(radius);
  const Points centres{high, {low.x(), high.y()}, low, {high.x(), low.y()}};
  std::vector<OutlineWall> walls;
  for (std::size_t k = 0; k < 4; ++k) {
    OutlineWall arc;
    arc.arc = WallArc{centres[k], radius, kQuarter * static_cast<double>(k)};
    arc.from = arc.at(0.0);
    arc.to = arc.at(arc.last());
    walls.push_back(arc);
    const Eigen::Vector2d side = centres[(k + 1) % 4] - centres[k];
    if (side.norm() < kShortestWall) continue;
    walls.push_back({arc.to, arc.to + side, std::nullopt});
  }
  return walls;
}

std::vector<OutlineWall> polygon_walls(const Points& points) {
  Points kept;
  for (const Eigen::Vector2d& p : points) {
    if (kept.empty() || (p - kept.back()).norm() >= kShortestWall) kept.push_back(p);
  }
  while (kept.size() > 3 && (kept.back() - kept.front()).norm() < kShortestWall) kept.pop_back();
  std::vector<OutlineWall> walls;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    walls.push_back({kept[k], kept[(k + 1) % kept.size()], std::nullopt});
  }
  return walls;
}

}  // namespace

double OutlineWall::last() const { return arc ? kQuarter : (to - from).norm(); }

Eigen::Vector2d OutlineWall::at(double t) const {
  if (!arc) return from + t / last() * (to - from);
  const double angle = arc->start + t;
  return arc->centre + arc->radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
}

Eigen::Vector2d OutlineWall::along(double t) const {
  if (!arc) return (to - from) / last();
  const double angle = arc->start + t;
  return arc->radius * Eigen::Vector2d(-std::sin(angle), std::cos(angle));
}

double OutlineWall::length() const { return arc ? arc->radius * kQuarter : last(); }

std::vector<OutlineWall> walls_of(const Outline& outline) {
  const Eigen::AlignedBox2d box = box_around(outline.points);
  switch (outline.kind) {
    case OutlineKind::kCircle:
      return rounded_walls(box, 0.5 * box.sizes().minCoeff());
    case OutlineKind::kRoundedRectangle:
      return rounded_walls(box, outline.radius);
    case OutlineKind::kPolygon:
      break;
  }
  return polygon_walls(outline.points);
}

}  // namespace lensforge
