// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/light/light_paths.h"

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

/// Point number `index` of a face, its corners' plane evenly covered.
Eigen::Vector3d sample_point(const Corners& c, std::int64_t face, std::int64_t index) {
  const double shift = fraction(kStepFace * static_cast<double>(face));
  double u = fraction(shift + kStepU * static_cast<double>(index + 1));
  double v = fraction(shift + kStepV * static_cast<double>(index + 1));
  if (u + v > 1.0) {
    u = 1.0 - u;
    v = 1.0 - v;
  }
  return (1.0 - u - v) * c.v0 + u * c.v1 + v * c.v2;
}

/// Orthonormal, with n as its last column.
Eigen::Matrix3d frame_of(const Eigen::Vector3d& n) {
  Eigen::Matrix3d frame;
  frame.col(2) = n;
  frame.col(0) = n.unitOrthogonal();
  frame.col(1) = n.cross(frame.col(0));
  return frame;
}

}  // namespace

/// Sends the rays of one face.
class LightPaths::Caster {
 public:
  Caster(const SurfaceMesh& mesh, const Goal& goal, LightPaths& paths)
      : mesh_(mesh), goal_(goal), paths_(paths), scene_(mesh) {}

  void cast(std::int64_t face) const {
    const Eigen::Vector3d n = paths_.faces_.normal.col(face);
    for (Eigen::Index d = 0; d < paths_.directions_.count(); ++d) {
      paths_.flags_[paths_.slot(face, d)] = flags(face, n, d);
    }
    gather(face, n);
  }

 private:
  [[nodiscard]] std::uint8_t flags(std::int64_t face, const Eigen::Vector3d& n,
                                   Eigen::Index d) const {
    const Eigen::Vector3d p = scene_.lifted(sample_point(mesh_.corners(face), face, d), n);
    const bool lit = reaches(p, n, paths_.light(d), std::numeric_limits<double>::infinity());
    if (!goal_.has_place()) return lit ? kLit | kSeen : 0;
    const Eigen::Vector3d away = goal_.place(p) - p;
    const bool seen = reaches(p, n, away.normalized(), away.norm());
    return static_cast<std::uint8_t>((lit ? kLit : 0) | (seen ? kSeen : 0));
  }

  [[nodiscard]] bool reaches(const Eigen::Vector3d& p, const Eigen::Vector3d& n,
                             const Eigen::Vector3d& w, double reach) const {
    return n.dot(w) > 0.0 && !scene_.blocked(p, w, reach);
  }

  /// Faces met from behind, as on an open mesh, pass no light on.
  void gather(std::int64_t face, const Eigen::Vector3d& n) const {
    if (n.isZero()) return;  // A face that lost its area looks nowhere.
    const double turn = 2.0 * std::numbers::pi * fraction(kStepFace * static_cast<double>(face));
    const Eigen::Matrix3d frame = frame_of(n);
    const Eigen::Matrix3Xd local = hemisphere_directions(paths_.gather_, turn);
    std::int32_t count = 0;
    for (int i = 0; i < paths_.gather_; ++i) {
      const Eigen::Vector3d w = frame * local.col(i);
      const Eigen::Vector3d p = scene_.lifted(sample_point(mesh_.corners(face), face, i), n);
      const RayHit hit = scene_.nearest(p, w);
      if (!hit.met() || paths_.faces_.normal.col(hit.face).dot(w) >= 0.0) continue;
      paths_.hits_[static_cast<std::size_t>(face * paths_.gather_ + count++)] = {w.cast<float>(),
                                                                                 hit.face};
    }
    paths_.hit_count_[static_cast<std::size_t>(face)] = count;
  }

  const SurfaceMesh& mesh_;
  const Goal& goal_;
  LightPaths& paths_;
  RayScene scene_;
};

LightPaths::LightPaths(const SurfaceMesh& mesh, const Goal& goal, DirectionSet directions,
                       int gather, const Executor& executor)
    : faces_(measure_faces(mesh)),
      directions_(std::move(directions)),
      flags_(static_cast<std::size_t>(faces_.count() * directions_.count())),
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
