// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/lowest_ball.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include "cam/milled/ball_sweep.h"

namespace lensforge {
namespace {

/// Contacts that are kept at most, and how often another is looked for: on creased meshes 3 to 6 is
/// the rule (RoundedField.EqualsTheBestOfManyBalls).
constexpr std::size_t kMaxPlanes = 8;
constexpr int kMaxDrops = 40;

/// The search ends when another step gains less than this, mm.
constexpr double kGain = 1e-10;

/// Valleys of two planes whose normals are closer than this, rad, have no direction to trust.
constexpr double kParallel = 1e-9;

/// How far below a plane a ball's centre may be, mm, and count as on it: rounding.
constexpr double kOnPlane = 1e-12;

/// n·c ≥ level: what one contact asks of the ball's centre.
struct Plane {
  Eigen::Vector3d normal;
  double level = 0.0;
};

/// The triangles found so far, and the lowest ball on the planes that stand for some of them.
class Contacts {
 public:
  Contacts(const DropCutter& cutter, const Eigen::Vector2d& q)
      : cutter_(cutter), q_(q), radius_(cutter.radius()) {}

  /// Takes up a triangle, in the place of the oldest if there are too many.
  void add(std::int32_t triangle) {
    for (std::size_t k = 0; k < size_; ++k) {
      if (triangles_[k] == triangle) return;
    }
    if (size_ < kMaxPlanes) {
      triangles_[size_++] = triangle;
    } else {
      std::rotate(triangles_.begin(), triangles_.begin() + 1, triangles_.end());
      triangles_.back() = triangle;
    }
  }

  /// Puts a plane in the place of every triangle, for balls near one that cuts none of them: its
  /// tangent plane if it touches the triangle, parallel to that if it does not. The distance of a
  /// triangle is convex in the centre, so that no ball above these planes cuts into a triangle.
  void lay_planes(const Eigen::Vector3d& centre) {
    for (std::size_t k = 0; k < size_; ++k) {
      const Eigen::Vector3d touched = nearest_point(cutter_.corners(triangles_[k]), centre);
      planes_[k].normal = (centre - touched).normalized();
      planes_[k].level = planes_[k].normal.dot(touched) + radius_;
    }
  }

  /// The least over all sets of up to three planes of the ball that touches just these, if it is
  /// not below another.
  [[nodiscard]] std::optional<LowestBall> lowest() const {
    std::optional<LowestBall> best;
    const auto offer = [&](const std::optional<LowestBall>& ball) {
      if (ball && (!best || ball->z < best->z) && allowed(ball->centre)) best = ball;
    };
    for (std::size_t a = 0; a < size_; ++a) {
      offer(on_plane(planes_[a]));
      for (std::size_t b = 0; b < a; ++b) {
        offer(in_valley(planes_[a], planes_[b]));
        for (std::size_t c = 0; c < b; ++c) offer(in_pit(planes_[a], planes_[b], planes_[c]));
      }
    }
    return best;
  }

 private:
  [[nodiscard]] bool allowed(const Eigen::Vector3d& centre) const {
    for (std::size_t k = 0; k < size_; ++k) {
      if (planes_[k].normal.dot(centre) < planes_[k].level - kOnPlane) return false;
    }
    return true;
  }

  [[nodiscard]] std::optional<LowestBall> on_plane(const Plane& plane) const {
    if (plane.normal.z() < kParallel) return std::nullopt;
    LowestBall ball;
    ball.z = (plane.level - radius_ - plane.normal.head<2>().dot(q_)) / plane.normal.z();
    ball.centre = Eigen::Vector3d(q_.x(), q_.y(), ball.z) + radius_ * plane.normal;
    return ball;
  }

  /// Both planes hold the ball: its centre is on a line a + t·d. The vertical through q is within R
  /// of the line above the lower of the two places where it is as far as R.
  [[nodiscard]] std::optional<LowestBall> in_valley(const Plane& first, const Plane& second) const {
    const Eigen::Vector3d across = first.normal.cross(second.normal);
    const double sine2 = across.squaredNorm();
    if (sine2 < kParallel * kParallel) return std::nullopt;
    const Eigen::Vector3d d = across / std::sqrt(sine2);
    const Eigen::Vector3d a =
        (first.level * second.normal.cross(across) + second.level * across.cross(first.normal)) /
        sine2;
    // |(q, z) − a|² less its part along d is R²: a quadratic in z.
    const Eigen::Vector3d o(q_.x() - a.x(), q_.y() - a.y(), 0.0);
    const Eigen::Vector3d from = o - o.dot(d) * d;
    const Eigen::Vector3d up(-d.z() * d.x(), -d.z() * d.y(), 1.0 - d.z() * d.z());
    const double up2 = up.squaredNorm();
    const double half = from.dot(up);
    const double root2 = half * half - up2 * (from.squaredNorm() - radius_ * radius_);
    if (root2 < 0.0 || up2 < kParallel) return std::nullopt;
    const double height = -(half + std::sqrt(root2)) / up2;
    LowestBall ball;
    ball.z = a.z() + height;
    const Eigen::Vector3d place(o.x(), o.y(), height);
    ball.centre = a + place.dot(d) * d;
    ball.spread = radius_ * (first.normal - second.normal).norm();
    return ball;
  }

