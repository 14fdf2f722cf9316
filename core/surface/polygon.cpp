// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/polygon.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace lensforge {
namespace {

/// Twice the area vector of the polygon (Newell).
Eigen::Vector3d newell_normal(const Eigen::Matrix3Xd& corners) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  const Eigen::Vector3d origin = corners.col(0);
  for (Eigen::Index i = 1; i + 1 < corners.cols(); ++i) {
    normal += (corners.col(i) - origin).cross(corners.col(i + 1) - origin);
  }
  return normal;
}

/// The polygon projected along the axis nearest to its normal, counter-clockwise. Dropping a
/// coordinate does not round, so collinear corners stay collinear.
Eigen::Matrix2Xd seen_flat(const Eigen::Matrix3Xd& corners) {
  const Eigen::Vector3d normal = newell_normal(corners);
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  Eigen::Matrix2Xd flat(2, corners.cols());
  flat.row(0) = corners.row((axis + 1) % 3);
  flat.row(1) = corners.row((axis + 2) % 3);
  if (normal[axis] < 0.0) flat.row(0) = -flat.row(0);
  return flat;
}

/// Twice the area of a triangle, above 0 if it is counter-clockwise.
double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

class EarClipper {
 public:
  explicit EarClipper(const Eigen::Matrix3Xd& corners)
      : points_(seen_flat(corners)), left_(static_cast<int>(corners.cols())) {
    for (int i = 0; i < left_; ++i) {
      next_.push_back((i + 1) % left_);
      before_.push_back((i + left_ - 1) % left_);
    }
  }

  std::vector<Eigen::Vector3i> triangles() {
    if (is_convex()) return fan();
    for (int i = 0; i < left_; ++i) ear_.push_back(is_ear(i));
    int at = 0;
    while (left_ > 3) at = clipped(next_ear(at));
    add(at);
    return triangles_;
  }

 private:
  [[nodiscard]] Eigen::Vector2d point(int i) const { return points_.col(i); }
  [[nodiscard]] double turn_at(int i) const {
    return turn(point(before_[number(i)]), point(i), point(next_[number(i)]));
  }
  static std::size_t number(int i) { return static_cast<std::size_t>(i); }

  /// True if all corners turn left, once around in total (the corners of a star turn left too).
  [[nodiscard]] bool is_convex() const {
    double around = 0.0;
    for (int i = 0; i < left_; ++i) {
      const double cross = turn_at(i);
      if (!(cross > 0.0)) return false;
      const Eigen::Vector2d in = point(i) - point(before_[number(i)]);
      const Eigen::Vector2d out = point(next_[number(i)]) - point(i);
      around += std::atan2(cross, in.dot(out));
    }
    return around < 7.0;  // 2π, and not 4π.
  }

  [[nodiscard]] std::vector<Eigen::Vector3i> fan() const {
    std::vector<Eigen::Vector3i> triangles;
    for (int i = 1; i + 1 < left_; ++i) triangles.emplace_back(0, i, i + 1);
    return triangles;
  }

  /// True if a corner is in the triangle or on its edges. A corner that coincides with one of the
  /// triangle's, as in a polygon cut open around a hole, does not count.
  [[nodiscard]] bool is_inside(int i, const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                               const Eigen::Vector2d& c) const {
    const Eigen::Vector2d p = point(i);
    if (p == a || p == b || p == c) return false;
    return turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
  }

  /// True if the triangle at a corner can be cut off. Only corners that do not turn left can
  /// obstruct it.
  [[nodiscard]] bool is_ear(int i) const {
    if (!(turn_at(i) > 0.0)) return false;
    const int last = before_[number(i)];
    const Eigen::Vector2d a = point(last);
    const Eigen::Vector2d b = point(i);
    const Eigen::Vector2d c = point(next_[number(i)]);
    for (int j = next_[number(next_[number(i)])]; j != last; j = next_[number(j)]) {
      if (!(turn_at(j) > 0.0) && is_inside(j, a, b, c)) return false;
    }
    return true;
  }

  /// The first ear from `at` on; `at` itself if there is none.
  [[nodiscard]] int next_ear(int at) const {
    int i = at;
    while (!ear_[number(i)]) {
      i = next_[number(i)];
      if (i == at) break;
    }
    return i;
  }

  void add(int i) { triangles_.emplace_back(before_[number(i)], i, next_[number(i)]); }

  /// Cuts a corner off. Other corners' ears do not change, so only its neighbours are checked
  /// again. @return the next corner but one, to avoid thin fans where possible.
  int clipped(int i) {
    add(i);
    const int before = before_[number(i)];
    const int next = next_[number(i)];
    next_[number(before)] = next;
    before_[number(next)] = before;
    --left_;
    ear_[number(before)] = is_ear(before);
    ear_[number(next)] = is_ear(next);
    return next_[number(next)];
  }

  Eigen::Matrix2Xd points_;
  int left_;
  std::vector<int> next_;
  std::vector<int> before_;
  std::vector<bool> ear_;
  std::vector<Eigen::Vector3i> triangles_;
};

}  // namespace

std::vector<Eigen::Vector3i> polygon_triangles(const Eigen::Matrix3Xd& corners) {
  return EarClipper(corners).triangles();
}

}  // namespace lensforge
