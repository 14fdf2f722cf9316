// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

#include "core/compute/host_device.h"
#include "core/compute/lanes.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/front.h"
#include "core/optics/optical_setup.h"
#include "core/optics/refraction.h"

namespace lensforge {

/// The ray that reaches a surface point, and its derivatives by that point: everything that is
/// costly to find if the light's direction varies. Moving the point along its ray changes nothing,
/// so derivatives by x and y suffice.
///
/// Notation: p the point, a the ray's unit direction there, m = (a_x, a_y)/a_z its slope, e the
/// point where it enters the lens, x the x and y of e, ∇h the front's gradient there. A bar (…_bar)
/// is a derivative by that quantity. All NaN if no ray reaches p.
struct IncidentRay {
  Eigen::Vector2d m;
  Eigen::Vector2d x;         ///< mm
  double z;                  ///< z of e, mm.
  double a_z;                ///< Negative for a mirror's light.
  Eigen::Vector2d gradient;  ///< ∇h
  Eigen::Matrix2d m_by_p;    ///< ∂m/∂(p_x, p_y), 1/mm
  Eigen::Matrix2d x_by_p;    ///< ∂x/∂(p_x, p_y)

  [[nodiscard]] LF_HD LF_INLINE Eigen::Vector3d direction() const {
    return {a_z * m.x(), a_z * m.y(), a_z};
  }
  [[nodiscard]] LF_HD LF_INLINE Eigen::Vector3d entry() const { return {x.x(), x.y(), z}; }

  /// Adjoint of p ↦ direction(): the derivative by p.
  [[nodiscard]] LF_HD LF_INLINE Eigen::Vector3d direction_adjoint(
      const Eigen::Vector3d& a_bar) const {
    return by_point(m_by_p, slope_bar(a_bar));
  }
  /// Adjoint of m ↦ direction().
  [[nodiscard]] LF_HD LF_INLINE Eigen::Vector2d slope_bar(const Eigen::Vector3d& a_bar) const {
    // a is w/|w| of w = (m, 1), or its opposite: ∂a/∂w = a_z (1 − a aᵀ).
    const double along = a_z * (m.x() * a_bar.x() + m.y() * a_bar.y() + a_bar.z());
    return {a_z * (a_bar.x() - along * a_z * m.x()), a_z * (a_bar.y() - along * a_z * m.y())};
  }
  /// Adjoint of p ↦ entry(): the derivative by p.
  [[nodiscard]] LF_HD LF_INLINE Eigen::Vector3d entry_adjoint(const Eigen::Vector3d& e_bar) const {
    return place_adjoint(
        {e_bar.x() + gradient.x() * e_bar.z(), e_bar.y() + gradient.y() * e_bar.z()});
  }
  /// Adjoint of p ↦ x: the derivative by p.
  [[nodiscard]] LF_HD LF_INLINE Eigen::Vector3d place_adjoint(const Eigen::Vector2d& x_bar) const {
    return by_point(x_by_p, x_bar);
  }

 private:
  [[nodiscard]] LF_HD LF_INLINE Eigen::Vector3d by_point(const Eigen::Matrix2d& change,
                                                         const Eigen::Vector2d& bar) const {
    const double by_x = change(0, 0) * bar.x() + change(1, 0) * bar.y();
    const double by_y = change(0, 1) * bar.x() + change(1, 1) * bar.y();
    return {by_x, by_y, -(m.x() * by_x + m.y() * by_y)};
  }
};

/// Cached rays to a triangle's corners; null if not computed.
struct CornerRays {
  const IncidentRay* r0 = nullptr;
  const IncidentRay* r1 = nullptr;
  const IncidentRay* r2 = nullptr;
};

/// Rays to all vertices of a mesh; null for parallel light.
struct VertexRays {
  const IncidentRay* of = nullptr;

