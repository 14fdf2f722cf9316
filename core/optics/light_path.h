// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

#include "core/compute/host_device.h"
#include "core/optics/image_plane.h"
#include "core/optics/optical_setup.h"
#include "core/optics/reflection_barrier.h"
#include "core/optics/refraction.h"
#include "core/surface/corners.h"

/// Notation: p surface point and t surface triangle, mm in the lens frame; n unit normal, n_z > 0;
/// a unit direction of the light before the surface, inside the lens; m slope (dx/dz, dy/dz) of the
/// ray after it; u landing point in pixel coordinates. A bar (…_bar) is a derivative by that.
namespace lensforge {

/// Light after a plane facet. Parallel light leaves it as one beam; light from a point will have a
/// beam for each corner.
struct FacetBeam {
  RefractedBeam beam;

  [[nodiscard]] LF_HD const Eigen::Vector2d& slope(int /*corner*/) const { return beam.m; }
};

/// Derivatives by the slopes at a facet's three corners.
struct FacetSlopes {
  Eigen::Vector2d m0{0.0, 0.0};
  Eigen::Vector2d m1{0.0, 0.0};
  Eigen::Vector2d m2{0.0, 0.0};
};

/// The way of the light from the lamp to the screen. All that depends on the kind of source, on
/// whether the surface refracts or reflects, and on where the screen stands is asked here; no other
/// room knows the refractive index, the direction of the light or the distance of the screen.
///
/// A new kind of light (a point source behind a front surface, a mirror) is a value of Kind with
/// its answers in this file, its fields in OpticalSetup and in the lens file, and its options.
/// Hence the questions name the point or triangle even where parallel light makes no use of it.
///
/// One value with a tag, not a template or a base class: kernels carry it by value to any device,
/// and the rooms that ask are compiled once. Light along +z, which nearly all lenses are made for,
/// keeps its own shorter formulas; the branch costs less than 1 % of an objective's time.
class LightPath {
 public:
  explicit LightPath(const OpticalSetup& setup);

  /// Ties the screen's millimetres to the picture's pixels.
  [[nodiscard]] LF_HD const ImagePlane& plane() const { return plane_; }

  /// Direction of the light before the surface.
  [[nodiscard]] LF_HD const Eigen::Vector3d& incident(const Eigen::Vector3d& /*p*/) const {
    return direction_;
  }

  /// True if a surface of this normal lets the light out towards the screen. Rays along +z then do
  /// not meet the height field again (Sun et al., Appendix B).
  [[nodiscard]] LF_HD bool transmits(const Eigen::Vector3d& /*p*/, const Eigen::Vector3d& n) const {
    if (kind_ == Kind::kAlongZ) {
      return n.z() > 0.0 && refracted_cosine_squared(n.z(), eta_) > 0.0;
    }
    return leaves_upwards(n);
  }
  /// The same of a whole facet.
  [[nodiscard]] LF_HD bool transmits(const Corners& t, const Eigen::Vector3d& n) const {
    return transmits(t.v0, n);
  }

  /// Barrier of a facet against what its light must not do, f_tir of Sun et al., Eq. 9; infinite
  /// where no light leaves.
  [[nodiscard]] LF_HD double barrier(const Corners& /*t*/, const Eigen::Vector3d& n) const {
    return barrier_by_cosine(n).value;
  }
  /// Adjoint of barrier(): adds weight × the derivatives by corners and normal, returns barrier().
  LF_HD double barrier_adjoint(const Corners& /*t*/, const Eigen::Vector3d& n, double weight,
                               Corners& /*t_bar*/, Eigen::Vector3d& n_bar) const {
    const ValueSlope f = barrier_by_cosine(n);
    if (kind_ == Kind::kAlongZ) {
      n_bar.z() += weight * f.slope;
    } else {
      n_bar += (weight * f.slope) * direction_;
    }
    return f.value;
  }

  /// The ray after the surface. @pre transmits(p, n).
  [[nodiscard]] LF_HD RefractedBeam beam(const Eigen::Vector3d& /*p*/,
                                         const Eigen::Vector3d& n) const {
    return kind_ == Kind::kAlongZ ? RefractedBeam(n, eta_) : RefractedBeam(direction_, n, eta_);
  }
  /// Adjoint of (p, n) ↦ beam.m: adds to p_bar, returns n_bar.
  [[nodiscard]] LF_HD Eigen::Vector3d beam_adjoint(const Eigen::Vector3d& /*p*/,
                                                   const Eigen::Vector3d& n,
                                                   const RefractedBeam& beam,
                                                   const Eigen::Vector2d& m_bar,
                                                   Eigen::Vector3d& /*p_bar*/) const {
    return kind_ == Kind::kAlongZ ? beam.adjoint(n, eta_, m_bar)
                                  : beam.adjoint(direction_, n, eta_, m_bar);
  }
  /// The rays after a facet. @pre transmits(t, n).
  [[nodiscard]] LF_HD FacetBeam facet_beam(const Corners& t, const Eigen::Vector3d& n) const {
    return {beam(t.v0, n)};
  }
  /// Adjoint of (t, n) ↦ the slopes at the three corners: adds to t_bar, returns n_bar.
  [[nodiscard]] LF_HD Eigen::Vector3d facet_beam_adjoint(const Corners& t, const Eigen::Vector3d& n,
                                                         const FacetBeam& facet,
                                                         const FacetSlopes& m_bar,
                                                         Corners& t_bar) const {
    const Eigen::Vector2d sum = m_bar.m0 + m_bar.m1 + m_bar.m2;
    return beam_adjoint(t.v0, n, facet.beam, sum, t_bar.v0);
  }

