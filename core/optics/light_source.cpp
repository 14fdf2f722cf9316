// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/light_source.h"

#include "core/optics/refraction.h"

namespace lensforge {

LightSource::LightSource(const OpticalSetup& setup)
    : direction_(setup.light),
      position_(Eigen::Vector3d::Zero()),
      axis_(Eigen::Vector3d::UnitZ()),
      eta_(setup.ior),
      scale_(1.0),
      lambertian_(0.0),
      kind_(Kind::kAlongZ) {
  const bool lens = setup.mode == LightMode::kRefract;
  if (setup.front) front_ = FrontSurface(*setup.front);
  if (setup.point) {
    kind_ = setup.front ? Kind::kPointBent : lens ? Kind::kPointBehindFront : Kind::kPoint;
    position_ = setup.point->position;
    const Eigen::Vector3d middle(0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), 0.0);
    const Eigen::Vector3d way = middle - position_;
    axis_ = way.normalized();
    // An evenly lit lens takes in its plan area; a solid angle is plan area × |way_z| / |way|³.
    scale_ = way.squaredNorm() * way.norm() / way.z();
    lambertian_ = setup.point->emission == Emission::kLambertian ? 1.0 : 0.0;
  } else if (setup.front) {
    kind_ = Kind::kParallelBent;
  } else if (!lens) {
    kind_ = Kind::kParallel;
  } else if (setup.light != Eigen::Vector3d::UnitZ()) {
    kind_ = Kind::kParallel;
    direction_ = refract(setup.light, Eigen::Vector3d::UnitZ(), 1.0 / setup.ior);
  }
}

Eigen::Vector3d LightSource::mean_direction(const Eigen::Vector2d& size) const {
  constexpr int kSamples = 64;  // Along an edge.
  // The mean derivative along a line follows from the line's ends.
  Eigen::Vector2d rise = Eigen::Vector2d::Zero();
  for (int k = 0; k < kSamples; ++k) {
    const Eigen::Vector2d along = (k + 0.5) / kSamples * size;
    rise += Eigen::Vector2d(front_.height({size.x(), along.y()}) - front_.height({0.0, along.y()}),
                            front_.height({along.x(), size.y()}) - front_.height({along.x(), 0.0}));
  }
  const Eigen::Vector2d gradient = rise.cwiseQuotient(kSamples * size);
  const Eigen::Vector3d n = Eigen::Vector3d(-gradient.x(), -gradient.y(), 1.0).normalized();
  const bool point = kind_ == Kind::kPointBent;
  const Eigen::Vector3d way =
      point ? Eigen::Vector3d((front_at(0.5 * size) - position_).normalized()) : direction_;
  return refract(way, n, 1.0 / eta_);
}

Eigen::Vector3d LightSource::entry(const Eigen::Vector3d& p) const {
  if (varies()) return position_ + vector_to(p);
  return p;
}

}  // namespace lensforge
