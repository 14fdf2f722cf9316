// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "design/reflect/mesh/faces.h"
#include "design/reflect/reflect_shape.h"

namespace lensforge::reflect {

/// Maximum number of rays per direction; a mesh that is larger in wavelengths is refused.
inline constexpr double kMaxRadarRays = 4e6;

/// @throw InputError naming the option if a direction takes more than kMaxRadarRays.
void require_radar_size(const SurfaceMesh& mesh, double wavelength, const char* option);

// Edges.

/// A face of a wedge, as long as wanted.
struct WedgeFace {
  Eigen::Vector3d out;     ///< Unit; in the face, from the edge and perpendicular to it.
  Eigen::Vector3d normal;  ///< Unit; away from the material.
};

/// A straight edge of a perfectly conducting body.
struct RadarEdge {
  Eigen::Vector3d from;
  Eigen::Vector3d to;
  std::array<WedgeFace, 2> faces;
  double open = 2.0;  ///< Angle outside of the material in units of π: 2 for the rim of a sheet.
  std::array<int, 2> vertices{};  ///< Of the mesh: its ends.
};

/// The field that an edge adds to physical optics, per length of edge and for monostatic radar: the
/// sum of physical optics, Σ (n·ω) ∫ e^{−2ikω·r} dA, grows by (i/k) f ∫ e^{−2ikω·r} dl with this f.
///
/// It is the far field of the fringe current on both faces, the exact current of the wedge
/// (Sommerfeld's series) without that of physical optics, integrated from the edge along the
/// diffracted ray that grazes the face, as in A. Michaeli, "Elimination of infinities in equivalent
/// edge currents, part I: fringe current components", IEEE Trans. Antennas Propag. 34(7), 1986.
/// This is the contribution of Ufimtsev's elementary edge waves and, up to the direction in which
/// the current is integrated, of Mitzner's incremental length diffraction coefficients.
/// @param towards       unit vector to the radar.
/// @param polarization  unit vector of the electric field sent and received, perpendicular to it.
/// @return 0 for directions inside the material, and along the edge.
double edge_fringe(const RadarEdge& edge, const Eigen::Vector3d& towards,
                   const Eigen::Vector3d& polarization);

/// The edges of a mesh that radar sees as such: boundaries, and convex edges whose faces turn by
/// more than λ/(2 h), where h is the mean height of both faces above the edge, or by more than 40°.
/// Faces that turn by less follow a smooth surface to λ/16, which is why their edges are none.
/// Concave edges add nothing of first order beside the light of two bounces.
/// @pre vertices in the same place are merged.
std::vector<RadarEdge> radar_edges(const SurfaceMesh& mesh, double wavelength);

// Faces of surfaces that bend.

/// The field that a parabolic cylinder of perfect conductor sends straight back from its vertex, as
/// a share of what physical optics and geometrical optics give, which agree there: the exact
/// solution of H. Lamb, "On Sommerfeld's diffraction problem; and on reflection by a parabolic
/// mirror", Proc. London Math. Soc. s2-4, 190-203, 1907. With w = −2iτ e^{−iτ²} ∫_τ^∞ e^{iu²} du
/// and τ² = kρ it is 1/w for an electric field along the cylinder and 1/(2 − w) across. Both go to
/// 1 for large kρ; for ρ = 0 they are the edge of a half-plane.
/// @param k_rho  wave number times radius of curvature at the vertex, > 0.
struct ParabolicShares {
  std::complex<double> along;
  std::complex<double> across;
};
ParabolicShares parabolic_shares(double k_rho);

/// How much more or less than physical optics a face of a curved surface sends back: 1 for a flat
/// one, for a cylinder the share of the parabolic one with its radius, seen from outside. For two
/// curvatures the shares are multiplied.
struct CurvedFace {
  Eigen::Vector3d along;       ///< Unit; direction of one principal curvature.
  std::complex<double> share;  ///< For the electric field in this direction.
  std::complex<double> other;  ///< For the electric field across.

  /// The share of the field sent and received with this polarization; n is the face's normal.
  [[nodiscard]] std::complex<double> of(const Eigen::Vector3d& polarization,
                                        const Eigen::Vector3d& n) const;
};

/// Of every face of a mesh, by the turns of the normals at its corners (Rusinkiewicz 2004). Faces
/// are flat where they are concave, and where they touch one of these vertices.
/// @param creased  a flag per vertex, set where the surface is not smooth.
std::vector<CurvedFace> curved_faces(const SurfaceMesh& mesh, const std::vector<bool>& creased,
                                     double wavelength);

/// The three parts of a body's amplitude.
struct RadarParts {
  std::complex<double> faces;
  std::complex<double> edges;
  std::complex<double> bounces;