  /// Where a ray of slope m that leaves the surface at p meets the screen.
  [[nodiscard]] LF_HD Eigen::Vector2d land(const Eigen::Vector3d& p,
                                           const Eigen::Vector2d& m) const {
    return plane_.to_pixels(Eigen::Vector2d(p.x(), p.y()) + (focal_length_ - p.z()) * m);
  }
  /// Adjoint of land(): adds to p_bar and m_bar for a given u_bar.
  LF_HD void land_adjoint(const Eigen::Vector3d& p, const Eigen::Vector2d& m,
                          const Eigen::Vector2d& u_bar, Eigen::Vector3d& p_bar,
                          Eigen::Vector2d& m_bar) const {
    const Eigen::Vector2d mm_bar = plane_.pixels_per_mm().cwiseProduct(u_bar);
    p_bar += Eigen::Vector3d(mm_bar.x(), mm_bar.y(), -m.dot(mm_bar));
    m_bar += (focal_length_ - p.z()) * mm_bar;
  }
  /// True if the screen stands beyond a surface point.
  [[nodiscard]] bool before_screen(const Eigen::Vector3d& p) const { return p.z() < focal_length_; }

  /// Light that a triangle takes, as the area of evenly lit lens that takes as much, mm²: where its
  /// rays enter the lens. Moving a vertex inside a mesh never changes the sum over its triangles.
  [[nodiscard]] LF_HD double intake(const Corners& t) const {
    if (kind_ == Kind::kAlongZ) return plan_area(t);
    return 0.5 * area_normal(t).dot(direction_) / direction_.z();
  }
  /// True if intake() is the plan area however a triangle slopes, so that all cells of an even grid
  /// take the same.
  [[nodiscard]] LF_HD bool intake_is_plan_area() const { return kind_ == Kind::kAlongZ; }

  /// intake() as a share of the whole lens's (Sun et al., Eq. 1).
  [[nodiscard]] LF_HD double flux(const Corners& t) const { return intake(t) / lens_area_; }
  /// Adjoint of flux(): adds to the derivatives by the corners, or by area_normal(t) where flux
  /// depends on that alone.
  LF_HD void flux_adjoint(const Corners& /*t*/, double flux_bar, Corners& /*t_bar*/,
                          Eigen::Vector3d& area_normal_bar) const {
    if (kind_ == Kind::kAlongZ) {
      area_normal_bar.z() += 0.5 * flux_bar / lens_area_;
    } else {
      area_normal_bar += (0.5 * flux_bar / (lens_area_ * direction_.z())) * direction_;
    }
  }

  /// Gradient (∂z/∂x, ∂z/∂y) of the surface at p that sends its light to a point of the picture.
  [[nodiscard]] Eigen::Vector2d gradient_for(const Eigen::Vector3d& p,
                                             const Eigen::Vector2d& pixel) const;

  /// Where the light of a flat surface through p lands, and the point of the flat surface of height
  /// z whose light lands at a pixel.
  [[nodiscard]] Eigen::Vector2d land_from_flat(const Eigen::Vector3d& p) const;
  [[nodiscard]] Eigen::Vector2d place_on_flat(const Eigen::Vector2d& pixel, double z) const;

  /// How far a change of slope moves the light over the screen, mm, to first order, around a flat
  /// surface of height z.
  [[nodiscard]] double reach(double slope, double z = 0.0) const;

 private:
  /// As wide as a double, so that no bytes of a kernel's argument are left unset.
  enum class Kind : std::int64_t {
    kAlongZ,   ///< Parallel light along +z through a flat entry face, refracted.
    kOblique,  ///< Parallel light from any direction through a flat entry face, refracted.
  };

  [[nodiscard]] LF_HD ValueSlope barrier_by_cosine(const Eigen::Vector3d& n) const {
    if (kind_ == Kind::kAlongZ) return reflection_barrier(n.z(), eta_);
    if (!leaves_upwards(n)) return {kInfinity, 0.0};
    return reflection_barrier(n.dot(direction_), eta_);
  }
  [[nodiscard]] LF_HD bool leaves_upwards(const Eigen::Vector3d& n) const {
    const double c = n.dot(direction_);
    return n.z() > 0.0 && c > 0.0 && refracted_cosine_squared(c, eta_) > 0.0 &&
           refract(direction_, n, eta_).z() > 0.0;
  }

  ImagePlane plane_;
  double focal_length_;  ///< z of the screen, mm.
  double eta_;           ///< n_lens / n_air
  double lens_area_;     ///< mm², plan.
  Kind kind_;
  Eigen::Vector3d direction_;  ///< a
  double deflection_;          ///< Change of m for a unit of slope, around a flat surface.
};

}  // namespace lensforge
