// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/compute/host_device.h"
#include "core/optics/front_surface.h"
#include "core/optics/refraction.h"

namespace lensforge {

/// What comes to a front: parallel light of one direction, or light from a point.
struct FrontLight {
  Eigen::Vector3d from;  ///< A unit direction, or the place of the point, mm.
  bool point;
  double ior;  ///< Behind the front.
};

/// The ray behind a curved front at one of the front's points (Sun et al., section 3.5).
///
/// Notation: e the point on the front, x its place in x and y, a and b unit directions of the light
/// before and behind it, b_by_x and b_by_y the derivatives by x, n the unit normal towards the
/// inside, w = (−∇h, 1) = |w| n, m = (b_x, b_y)/b_z. A bar (…_bar) is a derivative by that.
struct FrontRefraction {
  Eigen::Vector3d e = unknown();
  Eigen::Vector3d b = unknown();
  Eigen::Vector2d gradient{0.0, 0.0};  ///< ∇h
  Eigen::Vector3d b_by_x{0.0, 0.0, 0.0};
  Eigen::Vector3d b_by_y{0.0, 0.0, 0.0};
  double inside = 1.0;  ///< n·b
  Eigen::Vector2d inside_by_x{0.0, 0.0};
  bool lit = false;  ///< False where the light comes from the other side.

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
    inside = root;
    for (int j = 0; j < 2; ++j) {
      const Eigen::Vector3d dw(-h.bend[j], -h.bend[j + 1], 0.0);
      const Eigen::Vector3d dn = (dw - n.dot(dw) * n) / length;
      const Eigen::Vector3d de(j == 0 ? 1.0 : 0.0, j == 0 ? 0.0 : 1.0, h.gradient[j]);
      Eigen::Vector3d da(0.0, 0.0, 0.0);
      if (light.point) da = (de - a.dot(de) * a) / distance;
      const double dc = dn.dot(a) + n.dot(da);
      inside_by_x[j] = eta * eta * c / root * dc;
      const double dk = inside_by_x[j] - eta * dc;
      (j == 0 ? b_by_x : b_by_y) = dk * n + k * dn + eta * da;
    }
  }

  [[nodiscard]] LF_HD static Eigen::Vector3d unknown() {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    return {nan, nan, nan};
  }
  [[nodiscard]] LF_HD Eigen::Vector2d slope() const { return {b.x() / b.z(), b.y() / b.z()}; }
  /// To another point of the front, to first order.
  LF_HD void move(const Eigen::Vector2d& step) {
    e += Eigen::Vector3d(step.x(), step.y(), gradient.dot(step));
    b += step.x() * b_by_x + step.y() * b_by_y;
    inside += inside_by_x.dot(step);
  }
};

/// The ray from a source through a curved front to a point p behind it: Newton's method on
/// x + (p_z − h(x)) m(x) = p_xy.
class FrontEntry {
 public:
  FrontEntry() = default;
  LF_HD FrontEntry(const FrontSurface& front, const FrontLight& light, const Eigen::Vector3d& p) {
    Eigen::Vector2d x(p.x(), p.y());
    if (!front.covers(x)) return;
    for (int i = 0; i < kMaxSteps; ++i) {
      const FrontRefraction ray(front, light, x);
      if (!ray.lit || !(ray.b.z() > 0.0)) return;
      const Eigen::Vector2d m = ray.slope();
      const double rise = p.z() - ray.e.z();
      Eigen::Matrix2d lands = Eigen::Matrix2d::Identity();
      for (int j = 0; j < 2; ++j) {
        const Eigen::Vector3d& db = j == 0 ? ray.b_by_x : ray.b_by_y;
        const Eigen::Vector2d dm = (Eigen::Vector2d(db.x(), db.y()) - db.z() * m) / ray.b.z();
        lands.col(j) += rise * dm - ray.gradient[j] * m;
      }
      // Beyond where neighbouring rays meet, the light has folded over.
      const double det = lands(0, 0) * lands(1, 1) - lands(0, 1) * lands(1, 0);
      if (!(det > 0.0)) return;
      Eigen::Matrix2d inverse;
      inverse << lands(1, 1), -lands(0, 1), -lands(1, 0), lands(0, 0);
      inverse /= det;
      Eigen::Vector2d step = inverse * (x + rise * m - Eigen::Vector2d(p.x(), p.y()));
      if (step.norm() <= kNear * (p.cwiseAbs().sum() + std::fabs(ray.e.z())) + kTiny) {
        ray_ = ray;
        ray_.move(-step);
        inverse_ = inverse;
        return;
      }
      for (int k = 0; k < kMaxSteps && !front.covers(x - step); ++k) step *= 0.5;
      x -= step;
    }
  }

