// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>

#include "core/compute/host_device.h"
#include "core/optics/front_entry.h"
#include "core/optics/incident_ray.h"
#include "core/optics/optical_setup.h"
#include "core/optics/point_light.h"
#include "core/surface/corners.h"

namespace lensforge {

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
    const bool point = kind_ == Kind::kPointBent;
    return ray_through_front(front_, {point ? position_ : direction_, point, eta_}, p);
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
  [[nodiscard]] LF_HD double intake(const Corners& t, const CornerRays& known = {}) const {
    if (along_z()) return plan_area(t);
    if (!varies()) return area_across(t);
    return varied_intake(t, known);
  }
  /// Adjoint of intake(): adds to the derivatives by the corners, or by area_normal(t) if the
  /// intake depends on that alone.
  LF_HD void intake_adjoint(const Corners& t, double bar, Corners& t_bar,
                            Eigen::Vector3d& area_normal_bar, const CornerRays& known = {}) const {
    if (along_z()) {
      area_normal_bar.z() += 0.5 * bar;
    } else if (!varies()) {
      area_normal_bar += (0.5 * bar / direction_.z()) * direction_;
    } else if (kind_ == Kind::kParallelBent) {
      bent_intake_adjoint(t, bar, t_bar, known);
    } else {
      point_intake_adjoint(t, bar, t_bar, known);
    }
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

  [[nodiscard]] LF_HD bool lambertian() const { return lambertian_ != 0.0; }
  /// Area of a triangle across parallel light, scaled to an evenly lit lens.
  [[nodiscard]] LF_HD double area_across(const Corners& t) const {
    return 0.5 * area_normal(t).dot(direction_) / direction_.z();
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
    const VectorsBar r = vectors_to(t, known);
    if (kind_ == Kind::kParallelBent) return area_across({r.a, r.b, r.c});
    const double even = scale_ * SolidAngle(r.a, r.b, r.c).value();
    return lambertian() ? even * cosine(r) : even;
  }
  LF_HD LF_APART void bent_intake_adjoint(const Corners& t, double bar, Corners& t_bar,
                                          const CornerRays& known) const {
    const VectorsBar r = vectors_to(t, known);
    Corners r_bar;
    area_normal_adjoint({r.a, r.b, r.c}, (0.5 * bar / direction_.z()) * direction_, r_bar);
    t_bar.v0 += vector_adjoint(t.v0, r_bar.v0, known.r0);
    t_bar.v1 += vector_adjoint(t.v1, r_bar.v1, known.r1);
    t_bar.v2 += vector_adjoint(t.v2, r_bar.v2, known.r2);
  }
  LF_HD LF_APART void point_intake_adjoint(const Corners& t, double bar, Corners& t_bar,
                                           const CornerRays& known) const {
    const VectorsBar r = vectors_to(t, known);
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
    t_bar.v0 += vector_adjoint(t.v0, r_bar.a, known.r0);
    t_bar.v1 += vector_adjoint(t.v1, r_bar.b, known.r1);
    t_bar.v2 += vector_adjoint(t.v2, r_bar.c, known.r2);
  }

  Eigen::Vector3d direction_;  ///< Behind a flat front or before a curved one.
  Eigen::Vector3d position_;
  Eigen::Vector3d axis_;  ///< Axis of a flat source, towards the middle of the lens.
  double eta_;            ///< n_lens / n_air
  double scale_;          ///< mm² per steradian; negative if triangles are seen from above.
  double lambertian_;     ///< 1 of a flat source, 0 of an even one.
  Kind kind_;
  FrontSurface front_;  ///< The lens's front, if curved.
};

}  // namespace lensforge
