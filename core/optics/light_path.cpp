// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/light_path.h"

#include <cmath>

#include "core/optics/inverse_refraction.h"

namespace lensforge {

LightPath::LightPath(const OpticalSetup& setup)
    : plane_(setup),
      focal_length_(setup.focal_length),
      eta_(setup.ior),
      lens_area_(setup.lens_size.prod()),
      kind_(setup.light == Eigen::Vector3d::UnitZ() ? Kind::kAlongZ : Kind::kOblique),
      direction_(Eigen::Vector3d::UnitZ()),
      deflection_(setup.ior - 1.0) {
  if (kind_ == Kind::kAlongZ) return;
  direction_ = refract(setup.light, Eigen::Vector3d::UnitZ(), 1.0 / setup.ior);
  // A normal's x and y are minus the slope to first order; the geometric mean over all directions.
  const RefractedBeam flat(direction_, Eigen::Vector3d::UnitZ(), eta_);
  const Eigen::Vector3d by_x = flat.adjoint(direction_, Eigen::Vector3d::UnitZ(), eta_, {1.0, 0.0});
  const Eigen::Vector3d by_y = flat.adjoint(direction_, Eigen::Vector3d::UnitZ(), eta_, {0.0, 1.0});
  deflection_ = std::sqrt(std::abs(by_x.x() * by_y.y() - by_x.y() * by_y.x()));
}

Eigen::Vector2d LightPath::gradient_for(const Eigen::Vector3d& p,
                                        const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d m = (plane_.to_mm(pixel) - p.head<2>()) / (focal_length_ - p.z());
  if (kind_ == Kind::kAlongZ) return refracting_gradient(m, eta_);
  return refracting_gradient(m, eta_, direction_);
}

Eigen::Vector2d LightPath::land_from_flat(const Eigen::Vector3d& p) const {
  return land(p, beam(p, Eigen::Vector3d::UnitZ()).m);
}

Eigen::Vector2d LightPath::place_on_flat(const Eigen::Vector2d& pixel, double z) const {
  const Eigen::Vector2d mm = plane_.to_mm(pixel);
  const Eigen::Vector3d below(mm.x(), mm.y(), z);
  return mm - (focal_length_ - z) * beam(below, Eigen::Vector3d::UnitZ()).m;
}

double LightPath::reach(double slope, double z) const {
  return slope * deflection_ * (focal_length_ - z);
}

}  // namespace lensforge
