// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <span>

#include "core/compute/host_device.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/light_source.h"
#include "core/optics/optical_setup.h"
#include "core/optics/outline.h"
#include "core/optics/refraction.h"
#include "core/optics/screen.h"

namespace lensforge {

// Notation: p surface point and t surface triangle, mm in the lens frame; n unit normal, n_z > 0;
// a unit direction of the light before the surface (inside a lens); b unit direction of the ray
// after it, m its slope (dx/dz, dy/dz); u landing point in pixel coordinates. A bar (…_bar) is a
// derivative by that quantity. `known` holds the results of ray_to() for the same points, so
// repeated calls need not solve for them again.

/// Light after a plane facet. Parallel light leaves it as one beam; light from a point has a beam
/// for each corner.
struct FacetBeam {
  RefractedBeam b0;
  RefractedBeam b1;
  RefractedBeam b2;
  CornerRays known;

  [[nodiscard]] LF_HD const Eigen::Vector2d& slope(int corner) const {
    return corner == 0 ? b0.m : (corner == 1 ? b1.m : b2.m);
  }
};

/// Derivatives by the slopes at a facet's three corners.
struct FacetSlopes {
  Eigen::Vector2d m0{0.0, 0.0};
  Eigen::Vector2d m1{0.0, 0.0};
  Eigen::Vector2d m2{0.0, 0.0};
};

/// The path of the light from the lamp to the screen. Everything that depends on the kind of
/// source, on refraction or reflection, and on the screen is computed here; no other room uses the
/// refractive index, the direction of the light or the distance of the screen.
///
/// One value with tags, not a template or a base class: kernels copy it to any device, and its
/// callers are compiled once. It refers to a height map's coefficients in its setup, which must
/// outlive it. Light along +z, the usual case, has its own shorter formulas; the branches cost less
/// than 1 % of an objective's time.
class LightPath {
 public:
  explicit LightPath(const OpticalSetup& setup);

  /// The same light with flux() as a share of `whole`, mm², instead of a flat surface's intake.
  [[nodiscard]] LightPath sharing(double whole) const {
    LightPath other = *this;
    other.per_whole_ = 1.0 / whole;
    return other;
  }

  /// Coefficients of a height-map front, owned by the setup; otherwise empty.
  [[nodiscard]] std::span<const double> front_coefficients() const {
    return source_.front().coefficients();
  }
  /// The same light with those coefficients at another address, for kernels. @pre there are some.
  [[nodiscard]] LightPath reading(const double* coefficients) const {
    LightPath other = *this;
    other.source_ = source_.reading(coefficients);
    return other;
  }

  /// Converts between the screen's millimetres and the picture's pixels.
  [[nodiscard]] LF_HD const ImagePlane& plane() const { return screen_.plane(); }

  /// True if the light's direction differs from point to point and must be solved for.
  [[nodiscard]] LF_HD bool varies() const { return source_.varies(); }
  /// The ray that reaches p. @pre varies().
  [[nodiscard]] LF_HD IncidentRay ray_to(const Eigen::Vector3d& p) const {
    return source_.ray_to(p);
  }

  /// True if a surface of this normal sends the light towards the screen. Rays along +z then do not
  /// meet the height field again (Sun et al., Appendix B).
  [[nodiscard]] LF_HD bool transmits(const Eigen::Vector3d& p, const Eigen::Vector3d& n,
                                     const IncidentRay* known = nullptr) const {
    if (source_.along_z()) {
      return n.z() > 0.0 && refracted_cosine_squared(n.z(), eta_) > 0.0 &&
             (!screen_.turned() || screen_.faces(RefractedBeam(n, eta_).m));
    }
    return leaves(source_.incident(p, known), n);
  }
  /// The same for a whole facet.
  [[nodiscard]] LF_HD bool transmits(const Corners& t, const Eigen::Vector3d& n,
                                     const CornerRays& known = {}) const {
    if (!source_.varies()) return transmits(t.v0, n);
    return transmits(t.v0, n, known.r0) && transmits(t.v1, n, known.r1) &&
           transmits(t.v2, n, known.r2);
  }

