// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "core/compute/host_device.h"
#include "core/optics/front_surface.h"
#include "core/optics/incident_ray.h"
#include "core/optics/refraction.h"

namespace lensforge {

/// Light that meets a front: parallel, or from a point.
struct FrontLight {
  Eigen::Vector3d from;  ///< A unit direction, or the position of the point, mm.
  bool point;
  double ior;  ///< Refractive index behind the front.
};

/// The ray behind a curved front at one of the front's points (Sun et al., section 3.5).
///
/// Notation: e the point on the front, x its x and y, a and b unit directions of the light before
/// and behind it, b_by_x and b_by_y the derivatives by x, n the inward unit normal, w = (−∇h, 1) =
/// |w| n, m = (b_x, b_y)/b_z. A bar (…_bar) is a derivative by that quantity.
struct FrontRefraction {
  Eigen::Vector3d e = unknown();
  Eigen::Vector3d b = unknown();
  Eigen::Vector2d gradient{0.0, 0.0};  ///< ∇h
  Eigen::Vector3d b_by_x{0.0, 0.0, 0.0};
  Eigen::Vector3d b_by_y{0.0, 0.0, 0.0};
  bool lit = false;  ///< False if the light comes from the other side.

  FrontRefraction() = default;
  LF_HD FrontRefraction(const FrontSurface& front, const FrontLight& light,
                        const Eigen::Vector2d& x) {
    const FrontPoint h = front.at(x);
    e = {x.x(), x.y(), h.z};
    gradient = h.gradient;
    const Eigen::Vector3d w(-h.gradient.x(), -h.gradient.y(), 1.0);
    const double length = w.norm();
    const Eigen::Vector3d n = w / length;
    const Eigen::Vector3d way = light.point ? Eigen::Vector3d(e - light.from) : light.from;
    const double distance = way.norm();
    const Eigen::Vector3d a = way / distance;
    const double eta = 1.0 / light.ior;
    const double c = n.dot(a);
    lit = c > 0.0;
    const double root = std::sqrt(refracted_cosine_squared(c, eta));
    const double k = root - eta * c;
    b = k * n + eta * a;
    for (int j = 0; j < 2; ++j) {
      const Eigen::Vector3d dw(-h.bend[j], -h.bend[j + 1], 0.0);
      const Eigen::Vector3d dn = (dw - n.dot(dw) * n) / length;
      const Eigen::Vector3d de(j == 0 ? 1.0 : 0.0, j == 0 ? 0.0 : 1.0, h.gradient[j]);
      Eigen::Vector3d da(0.0, 0.0, 0.0);
      if (light.point) da = (de - a.dot(de) * a) / distance;
      const double dc = dn.dot(a) + n.dot(da);
      const double dk = (eta * eta * c / root - eta) * dc;
      (j == 0 ? b_by_x : b_by_y) = dk * n + k * dn + eta * da;
    }
  }

  [[nodiscard]] LF_HD static Eigen::Vector3d unknown() {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    return {nan, nan, nan};
  }
  [[nodiscard]] LF_HD Eigen::Vector2d slope() const { return {b.x() / b.z(), b.y() / b.z()}; }
  /// Derivative of slope() by x.
  [[nodiscard]] LF_HD Eigen::Matrix2d slope_by_x() const {
    const Eigen::Vector2d m = slope();
    Eigen::Matrix2d by_x;
    for (int j = 0; j < 2; ++j) {
      const Eigen::Vector3d& db = j == 0 ? b_by_x : b_by_y;
      by_x.col(j) = (Eigen::Vector2d(db.x(), db.y()) - db.z() * m) / b.z();
    }
    return by_x;
  }
  /// Derivative by x of the point where the ray reaches height z. The light has folded over if the
  /// determinant is not positive.
  [[nodiscard]] LF_HD Eigen::Matrix2d landing_by_x(double z) const {
    const Eigen::Vector2d m = slope();
    Eigen::Matrix2d lands = Eigen::Matrix2d::Identity() + (z - e.z()) * slope_by_x();
    for (int j = 0; j < 2; ++j) lands.col(j) -= gradient[j] * m;
    return lands;
  }
  /// @param x_by_p  derivative of x by the point behind the front that the ray goes through.
  [[nodiscard]] LF_HD IncidentRay ray(const Eigen::Matrix2d& x_by_p) const {
    return {slope(), {e.x(), e.y()}, e.z(), b.z(), gradient, slope_by_x() * x_by_p, x_by_p};
  }
  /// Moves to another point of the front, to first order.
  LF_HD void move(const Eigen::Vector2d& step) {
    e += Eigen::Vector3d(step.x(), step.y(), gradient.dot(step));
    b += step.x() * b_by_x + step.y() * b_by_y;
  }
};

/// Newton's method ends at a step below kNearEntry of the point's coordinates plus kTinyEntry mm.
/// That step is taken to first order, so the error is of the order of its square. Lenses need three
/// or four steps.
inline constexpr double kNearEntry = 1e-9;
inline constexpr double kTinyEntry = 1e-12;
inline constexpr int kMaxEntrySteps = 30;

/// The ray from a source through a curved front to a point p behind it: Newton's method on x + (p_z
/// − h(x)) m(x) = p_xy. All NaN if no ray reaches p.
LF_HD inline IncidentRay ray_through_front(const FrontSurface& front, const FrontLight& light,
                                           const Eigen::Vector3d& p) {
  IncidentRay found = FrontRefraction().ray(Eigen::Matrix2d::Identity());
  Eigen::Vector2d x(p.x(), p.y());
  if (!front.covers(x)) return found;
  for (int i = 0; i < kMaxEntrySteps; ++i) {
    FrontRefraction ray(front, light, x);
    if (!ray.lit || !(ray.b.z() > 0.0)) return found;
    const Eigen::Vector2d m = ray.slope();
    const double rise = p.z() - ray.e.z();
    const Eigen::Matrix2d lands = ray.landing_by_x(p.z());
    // Beyond where neighbouring rays meet, the light has folded over.
    const double det = lands(0, 0) * lands(1, 1) - lands(0, 1) * lands(1, 0);
    if (!(det > 0.0)) return found;
    Eigen::Matrix2d inverse;
    inverse << lands(1, 1), -lands(0, 1), -lands(1, 0), lands(0, 0);
    inverse /= det;
    Eigen::Vector2d step = inverse * (x + rise * m - Eigen::Vector2d(p.x(), p.y()));
    if (step.norm() <= kNearEntry * (p.cwiseAbs().sum() + std::fabs(ray.e.z())) + kTinyEntry) {
      ray.move(-step);
      return ray.ray(inverse);
    }
    for (int k = 0; k < kMaxEntrySteps && !front.covers(x - step); ++k) step *= 0.5;
    x -= step;
  }
  return found;
}

}  // namespace lensforge
