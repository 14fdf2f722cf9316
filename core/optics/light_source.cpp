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
    // An evenly lit lens takes its plan area: a solid angle is plan area × |way_z| / |way|³.
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

Eigen::Vector3d LightSource::entry(const Eigen::Vector3d& p) const {
  if (varies()) return position_ + vector_to(p);
  return p;
}

}  // namespace lensforge