  /// Barrier that keeps a facet's light from being lost; infinite if no light leaves. For a lens
  /// f_tir (Sun et al., Eq. 9), for a mirror 1 / (−n·a b_z); for light from a point the mean over
  /// the corners.
  [[nodiscard]] LF_HD double barrier(const Corners& t, const Eigen::Vector3d& n,
                                     const CornerRays& known = {}) const {
    if (source_.along_z()) return barrier_along_z(n).value;
    if (!source_.varies()) return barrier_value(source_.direction(), n);
    return varied_barrier(t, n, known);
  }
  /// Adjoint of barrier(): adds weight × the derivatives by corners and normal, returns barrier().
  /// @pre barrier() is finite.
  LF_HD double barrier_adjoint(const Corners& t, const Eigen::Vector3d& n, double weight,
                               Corners& t_bar, Eigen::Vector3d& n_bar,
                               const CornerRays& known = {}) const {
    if (source_.along_z()) {
      const ValueSlope f = barrier_along_z(n);
      n_bar.z() += weight * f.slope;
      return f.value;
    }
    if (!source_.varies()) {
      const BarrierAt f = barrier_at(source_.direction(), n);
      n_bar += weight * f.by_n;
      return f.value;
    }
    return varied_barrier_adjoint(t, n, weight, t_bar, n_bar, known);
  }

  /// The ray after the surface. @pre transmits(p, n).
  [[nodiscard]] LF_HD RefractedBeam beam(const Eigen::Vector3d& p, const Eigen::Vector3d& n,
                                         const IncidentRay* known = nullptr) const {
    if (source_.along_z()) return {n, eta_};
    const Eigen::Vector3d a = source_.incident(p, known);
    if (reflects()) return RefractedBeam::reflected(a, n);
    return {a, n, eta_};
  }
  /// Adjoint of (p, n) ↦ beam.m: adds to p_bar, returns n_bar.
  [[nodiscard]] LF_HD Eigen::Vector3d beam_adjoint(const Eigen::Vector3d& p,
                                                   const Eigen::Vector3d& n,
                                                   const RefractedBeam& beam,
                                                   const Eigen::Vector2d& m_bar,
                                                   Eigen::Vector3d& p_bar,
                                                   const IncidentRay* known = nullptr) const {
    if (source_.along_z()) return beam.adjoint(n, eta_, m_bar);
    const Eigen::Vector3d a = source_.incident(p, known);
    const Eigen::Vector3d b_bar = beam.direction_bar(m_bar);
    if (reflects()) {
      if (source_.varies()) {
        p_bar += source_.incident_adjoint(p, reflect_adjoint_by_incident(n, b_bar), known);
      }
      return reflect_adjoint(a, n, b_bar);
    }
    const double along = n.dot(b_bar) * beam.k_by_cosine(n.dot(a), eta_);
    if (source_.varies()) p_bar += source_.incident_adjoint(p, eta_ * b_bar + along * n, known);
    return beam.k * b_bar + along * a;
  }
  /// The rays after a facet. @pre transmits(t, n).
  [[nodiscard]] LF_HD FacetBeam facet_beam(const Corners& t, const Eigen::Vector3d& n,
                                           const CornerRays& known = {}) const {
    const RefractedBeam first = beam(t.v0, n, known.r0);
    if (!source_.varies()) return {first, first, first, known};
    return {first, beam(t.v1, n, known.r1), beam(t.v2, n, known.r2), known};
  }
  /// Adjoint of (t, n) ↦ the slopes at the three corners: adds to t_bar, returns n_bar.
  [[nodiscard]] LF_HD Eigen::Vector3d facet_beam_adjoint(const Corners& t, const Eigen::Vector3d& n,
                                                         const FacetBeam& facet,
                                                         const FacetSlopes& m_bar,
                                                         Corners& t_bar) const {
    if (!source_.varies()) {
      const Eigen::Vector2d sum = m_bar.m0 + m_bar.m1 + m_bar.m2;
      return beam_adjoint(t.v0, n, facet.b0, sum, t_bar.v0);
    }
    const CornerRays& rays = facet.known;
    return beam_adjoint(t.v0, n, facet.b0, m_bar.m0, t_bar.v0, rays.r0) +
           beam_adjoint(t.v1, n, facet.b1, m_bar.m1, t_bar.v1, rays.r1) +
           beam_adjoint(t.v2, n, facet.b2, m_bar.m2, t_bar.v2, rays.r2);
  }

