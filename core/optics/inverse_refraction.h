// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/compute/host_device.h"

namespace lensforge {

/// Gradient (∂z/∂x, ∂z/∂y) of the surface that sends parallel light along +z into a ray of slope
/// m = (dx/dz, dy/dz): the inverse of RefractedBeam. By Snell's law b − ηẑ is parallel to the
/// normal, so the gradient is b_xy / (η − b_z).
LF_HD inline Eigen::Vector2d refracting_gradient(const Eigen::Vector2d& m, double eta) {
  const Eigen::Vector3d b = Eigen::Vector3d(m.x(), m.y(), 1.0).normalized();
  return b.head<2>() / (eta - b.z());
}

/// The same for light that travels along the unit vector a inside the lens, refracted by Snell's
/// law with b − ηa parallel to the normal.
LF_HD inline Eigen::Vector2d refracting_gradient(const Eigen::Vector2d& m, double eta,
                                                 const Eigen::Vector3d& a) {
  const Eigen::Vector3d b = Eigen::Vector3d(m.x(), m.y(), 1.0).normalized();
  return (b.head<2>() - eta * a.head<2>()) / (eta * a.z() - b.z());
}

/// The same for a mirror that light along the unit vector a falls on: b − a is parallel to the
/// normal.
LF_HD inline Eigen::Vector2d reflecting_gradient(const Eigen::Vector2d& m,
                                                 const Eigen::Vector3d& a) {
  const Eigen::Vector3d b = Eigen::Vector3d(m.x(), m.y(), 1.0).normalized();
  return (a.head<2>() - b.head<2>()) / (b.z() - a.z());
}

}  // namespace lensforge
