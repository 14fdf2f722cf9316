// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <type_traits>

#include "core/compute/host_device.h"
#include "core/compute/lanes.h"
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
// repeated calls need not solve for them again. T is a double, or a vector of the doubles of
// several rays or facets (core/compute/lanes.h), each with the same bits: for light that
// takes_lanes().

/// Light after a plane facet. Parallel light leaves it as one beam; light from a point has a beam
/// for each corner.
template <class T>
struct FacetBeamOf {
  RefractedBeamOf<T> b0;  ///< Several facets at a time are in parallel light.
  CornerRays known;

  [[nodiscard]] LF_INLINE const PlaneVector<T>& slope(int /*corner*/) const { return b0.m; }
};
template <>
struct FacetBeamOf<double> {
  RefractedBeam b0;
  RefractedBeam b1;
  RefractedBeam b2;
  CornerRays known;

  [[nodiscard]] LF_HD LF_INLINE const Eigen::Vector2d& slope(int corner) const {
    return corner == 0 ? b0.m : (corner == 1 ? b1.m : b2.m);
  }
};
using FacetBeam = FacetBeamOf<double>;

/// Derivatives by the slopes at a facet's three corners.
template <class T>
struct FacetSlopesOf {
  PlaneVector<T> m0{T{}, T{}};
  PlaneVector<T> m1{T{}, T{}};
  PlaneVector<T> m2{T{}, T{}};
};
using FacetSlopes = FacetSlopesOf<double>;

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
  /// True if several rays or facets can be computed at a time: parallel light on a mirror or behind
  /// a flat front, without losses by reflection.
  [[nodiscard]] bool takes_lanes() const { return !varies() && !loses(); }
  /// The ray that reaches p. @pre varies().
  [[nodiscard]] LF_HD IncidentRay ray_to(const Eigen::Vector3d& p) const {
    return source_.ray_to(p);
  }

  /// True if a surface of this normal sends the light towards the screen. Rays along +z then do not
  /// meet the height field again (Sun et al., Appendix B).
  template <class T = double>
  [[nodiscard]] LF_HD LF_INLINE MaskOf<T> transmits(const SpaceVector<T>& p,
                                                    const SpaceVector<T>& n,
                                                    const IncidentRay* known = nullptr) const {
    if (!source_.along_z()) return leaves<T>(incident<T>(p, known), n);
    MaskOf<T> transmits = n.z() > T{};
    transmits = transmits & (refracted_cosine_squared<T>(n.z(), eta_) > T{});
    if (!screen_.turned()) return transmits;
    transmits = transmits & screen_.is_towards<T>(RefractedBeamOf<T>(n, eta_).m);
    return transmits;
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
  template <class T = double>
  [[nodiscard]] LF_HD LF_INLINE T barrier(const CornersOf<T>& t, const SpaceVector<T>& n,
                                          const CornerRays& known = {}) const {
    if (source_.along_z()) return barrier_along_z<T>(n).value;
    if constexpr (std::is_same_v<T, double>) {
      if (source_.varies()) return varied_barrier(t, n, known);
    }
    return barrier_value<T>(in_all_lanes<T>(source_.direction()), n);
  }
  /// Adjoint of barrier(): adds weight × the derivatives by corners and normal, returns barrier().
  /// @pre barrier() is finite.
  template <class T = double>
  LF_HD LF_INLINE T barrier_adjoint(const CornersOf<T>& t, const SpaceVector<T>& n, double weight,
                                    CornersOf<T>& t_bar, SpaceVector<T>& n_bar,
                                    const CornerRays& known = {}) const {
    if (source_.along_z()) {
      const ValueSlopeOf<T> f = barrier_along_z<T>(n);
      n_bar.z() += weight * f.slope;
      return f.value;
    }
    if constexpr (std::is_same_v<T, double>) {
      if (source_.varies()) return varied_barrier_adjoint(t, n, weight, t_bar, n_bar, known);
    }
    const BarrierAt<T> f = barrier_at<T>(in_all_lanes<T>(source_.direction()), n);
    n_bar += weight * f.by_n;
    return f.value;
  }

  /// The ray after the surface. @pre transmits(p, n).
  template <class T = double>
  [[nodiscard]] LF_HD LF_INLINE RefractedBeamOf<T> beam(const SpaceVector<T>& p,
                                                        const SpaceVector<T>& n,
                                                        const IncidentRay* known = nullptr) const {
    if (source_.along_z()) return {n, eta_};
    const SpaceVector<T> a = incident<T>(p, known);
    if (reflects()) return RefractedBeamOf<T>::reflected(a, n);
    return {a, n, eta_};
  }
  /// Adjoint of (p, n) ↦ beam.m: adds to p_bar, returns n_bar.
  template <class T = double>
  [[nodiscard]] LF_HD LF_INLINE SpaceVector<T> beam_adjoint(
      const SpaceVector<T>& p, const SpaceVector<T>& n, const RefractedBeamOf<T>& beam,
      const PlaneVector<T>& m_bar, SpaceVector<T>& p_bar,
      const IncidentRay* known = nullptr) const {
    if (source_.along_z()) return beam.adjoint(n, eta_, m_bar);
    const SpaceVector<T> a = incident<T>(p, known);
    const SpaceVector<T> b_bar = beam.direction_bar(m_bar);
    if (reflects()) {
      if constexpr (std::is_same_v<T, double>) {
        if (source_.varies()) {
          p_bar += source_.incident_adjoint(p, reflect_adjoint_by_incident(n, b_bar), known);
        }
      }
      return reflect_adjoint<T>(a, n, b_bar);
    }
    const T along = n.dot(b_bar) * beam.k_by_cosine(n.dot(a), eta_);
    if constexpr (std::is_same_v<T, double>) {
      if (source_.varies()) p_bar += source_.incident_adjoint(p, eta_ * b_bar + along * n, known);
    }
    return beam.k * b_bar + along * a;
  }
  /// The rays after a facet. @pre transmits(t, n).
  template <class T = double>
  [[nodiscard]] LF_HD LF_INLINE FacetBeamOf<T> facet_beam(const CornersOf<T>& t,
                                                          const SpaceVector<T>& n,
                                                          const CornerRays& known = {}) const {
    const RefractedBeamOf<T> first = beam<T>(t.v0, n, known.r0);
    if constexpr (std::is_same_v<T, double>) {
      if (!source_.varies()) return {first, first, first, known};
      return {first, beam(t.v1, n, known.r1), beam(t.v2, n, known.r2), known};
    } else {
      return {first, known};
    }
  }
  /// Adjoint of (t, n) ↦ the slopes at the three corners: adds to t_bar, returns n_bar.
  template <class T = double>
  [[nodiscard]] LF_HD LF_INLINE SpaceVector<T> facet_beam_adjoint(const CornersOf<T>& t,
                                                                  const SpaceVector<T>& n,
                                                                  const FacetBeamOf<T>& facet,
                                                                  const FacetSlopesOf<T>& m_bar,
                                                                  CornersOf<T>& t_bar) const {
    if constexpr (std::is_same_v<T, double>) {
      if (source_.varies()) {
        const CornerRays& rays = facet.known;
        return beam_adjoint(t.v0, n, facet.b0, m_bar.m0, t_bar.v0, rays.r0) +
               beam_adjoint(t.v1, n, facet.b1, m_bar.m1, t_bar.v1, rays.r1) +
               beam_adjoint(t.v2, n, facet.b2, m_bar.m2, t_bar.v2, rays.r2);
      }
    }
    const PlaneVector<T> sum = m_bar.m0 + m_bar.m1 + m_bar.m2;
    return beam_adjoint<T>(t.v0, n, facet.b0, sum, t_bar.v0);
  }

  /// Point where a ray of slope m from p meets the screen, in pixel coordinates.
  template <class T = double>
  [[nodiscard]] LF_HD LF_INLINE PlaneVector<T> land(const SpaceVector<T>& p,
                                                    const PlaneVector<T>& m) const {
    return screen_.land<T>(p, m);
  }
  /// Adjoint of land(): adds to p_bar and m_bar for a given u_bar.
  template <class T = double>
  LF_HD LF_INLINE void land_adjoint(const SpaceVector<T>& p, const PlaneVector<T>& m,
                                    const PlaneVector<T>& u_bar, SpaceVector<T>& p_bar,
                                    PlaneVector<T>& m_bar) const {
    screen_.land_adjoint<T>(p, m, u_bar, p_bar, m_bar);
  }
  /// Distance of a surface point from the screen's plane, mm; negative beyond it.
  [[nodiscard]] double clearance(const Eigen::Vector3d& p) const { return screen_.clearance(p); }
  /// True if the screen is beyond a surface point.
  [[nodiscard]] bool before_screen(const Eigen::Vector3d& p) const { return clearance(p) > 0.0; }

  /// Light that a triangle takes in, as the area of an evenly lit lens that takes in the same, mm²,
  /// measured where the rays enter. Moving a vertex inside a mesh does not change the sum over its
  /// triangles. If faces reflect, it is the light that the triangle lets out, by its own normal and
  /// the light at its middle, equal to the above at normal incidence.
  template <class T = double>
  [[nodiscard]] LF_HD LF_INLINE T intake(const CornersOf<T>& t,
                                         const CornerRays& known = {}) const {
    const T even = source_.intake(t, known);
    if constexpr (std::is_same_v<T, double>) {
      if (loses()) return even * passed_share(t);
    }
    return even;
  }
  /// True if intake() is the plan area whatever the triangle's slope, so all cells of an even grid
  /// take in the same.
  [[nodiscard]] LF_HD bool intake_is_plan_area() const { return source_.along_z() && !loses(); }

  /// intake() as a share of a whole (Sun et al., Eq. 1): the intake of a flat surface of the lens's
  /// size (for parallel light inside its outline), or the argument of sharing().
  template <class T = double>
  [[nodiscard]] LF_HD LF_INLINE T flux(const CornersOf<T>& t, const CornerRays& known = {}) const {
    return intake(t, known) * per_whole_;
  }
  /// Adjoint of flux(): adds to the derivatives by the corners, or by area_normal(t) if flux
  /// depends on that alone.
  template <class T = double>
  LF_HD LF_INLINE void flux_adjoint(const CornersOf<T>& t, const T& flux_bar, CornersOf<T>& t_bar,
                                    SpaceVector<T>& area_normal_bar,
                                    const CornerRays& known = {}) const {
    const T bar = flux_bar * per_whole_;
    if constexpr (std::is_same_v<T, double>) {
      if (loses()) return lossy_intake_adjoint(t, bar, t_bar, area_normal_bar, known);
    }
    source_.intake_adjoint(t, bar, t_bar, area_normal_bar, known);
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
  template <class T>
  struct BarrierAt {
    T value;
    SpaceVector<T> by_a;
    SpaceVector<T> by_n;
  };

  /// LightSource::incident(). @pre takes_lanes(), or T is a double.
  template <class T>
  [[nodiscard]] LF_HD LF_INLINE SpaceVector<T> incident(const SpaceVector<T>& p,
                                                        const IncidentRay* known) const {
    if constexpr (std::is_same_v<T, double>) {
      return source_.incident(p, known);
    } else {
      return in_all_lanes<T>(source_.direction());
    }
  }

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

  [[nodiscard]] LF_HD LF_APART double passed_share(const Corners& t) const {
    return Passage(*this, t).share();
  }
  LF_HD LF_APART void lossy_intake_adjoint(const Corners& t, double bar, Corners& t_bar,
                                           Eigen::Vector3d& area_normal_bar,
                                           const CornerRays& known) const {
    const Passage passage(*this, t);
    source_.intake_adjoint(t, bar * passage.share(), t_bar, area_normal_bar, known);
    passage.adjoint(*this, bar * source_.intake(t, known), t_bar, area_normal_bar);
  }

  /// Values of kind_: lens, lens whose faces reflect (OpticalSetup::fresnel), mirror.
  static constexpr std::int64_t kLens = 0;
  static constexpr std::int64_t kLosing = 1;
  static constexpr std::int64_t kMirror = 2;

  // One for each kind of part.
  static std::int64_t kind_of(const LensBody&, bool fresnel) { return fresnel ? kLosing : kLens; }
  static std::int64_t kind_of(const MirrorBody&, bool /*fresnel*/) { return kMirror; }
  [[nodiscard]] LF_HD bool reflects() const { return kind_ == kMirror; }
  [[nodiscard]] LF_HD bool loses() const { return kind_ == kLosing; }
  template <class T>
  [[nodiscard]] LF_HD LF_INLINE ValueSlopeOf<T> barrier_along_z(const SpaceVector<T>& n) const {
    const ValueSlopeOf<T> f = reflection_barrier<T>(n.z(), eta_);
    if (!screen_.turned()) return f;
    const T none{};
    const MaskOf<T> transmits = this->transmits<T>(SpaceVector<T>(none, none, none), n);
    return {transmits ? f.value : none + kInfinity, transmits ? f.slope : none};
  }
  template <class T>
  [[nodiscard]] LF_HD LF_INLINE T barrier_value(const SpaceVector<T>& a,
                                                const SpaceVector<T>& n) const {
    const T c = n.dot(a);
    const T value = reflects() ? -1.0 / (c * (a.z() - 2.0 * c * n.z()))
                               : 1.0 / refracted_cosine_squared<T>(c, eta_);
    return leaves<T>(a, n) ? value : T{} + kInfinity;
  }
  /// @pre leaves(a, n).
  template <class T>
  [[nodiscard]] LF_HD LF_INLINE BarrierAt<T> barrier_at(const SpaceVector<T>& a,
                                                        const SpaceVector<T>& n) const {
    const T none{};
    const T c = n.dot(a);
    if (!reflects()) {
      const ValueSlopeOf<T> f = reflection_barrier<T>(c, eta_);
      return {f.value, f.slope * n, f.slope * a};
    }
    // f = −1 / (c b_z) with b_z = a_z − 2 c n_z.
    const T b_z = a.z() - 2.0 * c * n.z();
    const T f = -1.0 / (c * b_z);
    const T by_bz = -f / b_z;
    const T by_c = -f / c - 2.0 * n.z() * by_bz;
    return {f, by_c * n + SpaceVector<T>(none, none, by_bz),
            by_c * a + SpaceVector<T>(none, none, -2.0 * c * by_bz)};
  }
  /// A corner's share of barrier_adjoint().
  LF_HD LF_INLINE double corner_barrier(const Eigen::Vector3d& p, const Eigen::Vector3d& n,
                                        double weight, Eigen::Vector3d& p_bar,
                                        Eigen::Vector3d& n_bar, const IncidentRay* known) const {
    const BarrierAt<double> f = barrier_at<double>(source_.incident(p, known), n);
    p_bar += source_.incident_adjoint(p, weight * f.by_a, known);
    n_bar += weight * f.by_n;
    return f.value / 3.0;
  }
  [[nodiscard]] LF_HD LF_APART double varied_barrier(const Corners& t, const Eigen::Vector3d& n,
                                                     const CornerRays& known) const {
    return (barrier_value<double>(source_.incident(t.v0, known.r0), n) +
            barrier_value<double>(source_.incident(t.v1, known.r1), n) +
            barrier_value<double>(source_.incident(t.v2, known.r2), n)) /
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
  template <class T>
  [[nodiscard]] LF_HD LF_INLINE MaskOf<T> leaves(const SpaceVector<T>& a,
                                                 const SpaceVector<T>& n) const {
    const T none{};
    const T c = n.dot(a);
    MaskOf<T> leaves = n.z() > none;
    if (reflects()) {
      leaves = leaves & (c < none) & (a.z() - 2.0 * c * n.z() > none);
    } else {
      // b_z = √s n_z − η (c n_z − a_z), compared without the root.
      const T s = refracted_cosine_squared<T>(c, eta_);
      const T back = eta_ * (c * n.z() - a.z());
      const MaskOf<T> upwards = (back < none) | (s * n.z() * n.z() > back * back);
      leaves = leaves & (c > none) & (s > none) & upwards;
    }
    if (!screen_.turned()) return leaves;
    leaves = leaves & screen_.is_towards<T>(reflects() ? RefractedBeamOf<T>::reflected(a, n).m
                                                       : RefractedBeamOf<T>(a, n, eta_).m);
    return leaves;
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