  /// Point where a ray of slope m from p meets the screen, in pixel coordinates.
  [[nodiscard]] LF_HD Eigen::Vector2d land(const Eigen::Vector3d& p,
                                           const Eigen::Vector2d& m) const {
    return screen_.land(p, m);
  }
  /// Adjoint of land(): adds to p_bar and m_bar for a given u_bar.
  LF_HD void land_adjoint(const Eigen::Vector3d& p, const Eigen::Vector2d& m,
                          const Eigen::Vector2d& u_bar, Eigen::Vector3d& p_bar,
                          Eigen::Vector2d& m_bar) const {
    screen_.land_adjoint(p, m, u_bar, p_bar, m_bar);
  }
  /// Distance of a surface point from the screen's plane, mm; negative beyond it.
  [[nodiscard]] double clearance(const Eigen::Vector3d& p) const { return screen_.clearance(p); }
  /// True if the screen is beyond a surface point.
  [[nodiscard]] bool before_screen(const Eigen::Vector3d& p) const { return clearance(p) > 0.0; }

  /// Light that a triangle takes in, as the area of an evenly lit lens that takes in the same, mm²,
  /// measured where the rays enter. Moving a vertex inside a mesh does not change the sum over its
  /// triangles. If faces reflect, it is the light that the triangle lets out, by its own normal and
  /// the light at its middle, equal to the above at normal incidence.
  [[nodiscard]] LF_HD double intake(const Corners& t, const CornerRays& known = {}) const {
    const double even = source_.intake(t, known);
    return loses() ? even * Passage(*this, t).share() : even;
  }
  /// True if intake() is the plan area whatever the triangle's slope, so all cells of an even grid
  /// take in the same.
  [[nodiscard]] LF_HD bool intake_is_plan_area() const { return source_.along_z() && !loses(); }

  /// intake() as a share of a whole (Sun et al., Eq. 1): the intake of a flat surface of the lens's
  /// size (for parallel light inside its outline), or the argument of sharing().
  [[nodiscard]] LF_HD double flux(const Corners& t, const CornerRays& known = {}) const {
    return intake(t, known) * per_whole_;
  }
  /// Adjoint of flux(): adds to the derivatives by the corners, or by area_normal(t) if flux
  /// depends on that alone.
  LF_HD void flux_adjoint(const Corners& t, double flux_bar, Corners& t_bar,
                          Eigen::Vector3d& area_normal_bar, const CornerRays& known = {}) const {
    const double bar = flux_bar * per_whole_;
    if (!loses()) return source_.intake_adjoint(t, bar, t_bar, area_normal_bar, known);
    const Passage passage(*this, t);
    source_.intake_adjoint(t, bar * passage.share(), t_bar, area_normal_bar, known);
    passage.adjoint(*this, bar * source_.intake(t, known), t_bar, area_normal_bar);
  }

  /// Gradient (∂z/∂x, ∂z/∂y) of the surface at p that sends its light to a point of the picture.
  [[nodiscard]] Eigen::Vector2d gradient_for(const Eigen::Vector3d& p,
                                             const Eigen::Vector2d& pixel) const;

  /// True if a design starts from a flat surface. Behind a curved front, which could focus a flat
  /// surface's light anywhere, it starts from the surface that makes the light parallel.
  [[nodiscard]] bool starts_flat() const { return !source_.is_bent(); }
  /// For the starting surface: the landing point of the light from p, and the point at height z
  /// whose light lands at a pixel.
  [[nodiscard]] Eigen::Vector2d land_from_start(const Eigen::Vector3d& p) const;
  [[nodiscard]] Eigen::Vector2d place_on_start(const Eigen::Vector2d& pixel, double z) const;

  /// Slope of the ray from the middle of a flat surface of height z. Behind a height map, whose
  /// slope in the middle is arbitrary, the mean gradient is used.
  [[nodiscard]] Eigen::Vector2d chief_slope(double z) const;