  [[nodiscard]] std::optional<LowestBall> in_pit(const Plane& first, const Plane& second,
                                                 const Plane& third) const {
    Eigen::Matrix3d normals;
    normals << first.normal.transpose(), second.normal.transpose(), third.normal.transpose();
    const double volume = normals.determinant();
    if (std::abs(volume) < kParallel) return std::nullopt;
    LowestBall ball;
    ball.centre = normals.inverse() * Eigen::Vector3d(first.level, second.level, third.level);
    const double room = radius_ * radius_ - (q_ - ball.centre.head<2>()).squaredNorm();
    if (room < 0.0) return std::nullopt;
    ball.z = ball.centre.z() - std::sqrt(room);
    ball.spread = radius_ * std::max({(first.normal - second.normal).norm(),
                                      (second.normal - third.normal).norm(),
                                      (third.normal - first.normal).norm()});
    return ball;
  }

  const DropCutter& cutter_;
  Eigen::Vector2d q_;
  double radius_;
  std::array<std::int32_t, kMaxPlanes> triangles_{};
  std::array<Plane, kMaxPlanes> planes_{};
  std::size_t size_ = 0;
};

/// The ball that rests with its axis where that of `ball` is.
LowestBall lifted(const LowestBall& ball, const Eigen::Vector2d& q, double radius, double tip) {
  LowestBall rest = ball;
  rest.centre.z() = std::max(ball.centre.z(), tip + radius);
  rest.z = ball_below(rest.centre, radius, q.x(), q.y());
  return rest;
}

}  // namespace

/// Steps from one ball that rests to another that reaches deeper; where the next one cuts into a
/// triangle that was not known, that is taken up.
LowestBall LowestBallSearch::over(const Eigen::Vector2d& q, const TangentPlane& plane,
                                  CutterLocation& near) const {
  const double radius = cutter_.radius();
  const Eigen::Vector3d normal =
      Eigen::Vector3d(-plane.slope.x(), -plane.slope.y(), 1.0).normalized();
  const LowestBall tangent{plane.z, Eigen::Vector3d(q.x(), q.y(), plane.z) + radius * normal, 0.0};
  near = cutter_.drop(tangent.centre.head<2>(), near);
  if (!near.rests() || near.tip + radius <= tangent.centre.z() + resting_) return tangent;
  Contacts contacts(cutter_, q);
  LowestBall best = lifted(tangent, q, radius, near.tip);
  contacts.add(near.triangle);
  for (int k = 0; k < kMaxDrops; ++k) {
    contacts.lay_planes(best.centre);
    const std::optional<LowestBall> next = contacts.lowest();
    if (!next) return best;
    near = cutter_.drop(next->centre.head<2>(), near);
    if (!near.rests()) return best;
    const LowestBall rest = lifted(*next, q, radius, near.tip);
    const bool cuts = rest.centre.z() > next->centre.z() + resting_;
    const double gain = best.z - rest.z;
    if (gain >= 0.0) best = rest;
    if (!cuts && gain <= kGain) return best;
    contacts.add(near.triangle);
  }
  return best;
}

Eigen::Vector3d nearest_point(const Eigen::Matrix3d& corners, const Eigen::Vector3d& p) {
  const Eigen::Vector3d normal =
      (corners.col(1) - corners.col(0)).cross(corners.col(2) - corners.col(0));
  bool inside = normal.squaredNorm() > 0.0;
  Eigen::Vector3d best = corners.col(0);
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d a = corners.col(k);
    const Eigen::Vector3d edge = corners.col((k + 1) % 3) - a;
    inside = inside && normal.cross(edge).dot(p - a) >= 0.0;
    const double length2 = edge.squaredNorm();
    const double t = length2 > 0.0 ? std::clamp((p - a).dot(edge) / length2, 0.0, 1.0) : 0.0;
    const Eigen::Vector3d on_edge = a + t * edge;
    const double distance2 = (p - on_edge).squaredNorm();
    if (distance2 >= least) continue;
    least = distance2;
    best = on_edge;
  }
  if (!inside) return best;
  return p - normal * (normal.dot(p - corners.col(0)) / normal.squaredNorm());
}

}  // namespace lensforge
