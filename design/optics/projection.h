// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/compute/host_device.h"
#include "core/optics/image_plane.h"
#include "design/optics/refraction.h"

namespace lensforge {

/// Carries surface points along refracted rays onto the receiving plane, in pixel coordinates.
/// Parallel light along +z, refraction from the lens into air.
struct Projection {
  explicit Projection(const OpticalSetup& setup)
      : plane(setup), focal_length(setup.focal_length), eta(setup.ior) {}

  ImagePlane plane;
  double focal_length;  ///< z of the receiving plane, mm
  double eta;           ///< n_lens / n_air

  /// True if a surface of this unit normal lets the light out. Rays then leave with b_z > 0 and do
  /// not meet the height field again (Sun et al., Appendix B).
  [[nodiscard]] LF_HD bool transmits(const Eigen::Vector3d& n) const {
    return n.z() > 0.0 && refracted_cosine_squared(n.z(), eta) > 0.0;
  }

  /// Where a ray of slope m that leaves the surface at p (mm) lands, in pixel coordinates.
  [[nodiscard]] LF_HD Eigen::Vector2d land(const Eigen::Vector3d& p,
                                           const Eigen::Vector2d& m) const {
    return plane.to_pixels(Eigen::Vector2d(p.x(), p.y()) + (focal_length - p.z()) * m);
  }

  /// Adjoint of land(): adds to p_bar and m_bar for a given u_bar.
  LF_HD void land_adjoint(const Eigen::Vector3d& p, const Eigen::Vector2d& m,
                          const Eigen::Vector2d& u_bar, Eigen::Vector3d& p_bar,
                          Eigen::Vector2d& m_bar) const {
    const Eigen::Vector2d mm_bar = plane.pixels_per_mm().cwiseProduct(u_bar);
    p_bar += Eigen::Vector3d(mm_bar.x(), mm_bar.y(), -m.dot(mm_bar));
    m_bar += (focal_length - p.z()) * mm_bar;
  }
};

}  // namespace lensforge