  /// Direction behind the front; NaN where no ray comes to p.
  [[nodiscard]] LF_HD const Eigen::Vector3d& direction() const { return ray_.b; }
  /// Where the ray enters the front; NaN where none comes to p.
  [[nodiscard]] LF_HD const Eigen::Vector3d& entry() const { return ray_.e; }

  /// Cosine of the angle between direction() and the front's normal there.
  [[nodiscard]] LF_HD double cosine() const { return ray_.inside; }

  /// Adjoint of p ↦ direction(): the derivative by p.
  [[nodiscard]] LF_HD Eigen::Vector3d direction_adjoint(const Eigen::Vector3d& b_bar) const {
    return place_adjoint({ray_.b_by_x.dot(b_bar), ray_.b_by_y.dot(b_bar)});
  }
  /// Adjoint of p ↦ entry(): the derivative by p.
  [[nodiscard]] LF_HD Eigen::Vector3d entry_adjoint(const Eigen::Vector3d& e_bar) const {
    return place_adjoint(Eigen::Vector2d(e_bar.x(), e_bar.y()) + e_bar.z() * ray_.gradient);
  }

  /// Adjoint of p ↦ cosine(): the derivative by p.
  [[nodiscard]] LF_HD Eigen::Vector3d cosine_adjoint(double bar) const {
    return place_adjoint(bar * ray_.inside_by_x);
  }

 private:
  /// The last step of Newton's method, as a share of the point's coordinates, and in mm where they
  /// are 0, is taken to first order: what is left is of the order of its square. Lenses need three
  /// or four steps.
  static constexpr double kNear = 1e-9;
  static constexpr double kTiny = 1e-12;
  static constexpr int kMaxSteps = 30;

  /// By the rule of implicit functions: ∂x/∂p = L⁻¹ (1, −m), L the derivative of where x's ray
  /// meets the height of p.
  [[nodiscard]] LF_HD Eigen::Vector3d place_adjoint(const Eigen::Vector2d& x_bar) const {
    const Eigen::Vector2d w = inverse_.transpose() * x_bar;
    return {w.x(), w.y(), -ray_.slope().dot(w)};
  }

  FrontRefraction ray_;
  Eigen::Matrix2d inverse_ = Eigen::Matrix2d::Identity();  ///< L⁻¹
};

/// Entries of the rays to a triangle's corners, where they have been found before: null elsewhere.
struct CornerEntries {
  const FrontEntry* e0 = nullptr;
  const FrontEntry* e1 = nullptr;
  const FrontEntry* e2 = nullptr;
};

/// Entries of the rays to all vertices of a mesh behind a curved front; none behind a flat one.
struct VertexEntries {
  const FrontEntry* of = nullptr;
  std::int64_t count = 0;

  [[nodiscard]] LF_HD const FrontEntry* at(std::int64_t vertex) const {
    return count > 0 ? of + vertex : nullptr;
  }
  [[nodiscard]] LF_HD CornerEntries at(const int* triangle) const {
    return {at(triangle[0]), at(triangle[1]), at(triangle[2])};
  }
};

}  // namespace lensforge
