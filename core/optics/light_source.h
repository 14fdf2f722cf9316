// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>

#include "core/compute/host_device.h"
#include "core/optics/front_entry.h"
#include "core/optics/optical_setup.h"
#include "core/optics/point_light.h"
#include "core/surface/corners.h"

namespace lensforge {

/// The light before the surface: the direction in which it comes to a point, and how much of it a
/// triangle takes. Notation: p surface point and t surface triangle, mm; a unit direction of the
/// light at p, inside a lens. A bar (…_bar) is a derivative by that. `known` is what enter(p)
/// gives, where a caller has it: without it, each answer behind a curved front solves for it.
class LightSource {
 public:
  explicit LightSource(const OpticalSetup& setup);

  /// Parallel light along +z; its formulas are the shortest.
  [[nodiscard]] LF_HD bool along_z() const { return kind_ == Kind::kAlongZ; }
  /// A direction for each point, not one for all.
  [[nodiscard]] LF_HD bool varies() const { return kind_ >= Kind::kPointBehindFront; }
  /// True behind a curved front.
  [[nodiscard]] LF_HD bool is_bent() const { return kind_ >= Kind::kParallelBent; }
  /// The direction of parallel light inside a lens. @pre !varies().
  [[nodiscard]] LF_HD const Eigen::Vector3d& direction() const { return direction_; }

  /// Where the ray to p enters a curved front. @pre is_bent().
  [[nodiscard]] LF_HD FrontEntry enter(const Eigen::Vector3d& p) const {
    const bool point = kind_ == Kind::kPointBent;
    return {front_, {point ? position_ : direction_, point, eta_}, p};
  }

  /// a at p.
  [[nodiscard]] LF_HD Eigen::Vector3d incident(const Eigen::Vector3d& p,
                                               const FrontEntry* known = nullptr) const {
    if (!varies()) return direction_;
    if (is_bent()) return known != nullptr ? known->direction() : enter(p).direction();
    if (kind_ == Kind::kPoint) return (p - position_).normalized();
    const Eigen::Vector2d m = ray_to(p).slope();
    return Eigen::Vector3d(m.x(), m.y(), 1.0) / std::sqrt(1.0 + m.squaredNorm());
  }
  /// Adjoint of incident(): the derivative by p.
  [[nodiscard]] LF_HD Eigen::Vector3d incident_adjoint(const Eigen::Vector3d& p,
                                                       const Eigen::Vector3d& a_bar,
                                                       const FrontEntry* known = nullptr) const {
    if (!varies()) return {0.0, 0.0, 0.0};
    if (is_bent()) {
      return known != nullptr ? known->direction_adjoint(a_bar) : enter(p).direction_adjoint(a_bar);
    }
    if (kind_ == Kind::kPoint) {
      const Eigen::Vector3d way = p - position_;
      const double length = way.norm();
      return normalize_adjoint(way / length, length, a_bar);
    }
    const FrontRay ray = ray_to(p);
    const Eigen::Vector2d m = ray.slope();
    const double length = std::sqrt(1.0 + m.squaredNorm());
    const Eigen::Vector3d a = Eigen::Vector3d(m.x(), m.y(), 1.0) / length;
    const Eigen::Vector3d w_bar = normalize_adjoint(a, length, a_bar);
    return ray.slope_adjoint({w_bar.x(), w_bar.y()});
  }

  /// Point of the entry face at a place, or of z = 0 under a mirror.
  [[nodiscard]] Eigen::Vector3d front_at(const Eigen::Vector2d& place) const {
    return {place.x(), place.y(), front_.height(place)};
  }
  /// Where the ray to p enters the lens, or the place of p on a mirror, mm.
  [[nodiscard]] Eigen::Vector3d entry(const Eigen::Vector3d& p) const;

  /// Cosine of the angle between a lens's front and the light behind it that comes to p; 1 where it
  /// is the same for all of the lens.
  [[nodiscard]] LF_HD double front_cosine(const Eigen::Vector3d& p,
                                          const FrontEntry* known = nullptr) const {
    if (is_bent()) return known != nullptr ? known->cosine() : enter(p).cosine();
    return kind_ == Kind::kPointBehindFront ? incident(p).z() : 1.0;
  }
  /// Adjoint of front_cosine(): the derivative by p.
  [[nodiscard]] LF_HD Eigen::Vector3d front_cosine_adjoint(
      const Eigen::Vector3d& p, double bar, const FrontEntry* known = nullptr) const {
    if (is_bent())
      return known != nullptr ? known->cosine_adjoint(bar) : enter(p).cosine_adjoint(bar);
    if (kind_ != Kind::kPointBehindFront) return {0.0, 0.0, 0.0};
    return incident_adjoint(p, {0.0, 0.0, bar});
  }