  /// Distance on the screen by which a change of slope moves the light, mm, to first order, at the
  /// middle of a flat surface of height z: the geometric mean over all directions of the slope.
  [[nodiscard]] double reach(double slope, double z = 0.0) const;

 private:
  /// Value of a barrier at one point and its derivatives.
  struct BarrierAt {
    double value;
    Eigen::Vector3d by_a;
    Eigen::Vector3d by_n;
  };

  /// Transmittance of both faces of a lens for the ray through a triangle's middle, relative to
  /// that at normal incidence.
  class Passage {
   public:
    LF_HD Passage(const LightPath& light, const Corners& t)
        : middle_((t.v0 + t.v1 + t.v2) / 3.0),
          n_(area_normal(t)),
          length_(n_.norm()),
          ray_(light.varies() ? light.ray_to(middle_) : IncidentRay()),
          a_(light.source_.incident(middle_, &ray_)),
          straight_(transmittance(1.0, light.eta_).value) {
      straight_ *= straight_;
      n_ /= length_;
      front_ = transmittance(light.source_.front_cosine(ray_), light.eta_);
      back_ = transmittance(n_.dot(a_), light.eta_);
    }
    [[nodiscard]] LF_HD double share() const { return front_.value * back_.value / straight_; }
    /// Adjoint of share(): adds to the derivatives by the corners and by area_normal(t).
    LF_HD void adjoint(const LightPath& light, double bar, Corners& t_bar,
                       Eigen::Vector3d& area_normal_bar) const {
      const double back_bar = bar * front_.value * back_.slope / straight_;
      const double front_bar = bar * back_.value * front_.slope / straight_;
      area_normal_bar += normalize_adjoint(n_, length_, back_bar * a_);
      const Eigen::Vector3d third = (light.source_.incident_adjoint(middle_, back_bar * n_, &ray_) +
                                     light.source_.front_cosine_adjoint(ray_, front_bar)) /
                                    3.0;
      t_bar.v0 += third;
      t_bar.v1 += third;
      t_bar.v2 += third;
    }

   private:
    Eigen::Vector3d middle_;
    Eigen::Vector3d n_;
    double length_;
    IncidentRay ray_;  ///< To the middle, if varies().
    Eigen::Vector3d a_;
    double straight_;  ///< Transmittance at normal incidence.
    ValueSlope front_{};
    ValueSlope back_{};
  };

  /// Values of kind_: lens, lens whose faces reflect (OpticalSetup::fresnel), mirror.
  static constexpr std::int64_t kLens = 0;
  static constexpr std::int64_t kLosing = 1;
  static constexpr std::int64_t kMirror = 2;

