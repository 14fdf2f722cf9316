// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/light/light_paths.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "design/reflect/light/ray_scene.h"

namespace lensforge::reflect {
namespace {

/// Faces per task: some ten thousand rays.
constexpr std::int64_t kFaceGrain = 32;

/// Steps of the R2 sequence and, between faces, of the golden ratio.
constexpr double kStepU = 0.7548776662466927;
constexpr double kStepV = 0.5698402909980532;
constexpr double kStepFace = 0.6180339887498949;

double fraction(double x) { return x - std::floor(x); }

/// Points that cover a triangle evenly, the same for every face but for a shift.
class FacePoints {
 public:
  explicit FacePoints(Eigen::Index count) {
    for (Eigen::Index i = 1; i <= count; ++i) {
      u_.push_back(fraction(kStepU * static_cast<double>(i)));
      v_.push_back(fraction(kStepV * static_cast<double>(i)));
    }
  }

  /// Point number `index` of a face. @param shift  in 0 … 1.
  [[nodiscard]] Eigen::Vector3d at(const Corners& c, double shift, Eigen::Index index) const {
    double u = u_[static_cast<std::size_t>(index)] + shift;
    double v = v_[static_cast<std::size_t>(index)] + shift;
    if (u >= 1.0) u -= 1.0;
    if (v >= 1.0) v -= 1.0;
    if (u + v > 1.0) {
      u = 1.0 - u;
      v = 1.0 - v;
    }
    return (1.0 - u - v) * c.v0 + u * c.v1 + v * c.v2;
  }

 private:
  std::vector<double> u_;
  std::vector<double> v_;
};

/// Orthonormal, with n as its last column; the others are turned about it.
Eigen::Matrix3d frame_of(const Eigen::Vector3d& n, double turn) {
  const Eigen::Vector3d a = n.unitOrthogonal();
  const Eigen::Vector3d b = n.cross(a);
  const double c = std::cos(turn);
  const double s = std::sin(turn);
  Eigen::Matrix3d frame;
  frame << c * a + s * b, c * b - s * a, n;
  return frame;
}

LaneVectors<double> lanes_of(const Eigen::Matrix3Xd& directions) {
  LaneVectors<double> lanes = LaneVectors<double>::Zero(padded(directions.cols()), 3);
  lanes.topRows(directions.cols()) = directions.transpose();
  return lanes;
}

}  // namespace

/// Sends the rays of one face.
class LightPaths::Caster {
 public:
  Caster(const SurfaceMesh& mesh, const Goal& goal, LightPaths& paths)
      : mesh_(mesh),
        goal_(goal),
        paths_(paths),
        scene_(mesh),
        points_(std::max<Eigen::Index>(paths.directions_.count(), paths.gather_)),
        hemisphere_(hemisphere_directions(paths.gather_)) {}

  void cast(std::int64_t number) const {
    const Face face{number, paths_.faces_.normal.col(number), mesh_.corners(number),
                    fraction(kStepFace * static_cast<double>(number))};
    for (Eigen::Index d = 0; d < paths_.directions_.count(); ++d) {
      paths_.flags_[paths_.slot(number, d)] = flags(face, d);
    }
    gather(face);
  }

 private:
  struct Face {
    std::int64_t number;
    Eigen::Vector3d normal;
    Corners corners;
    double shift;
  };

  [[nodiscard]] Eigen::Vector3d point(const Face& face, Eigen::Index i) const {
    return scene_.lifted(points_.at(face.corners, face.shift, i), face.normal);
  }

  [[nodiscard]] std::uint8_t flags(const Face& face, Eigen::Index d) const {
    const Eigen::Vector3d w = paths_.light(d);
    const bool facing = face.normal.dot(w) > 0.0;
    if (!facing && !goal_.has_place()) return 0;
    const Eigen::Vector3d p = point(face, d);
    const bool lit = facing && !scene_.blocked(p, w, std::numeric_limits<double>::infinity());
    if (!goal_.has_place()) return lit ? kLit | kSeen : 0;
    const Eigen::Vector3d away = goal_.place(p) - p;
    const bool seen =
        face.normal.dot(away) > 0.0 && !scene_.blocked(p, away.normalized(), away.norm());
    return static_cast<std::uint8_t>((lit ? kLit : 0) | (seen ? kSeen : 0));
  }

  /// Faces met from behind, as on an open mesh, pass no light on.
  void gather(const Face& face) const {
    if (face.normal.isZero()) return;  // A face that lost its area looks nowhere.
    const Eigen::Matrix3d frame = frame_of(face.normal, 2.0 * std::numbers::pi * face.shift);
    std::int32_t count = 0;
    for (int i = 0; i < paths_.gather_; ++i) {
      const Eigen::Vector3d w = frame * hemisphere_.col(i);
      const RayHit hit = scene_.nearest(point(face, i), w);
      if (!hit.met() || paths_.faces_.normal.col(hit.face).dot(w) >= 0.0) continue;
      paths_.hits_[static_cast<std::size_t>(face.number * paths_.gather_ + count++)] = {
          w.cast<float>(), hit.face};
    }
    paths_.hit_count_[static_cast<std::size_t>(face.number)] = count;
  }

  const SurfaceMesh& mesh_;
  const Goal& goal_;
  LightPaths& paths_;
  RayScene scene_;
  FacePoints points_;
  Eigen::Matrix3Xd hemisphere_;
};

LightPaths::LightPaths(const SurfaceMesh& mesh, const Goal& goal, DirectionSet directions,
                       int gather, const Executor& executor)
    : faces_(measure_faces(mesh)),
      directions_(std::move(directions)),
      light_lanes_(lanes_of(directions_.light)),
      flags_(static_cast<std::size_t>(faces_.count() * light_lanes_.rows())),
      gather_(gather),
      hits_(static_cast<std::size_t>(faces_.count() * gather)),
      hit_count_(static_cast<std::size_t>(faces_.count())) {
  if (goal.has_place()) {
    to_place_.resize(3, faces_.count());
    for (Eigen::Index k = 0; k < faces_.count(); ++k) {
      const Eigen::Vector3d p = faces_.centroid.col(k);
      to_place_.col(k) = (goal.place(p) - p).normalized();
    }
  }
  const Caster caster(mesh, goal, *this);
  parallel_for(
      executor, "light paths", faces_.count(), [&](std::int64_t face) { caster.cast(face); },
      kFaceGrain);
}

}  // namespace lensforge::reflect