  [[nodiscard]] LF_HD const IncidentRay* at(std::int64_t vertex) const {
    return of != nullptr ? of + vertex : nullptr;
  }
  [[nodiscard]] LF_HD CornerRays at(const int* triangle) const {
    return {at(triangle[0]), at(triangle[1]), at(triangle[2])};
  }
};

// Light from a point.
//
// Notation: a, b, c vectors from the source to the corners of a triangle; D depth of the source
// below a flat front, T height of a point above it, x its lateral offset from the source; η
// refractive index behind the front; μx slope of the ray behind the front, r = |x|². A bar (…_bar)
// is a derivative by that quantity.

/// a × b; GCC 12 leaves Eigen's as a call.
LF_HD inline Eigen::Vector3d cross_product(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return {a.y() * b.z() - a.z() * b.y(), a.z() * b.x() - a.x() * b.z(),
          a.x() * b.y() - a.y() * b.x()};
}

/// The two factors of a solid angle, tan(Ω/2) = N/D (Van Oosterom and Strackee 1983, Eq. 8).
struct SolidAngle {
  double la;  ///< |a|
  double lb;
  double lc;
  double n;  ///< a·(b × c)
  double d;  ///< |a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|

  LF_HD LF_INLINE SolidAngle(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                             const Eigen::Vector3d& c)
      : la(a.norm()),
        lb(b.norm()),
        lc(c.norm()),
        // Differences first: for a distant facet, products of whole vectors lose digits.
        n(a.dot(cross_product(b - a, c - a))),
        d(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb) {}

  /// Ω, steradian; positive where a, b, c turn counter-clockwise seen along their sum.
  [[nodiscard]] LF_HD double value() const {
    const double x = n / d;
    // atan by its series: a facet's x is far below the bound, where the next term is 1e-18.
    if (d > 0.0 && std::fabs(x) < 5e-3) {
      const double y = x * x;
      return 2.0 * x * (1.0 - y * (1.0 / 3.0 - y * (0.2 - y / 7.0)));
    }
    return 2.0 * std::atan2(n, d);
  }
};

/// Derivatives by the three vectors.
struct VectorsBar {
  Eigen::Vector3d a{0.0, 0.0, 0.0};
  Eigen::Vector3d b{0.0, 0.0, 0.0};
  Eigen::Vector3d c{0.0, 0.0, 0.0};
};

/// Derivative of SolidAngle(a, b, c).value() × bar by the three vectors:
/// dΩ = 2 (D dN − N dD) / (N² + D²).
LF_HD LF_INLINE VectorsBar solid_angle_adjoint(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                               const Eigen::Vector3d& c, double bar) {
  const SolidAngle angle(a, b, c);
  const double s = 2.0 * bar / (angle.n * angle.n + angle.d * angle.d);
  const double n_bar = s * angle.d;
  const double d_bar = -s * angle.n;
  const double by_a = (angle.lb * angle.lc + b.dot(c)) / angle.la;
  const double by_b = (angle.lc * angle.la + c.dot(a)) / angle.lb;
  const double by_c = (angle.la * angle.lb + a.dot(b)) / angle.lc;
  return {n_bar * cross_product(b, c) + d_bar * (by_a * a + angle.lc * b + angle.lb * c),
          n_bar * cross_product(c, a) + d_bar * (by_b * b + angle.lc * a + angle.la * c),
          n_bar * cross_product(a, b) + d_bar * (by_c * c + angle.lb * a + angle.la * b)};
}

/// The ray from a point source below a flat front to a point above it, by Snell's law at the front:
/// D η μ q + T μ = 1 with q = 1/√(1 − (η² − 1) μ² r).
struct FrontRay {
  Eigen::Vector2d x;
  double height;  ///< T
  double mu;
  double mu_by_r;  ///< ∂μ/∂r

  /// @pre depth > 0, height ≥ 0, eta > 1.
  LF_HD FrontRay(const Eigen::Vector2d& across, double depth, double height_above, double eta)
      : x(across), height(height_above) {
    const double r = x.squaredNorm();
    const double k = eta * eta - 1.0;
    const double optical = depth * eta;
    // Starts with the refraction point of a ray nearly along z: the error is of third order.
    const double g = 1.0 / (depth + height / eta);
    mu = g / std::sqrt(eta * eta + k * r * g * g);
    for (int i = 0; i < kMaxSteps; ++i) {
      const double q = inverse_root(k * r);
      const double step = (optical * mu * q + height * mu - 1.0) / (optical * q * q * q + height);
      const double next = mu - step;
      // The left-hand side is convex and has its pole where k μ² r = 1.
      mu = k * r * next * next < 1.0 ? next : 0.5 * (mu + 1.0 / std::sqrt(k * r));
      if (std::fabs(step) <= kNear * mu) break;
    }
    const double q = inverse_root(k * r);
    const double steepness = optical * q * q * q + height;
    mu_by_r = -0.5 * optical * k * mu * mu * mu * q * q * q / steepness;
  }