  /// What one bounce sends back.
  [[nodiscard]] std::complex<double> direct() const { return faces + edges; }
  [[nodiscard]] std::complex<double> total() const { return faces + edges + bounces; }
};

/// A face that the radar sees, with the weight of its integral: its visible share times what its
/// curvature adds, negative if it is seen from behind.
struct SeenFace {
  int face = 0;
  std::complex<double> weight;
};

/// A perfectly conducting shape in the waves of a radar.
class RadarBody {
 public:
  /// @param mesh  must outlive it. @param wavelength  in the mesh's unit, > 0.
  /// @pre require_radar_size()
  RadarBody(const SurfaceMesh& mesh, double wavelength);

  /// Σ (n·ω) ∫ e^{−2ikω·r} dA over the visible surface, with every face's integral exact (physical
  /// optics), seen from the unit vector ω `towards`. Edges add what the current beside them has
  /// more than that of physical optics (edge_fringe()), and faces of smooth surfaces are weighted
  /// for their curvature (CurvedFace). Two and three bounces are added by shooting and bouncing
  /// rays (Ling, Chou & Lee 1989): the current 2 n × h of a ray with the field f, in tubes a tenth
  /// of a wavelength wide, Σ_tubes ΔA (f·e − (d·e)(n·f)/(n·d)) e^{ik·path}. The origin of phases is
  /// the middle of the bounding box; time goes as e^{−iωt}. Same bits for any number of threads.
  /// @throw Interrupted
  [[nodiscard]] RadarParts parts(const Eigen::Vector3d& towards, Polarization polarization,
                                 const Executor& executor) const;

  /// The faces whose integrals parts() sums, in their order. @throw Interrupted
  [[nodiscard]] std::vector<SeenFace> seen_faces(const Eigen::Vector3d& towards,
                                                 Polarization polarization,
                                                 const Executor& executor) const;

  /// σ/|amplitude|² = 4π/λ², in the square of the mesh's unit.
  [[nodiscard]] double section_scale() const;

  /// Origin of the phases.
  [[nodiscard]] const Eigen::Vector3d& middle() const { return middle_; }

  /// Radar cross-section σ = 4π/λ² |parts().total()|², in the square of the mesh's unit.
  [[nodiscard]] double cross_section(const Eigen::Vector3d& towards, Polarization polarization,
                                     const Executor& executor) const;

 private:
  class View;

  const SurfaceMesh& mesh_;
  RayScene scene_;
  Faces faces_;
  std::vector<RadarEdge> edges_;
  std::vector<CurvedFace> curved_;  ///< By the faces.
  Eigen::Vector3d middle_;
  double radius_;
  double wave_number_;
  std::int64_t tubes_ = 0;  ///< Across the square that covers the mesh.
  double cell_ = 0.0;       ///< Width of a tube.
};

/// Unit vector of the electric field: along the horizon, or perpendicular to that and to the sight.
Eigen::Vector3d radar_field(const Eigen::Vector3d& towards, Polarization polarization);

/// The cross-sections from `count` azimuths on the horizon, the first from +x.
std::vector<double> horizon_cross_sections(const RadarBody& body, Polarization polarization,
                                           int count, const Executor& executor);

/// Number of directions around the horizon, one every 5°.
inline constexpr int kRadarAzimuths = 72;

/// Wavelength of a frequency, mm.
double radar_wavelength(double ghz);

/// Cross-sections around the horizon, m², of a mesh in millimetres, at the frequency and
/// polarization of the options. @throw Interrupted
std::vector<double> radar_sections(const SurfaceMesh& mesh, const ReflectOptions& options,
                                   const Executor& executor);

/// Two meshes at the frequency and polarization of the options. @throw Interrupted
RadarComparison compare_radar(const SurfaceMesh& before, const SurfaceMesh& after,
                              const ReflectOptions& options, const Executor& executor);

/// "vv" or "hh"
const char* polarization_word(Polarization polarization);

/// The mean of cross-sections in dBsm, 10 log₁₀ of their mean.
double mean_dbsm(const std::vector<double>& sections);

/// The cross-section in dBsm that a tenth of them exceeds.
double p90_dbsm(std::vector<double> sections);

/// {"ghz", "polarization", "mean_dbsm_before", "mean_dbsm_after", "p90_dbsm_before",
/// "p90_dbsm_after"}; "ghz" of several frequencies is their list.
nlohmann::json radar_json(const RadarComparison& comparison);
/// "azimuth_deg,before_dbsm,after_dbsm", a line per azimuth.
std::string radar_csv(const RadarComparison& comparison);
/// Both as curves around the horizon, 10 dB per ring, as SVG.
std::string radar_svg(const RadarComparison& comparison);

}  // namespace lensforge::reflect