  // One for each kind of part.
  static std::int64_t kind_of(const LensBody&, bool fresnel) { return fresnel ? kLosing : kLens; }
  static std::int64_t kind_of(const MirrorBody&, bool /*fresnel*/) { return kMirror; }
  [[nodiscard]] LF_HD bool reflects() const { return kind_ == kMirror; }
  [[nodiscard]] LF_HD bool loses() const { return kind_ == kLosing; }
  [[nodiscard]] LF_HD ValueSlope barrier_along_z(const Eigen::Vector3d& n) const {
    if (screen_.turned() && !transmits(Eigen::Vector3d(0.0, 0.0, 0.0), n)) return {kInfinity, 0.0};
    return reflection_barrier(n.z(), eta_);
  }
  [[nodiscard]] LF_HD LF_INLINE double barrier_value(const Eigen::Vector3d& a,
                                                     const Eigen::Vector3d& n) const {
    if (!leaves(a, n)) return kInfinity;
    const double c = n.dot(a);
    if (!reflects()) return 1.0 / refracted_cosine_squared(c, eta_);
    return -1.0 / (c * (a.z() - 2.0 * c * n.z()));
  }
  /// @pre leaves(a, n).
  [[nodiscard]] LF_HD LF_INLINE BarrierAt barrier_at(const Eigen::Vector3d& a,
                                                     const Eigen::Vector3d& n) const {
    const double c = n.dot(a);
    if (!reflects()) {
      const ValueSlope f = reflection_barrier(c, eta_);
      return {f.value, f.slope * n, f.slope * a};
    }
    // f = −1 / (c b_z) with b_z = a_z − 2 c n_z.
    const double b_z = a.z() - 2.0 * c * n.z();
    const double f = -1.0 / (c * b_z);
    const double by_bz = -f / b_z;
    const double by_c = -f / c - 2.0 * n.z() * by_bz;
    return {f, by_c * n + Eigen::Vector3d(0.0, 0.0, by_bz),
            by_c * a + Eigen::Vector3d(0.0, 0.0, -2.0 * c * by_bz)};
  }
  /// A corner's share of barrier_adjoint().
  LF_HD LF_INLINE double corner_barrier(const Eigen::Vector3d& p, const Eigen::Vector3d& n,
                                        double weight, Eigen::Vector3d& p_bar,
                                        Eigen::Vector3d& n_bar, const IncidentRay* known) const {
    const BarrierAt f = barrier_at(source_.incident(p, known), n);
    p_bar += source_.incident_adjoint(p, weight * f.by_a, known);
    n_bar += weight * f.by_n;
    return f.value / 3.0;
  }
  [[nodiscard]] LF_HD LF_APART double varied_barrier(const Corners& t, const Eigen::Vector3d& n,
                                                     const CornerRays& known) const {
    return (barrier_value(source_.incident(t.v0, known.r0), n) +
            barrier_value(source_.incident(t.v1, known.r1), n) +
            barrier_value(source_.incident(t.v2, known.r2), n)) /
           3.0;
  }
  LF_HD LF_APART double varied_barrier_adjoint(const Corners& t, const Eigen::Vector3d& n,
                                               double weight, Corners& t_bar,
                                               Eigen::Vector3d& n_bar,
                                               const CornerRays& known) const {
    return corner_barrier(t.v0, n, weight / 3.0, t_bar.v0, n_bar, known.r0) +
           corner_barrier(t.v1, n, weight / 3.0, t_bar.v1, n_bar, known.r1) +
           corner_barrier(t.v2, n, weight / 3.0, t_bar.v2, n_bar, known.r2);
  }
  [[nodiscard]] LF_HD LF_INLINE bool leaves(const Eigen::Vector3d& a,
                                            const Eigen::Vector3d& n) const {
    const double c = n.dot(a);
    if (!(n.z() > 0.0)) return false;
    if (reflects()) {
      return c < 0.0 && a.z() - 2.0 * c * n.z() > 0.0 &&
             (!screen_.turned() || screen_.faces(RefractedBeam::reflected(a, n).m));
    }
    // b_z = √s n_z − η (c n_z − a_z), compared without the root.
    const double s = refracted_cosine_squared(c, eta_);
    const double back = eta_ * (c * n.z() - a.z());
    return c > 0.0 && s > 0.0 && (back < 0.0 || s * n.z() * n.z() > back * back) &&
           (!screen_.turned() || screen_.faces(RefractedBeam(a, n, eta_).m));
  }

  Screen screen_;
  LightSource source_;
  double per_whole_;        ///< 1/mm²
  double eta_;              ///< n_lens / n_air
  std::int64_t kind_;       ///< Wide, so a kernel's argument has no unset bytes.
  Eigen::Vector2d middle_;  ///< The lens's, mm.
};

// The light on a whole surface.

/// The light on a surface, with flux as a share of this surface's intake: a higher rim takes in
/// less of a diverging beam, but the picture keeps its total.
/// @pre the mesh has no triangles outside setup.outline.
LightPath light_on(const SurfaceMesh& mesh, const OpticalSetup& setup);

/// The same for a mesh that extends beyond the outline.
LightPath light_inside(const SurfaceMesh& mesh, const MeshCut& cut, const OpticalSetup& setup);

/// LightPath::intake() of the part of a mesh inside an outline, mm².
double intake_inside(const SurfaceMesh& mesh, const MeshCut& cut, const LightPath& light);

/// LightPath::intake() of a whole surface, mm².
double intake_of(const SurfaceMesh& mesh, const LightPath& light);

/// Maximum distance beyond the lens's edges at which a vertex's light enters a curved front, mm; 0
/// for a flat front.
double overhang(const SurfaceMesh& mesh, const OpticalSetup& setup);

}  // namespace lensforge