  /// Light that a triangle takes, mm²: where the rays enter, the area of evenly lit lens that takes
  /// as much, of a point source the solid angle on the scale of the middle of the lens.
  [[nodiscard]] LF_HD double intake(const Corners& t, const CornerEntries& known = {}) const {
    if (along_z()) return plan_area(t);
    if (!varies()) return area_across(t);
    const VectorsBar r = vectors_to(t, known);
    if (kind_ == Kind::kParallelBent) return area_across({r.a, r.b, r.c});
    const double even = scale_ * SolidAngle(r.a, r.b, r.c).value();
    return lambertian() ? even * cosine(r) : even;
  }
  /// Adjoint of intake(): adds to the derivatives by the corners, or by area_normal(t) where the
  /// intake depends on that alone.
  LF_HD void intake_adjoint(const Corners& t, double bar, Corners& t_bar,
                            Eigen::Vector3d& area_normal_bar,
                            const CornerEntries& known = {}) const {
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
  /// As wide as a double, so that no bytes of a kernel's argument are left unset.
  enum class Kind : std::int64_t {
    kAlongZ,            ///< Parallel, along +z through a flat front.
    kParallel,          ///< Parallel, from any direction.
    kPointBehindFront,  ///< From a point below the flat front z = 0.
    kPoint,             ///< From a point, straight to the surface.
    kParallelBent,      ///< Parallel, through a curved front.
    kPointBent,         ///< From a point, through a curved front.
  };

  [[nodiscard]] LF_HD bool lambertian() const { return lambertian_ != 0.0; }
  /// Of a triangle across parallel light, on the scale of an evenly lit lens.
  [[nodiscard]] LF_HD double area_across(const Corners& t) const {
    return 0.5 * area_normal(t).dot(direction_) / direction_.z();
  }
  [[nodiscard]] LF_HD Eigen::Vector2d across(const Eigen::Vector3d& p) const {
    return {p.x() - position_.x(), p.y() - position_.y()};
  }
  [[nodiscard]] LF_HD FrontRay ray_to(const Eigen::Vector3d& p) const {
    return {across(p), -position_.z(), p.z(), eta_};
  }
  /// From the source, or the origin of the lens frame, to where the ray to p leaves the air.
  [[nodiscard]] LF_HD Eigen::Vector3d vector_to(const Eigen::Vector3d& p,
                                                const FrontEntry* known = nullptr) const {
    if (kind_ == Kind::kPoint) return p - position_;
    if (is_bent()) return (known != nullptr ? known->entry() : enter(p).entry()) - position_;
    const Eigen::Vector2d v = ray_to(p).entry();
    return {v.x(), v.y(), -position_.z()};
  }
  [[nodiscard]] LF_HD VectorsBar vectors_to(const Corners& t, const CornerEntries& known) const {
    return {vector_to(t.v0, known.e0), vector_to(t.v1, known.e1), vector_to(t.v2, known.e2)};
  }
  [[nodiscard]] LF_HD Eigen::Vector3d vector_adjoint(const Eigen::Vector3d& p,
                                                     const Eigen::Vector3d& bar,
                                                     const FrontEntry* known) const {
    if (kind_ == Kind::kPoint) return bar;
    if (is_bent()) {
      return known != nullptr ? known->entry_adjoint(bar) : enter(p).entry_adjoint(bar);
    }
    return ray_to(p).entry_adjoint({bar.x(), bar.y()});
  }
  /// Of the angle between a triangle's middle and the axis of a flat source.
  [[nodiscard]] LF_HD double cosine(const VectorsBar& r) const {
    return axis_.dot((r.a + r.b + r.c).normalized());
  }
  LF_HD void bent_intake_adjoint(const Corners& t, double bar, Corners& t_bar,
                                 const CornerEntries& known) const {
    const VectorsBar r = vectors_to(t, known);
    Corners r_bar;
    area_normal_adjoint({r.a, r.b, r.c}, (0.5 * bar / direction_.z()) * direction_, r_bar);
    t_bar.v0 += vector_adjoint(t.v0, r_bar.v0, known.e0);
    t_bar.v1 += vector_adjoint(t.v1, r_bar.v1, known.e1);
    t_bar.v2 += vector_adjoint(t.v2, r_bar.v2, known.e2);
  }
  LF_HD void point_intake_adjoint(const Corners& t, double bar, Corners& t_bar,
                                  const CornerEntries& known) const {
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
    t_bar.v0 += vector_adjoint(t.v0, r_bar.a, known.e0);
    t_bar.v1 += vector_adjoint(t.v1, r_bar.b, known.e1);
    t_bar.v2 += vector_adjoint(t.v2, r_bar.c, known.e2);
  }

  Eigen::Vector3d direction_;  ///< Behind a flat front, before a curved one.
  Eigen::Vector3d position_;
  Eigen::Vector3d axis_;  ///< Of a flat source, towards the middle of the lens.
  double eta_;            ///< n_lens / n_air
  double scale_;          ///< mm² per steradian; negative where triangles are seen from above.
  double lambertian_;     ///< 1 of a flat source, 0 of an even one.
  Kind kind_;
  FrontSurface front_;  ///< Of a lens with a curved one.
};

}  // namespace lensforge