  /// @param source  position of the source, mm.
  [[nodiscard]] LF_HD IncidentRay ray(const Eigen::Vector3d& source) const {
    const Eigen::Vector2d m = mu * x;
    Eigen::Matrix2d m_by_p;
    m_by_p << mu + 2.0 * mu_by_r * x.x() * x.x(), 2.0 * mu_by_r * x.x() * x.y(),
        2.0 * mu_by_r * x.x() * x.y(), mu + 2.0 * mu_by_r * x.y() * x.y();
    const double share = 1.0 - height * mu;
    return {m,
            {source.x() + share * x.x(), source.y() + share * x.y()},
            0.0,
            1.0 / std::sqrt(1.0 + m.squaredNorm()),
            {0.0, 0.0},
            m_by_p,
            Eigen::Matrix2d::Identity() - height * m_by_p};
  }

 private:
  /// Iteration ends at a step below this share; the error is of the order of its square. The usual
  /// lens needs one or two steps, a source close below the front at 80° eight.
  static constexpr double kNear = 1e-9;
  static constexpr int kMaxSteps = 50;

  [[nodiscard]] LF_HD double inverse_root(double kr) const {
    return 1.0 / std::sqrt(1.0 - kr * mu * mu);
  }
};

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

/// Adjoint of (h, ∇h) ↦ slope() of a FrontRefraction at a fixed x.
LF_HD inline FrontBar front_slope_adjoint(const FrontLight& light, const IncidentRay& ray,
                                          const Eigen::Vector2d& m_bar) {
  const Eigen::Vector3d w(-ray.gradient.x(), -ray.gradient.y(), 1.0);
  const double length = w.norm();
  const Eigen::Vector3d n = w / length;
  const Eigen::Vector3d way = light.point ? Eigen::Vector3d(ray.entry() - light.from) : light.from;
  const double distance = way.norm();
  const Eigen::Vector3d a = way / distance;
  const double eta = 1.0 / light.ior;
  const Eigen::Vector3d b_bar = Eigen::Vector3d(m_bar.x(), m_bar.y(), -ray.m.dot(m_bar)) / ray.a_z;
  const Eigen::Vector3d w_bar = normalize_adjoint(n, length, refract_adjoint(a, n, eta, b_bar));
  FrontBar bar{0.0, {-w_bar.x(), -w_bar.y()}};
  if (light.point) {
    const Eigen::Vector3d a_bar = refract_adjoint_by_incident(a, n, eta, b_bar);
    bar.height = normalize_adjoint(a, distance, a_bar).z();
  }
  return bar;
}

/// Adjoint of a front ↦ direction() and entry() of the ray through it that reaches p: the
/// derivative by the front's height and gradient at the ray's x. The ray's x solves F = x + (p_z −
/// h) m − p_xy = 0, so by the implicit function ∂x/∂(h, ∇h) = −(∂x/∂p) ∂F/∂(h, ∇h).
LF_HD inline FrontBar front_adjoint(const FrontLight& light, const IncidentRay& ray, double p_z,
                                    const Eigen::Vector3d& a_bar, const Eigen::Vector3d& e_bar) {
  // Derivative by p_xy, through x and through m at x.
  const Eigen::Vector2d p_bar = (ray.direction_adjoint(a_bar) + ray.entry_adjoint(e_bar)).head<2>();
  FrontBar bar = front_slope_adjoint(light, ray, ray.slope_bar(a_bar) - (p_z - ray.z) * p_bar);
  bar.height += ray.m.dot(p_bar) + e_bar.z();
  return bar;
}

/// Newton's method ends at a step below kNearEntry of the point's coordinates plus kTinyEntry mm.
/// That step is taken to first order, so the error is of the order of its square. Lenses need three
/// or four steps.
inline constexpr double kNearEntry = 1e-9;
inline constexpr double kTinyEntry = 1e-12;
inline constexpr int kMaxEntrySteps = 30;

/// The ray from a source through a front to a point p behind it, by Newton's method on x + (p_z −
/// h(x)) m(x) = p_xy from a place `x` that a neighbouring ray has. Steps into folded light are
/// halved. All NaN if none is found.
LF_HD inline IncidentRay ray_from_near(const FrontSurface& front, const FrontLight& light,
                                       const Eigen::Vector3d& p, Eigen::Vector2d x) {
  Eigen::Vector2d step(0.0, 0.0);
  for (int i = 0; i < kMaxEntrySteps; ++i) {
    FrontRefraction ray(front, light, x);
    const Eigen::Matrix2d lands = ray.landing_by_x(p.z());
    const double det = lands(0, 0) * lands(1, 1) - lands(0, 1) * lands(1, 0);
    if (!ray.lit || !(ray.b.z() > 0.0) || !(det > 0.0)) {
      if (step.x() == 0.0 && step.y() == 0.0) break;
      step *= 0.5;
      x += step;
      continue;
    }
    Eigen::Matrix2d inverse;
    inverse << lands(1, 1), -lands(0, 1), -lands(1, 0), lands(0, 0);
    inverse /= det;
    step = inverse * (x + (p.z() - ray.e.z()) * ray.slope() - Eigen::Vector2d(p.x(), p.y()));
    if (step.norm() <= kNearEntry * (p.cwiseAbs().sum() + std::fabs(ray.e.z())) + kTinyEntry) {
      ray.move(-step);
      return ray.ray(inverse);
    }
    x -= step;
  }
  return FrontRefraction().ray(Eigen::Matrix2d::Identity());
}

/// Heights in which a point rises from a front to its own, where Newton's method from its own place
/// fails: the light near the front has not gathered yet.
inline constexpr int kEntryRises = 8;

/// The same without a neighbour. @pre a height map.
LF_HD inline IncidentRay raised_ray(const FrontSurface& front, const FrontLight& light,
                                    const Eigen::Vector3d& p) {
  IncidentRay ray = FrontRefraction().ray(Eigen::Matrix2d::Identity());
  ray.x = Eigen::Vector2d(p.x(), p.y());
  const double low = front.height(ray.x);
  for (int k = 1; k <= kEntryRises; ++k) {
    const double z = low + (p.z() - low) * k / kEntryRises;
    ray = ray_from_near(front, light, {p.x(), p.y(), z}, ray.x);
    if (!(ray.a_z > 0.0)) break;
  }
  return ray;
}

/// The ray from a source through a curved front to a point p behind it: Newton's method on x + (p_z
/// − h(x)) m(x) = p_xy from p's own place; if that fails behind a height map, raised_ray(). All NaN
/// if no ray reaches p.
LF_HD inline IncidentRay ray_through_front(const FrontSurface& front, const FrontLight& light,
                                           const Eigen::Vector3d& p) {
  IncidentRay found = FrontRefraction().ray(Eigen::Matrix2d::Identity());
  Eigen::Vector2d x(p.x(), p.y());
  if (!front.covers(x)) return found;
  for (int i = 0; i < kMaxEntrySteps; ++i) {
    FrontRefraction ray(front, light, x);
    if (!ray.lit || !(ray.b.z() > 0.0)) break;
    const Eigen::Vector2d m = ray.slope();
    const double rise = p.z() - ray.e.z();
    const Eigen::Matrix2d lands = ray.landing_by_x(p.z());
    // Beyond where neighbouring rays meet, the light has folded over.
    const double det = lands(0, 0) * lands(1, 1) - lands(0, 1) * lands(1, 0);
    if (!(det > 0.0)) break;
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
  return front.is_height_map() ? raised_ray(front, light, p) : found;
}

/// The light before the surface: its direction at a point, and the amount that a triangle takes in.
/// Notation: p surface point and t surface triangle, mm; a unit direction of the light at p (inside
/// a lens). A bar (…_bar) is a derivative by that quantity. `known` holds results of ray_to();
/// without it, each call solves for the ray again if varies().
class LightSource {
 public:
  explicit LightSource(const OpticalSetup& setup);

  /// Parallel light along +z; its formulas are the shortest.
  [[nodiscard]] LF_HD bool along_z() const { return kind_ == Kind::kAlongZ; }
  /// True if each point has its own direction of light.
  [[nodiscard]] LF_HD bool varies() const { return kind_ >= Kind::kPointBehindFront; }
  /// True if the front is curved.
  [[nodiscard]] LF_HD bool is_bent() const { return kind_ >= Kind::kParallelBent; }
  /// The direction of parallel light inside a lens. @pre !varies().
  [[nodiscard]] LF_HD const Eigen::Vector3d& direction() const { return direction_; }

  /// The ray that reaches p. @pre varies().
  [[nodiscard]] LF_HD LF_APART IncidentRay ray_to(const Eigen::Vector3d& p) const {
    if (kind_ == Kind::kPointBehindFront) {
      const Eigen::Vector2d across(p.x() - position_.x(), p.y() - position_.y());
      return FrontRay(across, -position_.z(), p.z(), eta_).ray(position_);
    }
    if (kind_ == Kind::kPoint) return ray_in_air(p);
    return ray_through_front(front_, before_front(), p);
  }
  /// The light before a curved front. @pre is_bent().
  [[nodiscard]] LF_HD FrontLight before_front() const {
    const bool point = kind_ == Kind::kPointBent;
    return {point ? position_ : direction_, point, eta_};
  }

  /// a at p.
  [[nodiscard]] LF_HD LF_INLINE Eigen::Vector3d incident(const Eigen::Vector3d& p,
                                                         const IncidentRay* known = nullptr) const {
    if (!varies()) return direction_;
    return known != nullptr ? known->direction() : ray_to(p).direction();
  }
  /// Adjoint of incident(): the derivative by p.
  [[nodiscard]] LF_HD LF_INLINE Eigen::Vector3d incident_adjoint(
      const Eigen::Vector3d& p, const Eigen::Vector3d& a_bar,
      const IncidentRay* known = nullptr) const {
    if (!varies()) return {0.0, 0.0, 0.0};
    return known != nullptr ? known->direction_adjoint(a_bar) : ray_to(p).direction_adjoint(a_bar);
  }

  /// The entry face; the plane z = 0 unless it is curved.
  [[nodiscard]] const FrontSurface& front() const { return front_; }
  /// The same light with the height map's coefficients at another address. @pre
  /// front().is_height_map().
  [[nodiscard]] LightSource reading(const double* coefficients) const {
    LightSource other = *this;
    other.front_ = front_.reading(coefficients);
    return other;
  }
  /// Direction of the light inside a lens of this size, at its middle, if the front were a plane of
  /// its mean gradient: the mean direction behind a height map. @pre is_bent().
  [[nodiscard]] Eigen::Vector3d mean_direction(const Eigen::Vector2d& size) const;

  /// Point of the entry face at x and y; for a mirror of z = 0.
  [[nodiscard]] Eigen::Vector3d front_at(const Eigen::Vector2d& place) const {
    return {place.x(), place.y(), front_.height(place)};
  }
  /// Point where the ray to p enters the lens, or p's point on a mirror, mm.
  [[nodiscard]] Eigen::Vector3d entry(const Eigen::Vector3d& p) const;

  /// Cosine of the angle between the front's normal and the light behind it; 1 unless varies().
  /// @param ray  from ray_to().
  [[nodiscard]] LF_HD double front_cosine(const IncidentRay& ray) const {
    if (!varies()) return 1.0;
    const Eigen::Vector3d w(-ray.gradient.x(), -ray.gradient.y(), 1.0);
    return w.dot(ray.direction()) / w.norm();
  }
  /// Adjoint of front_cosine(): the derivative by the ray's point.
  [[nodiscard]] LF_HD Eigen::Vector3d front_cosine_adjoint(const IncidentRay& ray,
                                                           double bar) const {
    if (!varies()) return {0.0, 0.0, 0.0};
    const Eigen::Vector3d w(-ray.gradient.x(), -ray.gradient.y(), 1.0);
    const double length = w.norm();
    const Eigen::Vector3d w_bar = normalize_adjoint(w / length, length, bar * ray.direction());
    const Eigen::Vector3d bend = front_.at(ray.x).bend;
    return ray.direction_adjoint((bar / length) * w) -
           ray.place_adjoint({bend[0] * w_bar.x() + bend[1] * w_bar.y(),
                              bend[1] * w_bar.x() + bend[2] * w_bar.y()});
  }

  /// Light that a triangle takes in, mm²: the area of an evenly lit lens that takes in the same,
  /// measured where the rays enter; for a point source the solid angle, scaled to the middle of the
  /// lens.
  template <class T = double>
  [[nodiscard]] LF_HD LF_INLINE T intake(const CornersOf<T>& t,
                                         const CornerRays& known = {}) const {
    if (along_z()) return plan_area(t);
    if constexpr (std::is_same_v<T, double>) {
      if (varies()) return varied_intake(t, known);
    }
    return area_across(t);
  }
  /// Adjoint of intake(): adds to the derivatives by the corners, or by area_normal(t) if the
  /// intake depends on that alone.
  template <class T = double>
  LF_HD LF_INLINE void intake_adjoint(const CornersOf<T>& t, const T& bar, CornersOf<T>& t_bar,
                                      SpaceVector<T>& area_normal_bar,
                                      const CornerRays& known = {}) const {
    if (along_z()) {
      area_normal_bar.z() += 0.5 * bar;
      return;
    }
    if constexpr (std::is_same_v<T, double>) {
      if (varies()) return varied_intake_adjoint(t, bar, t_bar, known);
    }
    const T by_direction = 0.5 * bar / direction_.z();
    area_normal_bar += by_direction * in_all_lanes<T>(direction_);
  }

  /// intake() of a triangle whose rays enter at these points, and the derivatives by them.
  /// @pre is_bent().
  [[nodiscard]] LF_HD double intake_at(const Corners& entries) const {
    return intake_of_vectors(vectors_from(entries));
  }
  [[nodiscard]] LF_HD Corners intake_at_adjoint(const Corners& entries, double bar) const {
    const VectorsBar r_bar = intake_of_vectors_adjoint(vectors_from(entries), bar);
    return {r_bar.a, r_bar.b, r_bar.c};
  }

 private:
  /// As wide as a double, so a kernel's argument has no unset bytes.
  enum class Kind : std::int64_t {
    kAlongZ,            ///< Parallel, along +z through a flat front.
    kParallel,          ///< Parallel, from any direction.
    kPointBehindFront,  ///< From a point below the flat front z = 0.
    kPoint,             ///< From a point, straight to the surface.
    kParallelBent,      ///< Parallel, through a curved front.
    kPointBent,         ///< From a point, through a curved front.
  };

  // One for each kind of lamp.
  void set(const ParallelLight& lamp, const OpticalSetup& setup);
  void set(const PointSource& lamp, const OpticalSetup& setup);

  [[nodiscard]] LF_HD bool lambertian() const { return lambertian_ != 0.0; }
  /// Area of a triangle across parallel light, scaled to an evenly lit lens.
  template <class T>
  [[nodiscard]] LF_HD LF_INLINE T area_across(const CornersOf<T>& t) const {
    return 0.5 * area_normal(t).dot(in_all_lanes<T>(direction_)) / direction_.z();
  }
  /// The straight ray from the source to p; p counts as the point where it enters.
  [[nodiscard]] LF_HD IncidentRay ray_in_air(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d way = p - position_;
    const Eigen::Matrix2d one = Eigen::Matrix2d::Identity();
    return {{way.x() / way.z(), way.y() / way.z()},
            {p.x(), p.y()},
            p.z(),
            way.z() / way.norm(),
            {0.0, 0.0},
            one / way.z(),
            one};
  }
  /// From the source, or the origin of the lens frame, to the point where the ray to p leaves the
  /// air.
  [[nodiscard]] LF_HD LF_INLINE Eigen::Vector3d vector_to(
      const Eigen::Vector3d& p, const IncidentRay* known = nullptr) const {
    if (kind_ == Kind::kPoint) return p - position_;
    return (known != nullptr ? known->entry() : ray_to(p).entry()) - position_;
  }
  [[nodiscard]] LF_HD LF_INLINE VectorsBar vectors_to(const Corners& t,
                                                      const CornerRays& known) const {
    return {vector_to(t.v0, known.r0), vector_to(t.v1, known.r1), vector_to(t.v2, known.r2)};
  }
  [[nodiscard]] LF_HD LF_INLINE VectorsBar vectors_from(const Corners& entries) const {
    return {entries.v0 - position_, entries.v1 - position_, entries.v2 - position_};
  }
  [[nodiscard]] LF_HD LF_INLINE Eigen::Vector3d vector_adjoint(const Eigen::Vector3d& p,
                                                               const Eigen::Vector3d& bar,
                                                               const IncidentRay* known) const {
    if (kind_ == Kind::kPoint) return bar;
    return known != nullptr ? known->entry_adjoint(bar) : ray_to(p).entry_adjoint(bar);
  }
  /// Cosine of the angle between a triangle's middle and the axis of a flat source.
  [[nodiscard]] LF_HD double cosine(const VectorsBar& r) const {
    return axis_.dot((r.a + r.b + r.c).normalized());
  }
  [[nodiscard]] LF_HD LF_APART double varied_intake(const Corners& t,
                                                    const CornerRays& known) const {
    return intake_of_vectors(vectors_to(t, known));
  }
  LF_HD LF_APART void varied_intake_adjoint(const Corners& t, double bar, Corners& t_bar,
                                            const CornerRays& known) const {
    const VectorsBar r_bar = intake_of_vectors_adjoint(vectors_to(t, known), bar);
    t_bar.v0 += vector_adjoint(t.v0, r_bar.a, known.r0);
    t_bar.v1 += vector_adjoint(t.v1, r_bar.b, known.r1);
    t_bar.v2 += vector_adjoint(t.v2, r_bar.c, known.r2);
  }
  [[nodiscard]] LF_HD LF_INLINE double intake_of_vectors(const VectorsBar& r) const {
    if (kind_ == Kind::kParallelBent) return area_across(Corners{r.a, r.b, r.c});
    const double even = scale_ * SolidAngle(r.a, r.b, r.c).value();
    return lambertian() ? even * cosine(r) : even;
  }
  [[nodiscard]] LF_HD LF_INLINE VectorsBar intake_of_vectors_adjoint(const VectorsBar& r,
                                                                     double bar) const {
    if (kind_ == Kind::kParallelBent) {
      Corners r_bar;
      area_normal_adjoint<double>({r.a, r.b, r.c}, (0.5 * bar / direction_.z()) * direction_,
                                  r_bar);
      return {r_bar.v0, r_bar.v1, r_bar.v2};
    }
    const double share = lambertian() ? cosine(r) : 1.0;
    VectorsBar r_bar = solid_angle_adjoint(r.a, r.b, r.c, scale_ * share * bar);
    if (lambertian()) {
      const Eigen::Vector3d sum = r.a + r.b + r.c;
      const double length = sum.norm();
      const double cosine_bar = scale_ * SolidAngle(r.a, r.b, r.c).value() * bar;
      const Eigen::Vector3d each = normalize_adjoint(sum / length, length, cosine_bar * axis_);
      r_bar.a += each;
      r_bar.b += each;
      r_bar.c += each;
    }
    return r_bar;
  }

  Eigen::Vector3d direction_;  ///< Behind a flat front or before a curved one.
  Eigen::Vector3d position_;
  Eigen::Vector3d axis_;     ///< Axis of a flat source, towards the middle of the lens.
  double eta_;               ///< n_lens / n_air
  double scale_ = 1.0;       ///< mm² per steradian; negative if triangles are seen from above.
  double lambertian_ = 0.0;  ///< 1 of a flat source, 0 of an even one.
  Kind kind_ = Kind::kAlongZ;
  FrontSurface front_;  ///< The lens's front, if curved.
};

// An extended source as points.

/// A point of an extended source.
struct SourcePoint {
  Eigen::Vector2d at;  ///< Offset right and up from the middle, seen from the lens: rad or mm.
  double share;        ///< Share of the source's light.
};

/// Points distributed over a source, with shares that sum to 1. A disc has `count` points of equal
/// shares along Vogel's spiral (1979), of which every other point is spread as evenly. A shape has
/// the centres of its lit pixels, each subdivided so that there are about `count` in all; if that
/// is less than one for four pixels, the centres of light of blocks of pixels. A source without
/// extent is one point. @pre count ≥ 1.
std::vector<SourcePoint> source_points(const SourceExtent& extent, int count);

/// The light of one point of the source alone: parallel light turned by `at`, or light from a point
/// moved by `at` across the line to the middle of the lens.
OpticalSetup lit_from(OpticalSetup setup, const Eigen::Vector2d& at);

/// Jacobian J of the landing point by the source point, pixels per rad or mm: u = u₀ + J·at, for
/// light that goes from the middle of the lens at height z to the picture's centre. A central
/// difference over the source's width. For a thin lens along z it is −f per rad or −(f / D) per mm,
/// times the pixels per mm. A tilted screen has two scales.
Eigen::Matrix2d source_motion(const OpticalSetup& setup, double z);

/// Width of the source's image on the screen along its widest direction, pixels.
double source_blur(const OpticalSetup& setup, double z);

}  // namespace lensforge
