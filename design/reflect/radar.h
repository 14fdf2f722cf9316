// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <complex>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "design/reflect/mesh/faces.h"
#include "design/reflect/radar_curvature.h"
#include "design/reflect/radar_edges.h"
#include "design/reflect/reflect_shape.h"

namespace lensforge::reflect {

/// Maximum number of rays per direction; a mesh that is larger in wavelengths is refused.
inline constexpr double kMaxRadarRays = 4e6;

/// @throw InputError naming --radar if a direction takes more than kMaxRadarRays.
void require_radar_size(const SurfaceMesh& mesh, double wavelength);

/// A perfectly conducting shape in the waves of a radar.
class RadarBody {
 public:
  /// @param mesh  must outlive it. @param wavelength  in the mesh's unit, > 0.
  /// @throw InputError as require_radar_size()
  RadarBody(const SurfaceMesh& mesh, double wavelength);

  /// Σ (n·ω) ∫ e^{−2ikω·r} dA over the visible surface, with every face's integral exact (physical
  /// optics), seen from the unit vector ω `towards`. Edges add what the current beside them has
  /// more than that of physical optics (edge_fringe()), and faces of smooth surfaces are weighted
  /// for their curvature (CurvedFace). Two and three bounces are added by shooting and bouncing
  /// rays (Ling, Chou & Lee 1989): the current 2 n × h of a ray with the field f, in tubes a tenth
  /// of a wavelength wide, Σ_tubes ΔA (f·e − (d·e)(n·f)/(n·d)) e^{ik·path}. The origin of phases is
  /// the middle of the bounding box; time goes as e^{−iωt}. Same bits for any number of threads.
  /// @throw Interrupted
  [[nodiscard]] std::complex<double> amplitude(const Eigen::Vector3d& towards,
                                               Polarization polarization,
                                               const Executor& executor) const;

  /// Radar cross-section σ = 4π/λ² |amplitude|², in the square of the mesh's unit.
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
/// polarization of the options. @throw InputError naming --radar; Interrupted.
std::vector<double> radar_sections(const SurfaceMesh& mesh, const ReflectOptions& options,
                                   const Executor& executor);

/// Two meshes at the frequency and polarization of the options.
/// @throw InputError naming --radar; Interrupted.
RadarComparison compare_radar(const SurfaceMesh& before, const SurfaceMesh& after,
                              const ReflectOptions& options, const Executor& executor);

/// "vv" or "hh"
const char* polarization_word(Polarization polarization);

/// The mean of cross-sections in dBsm, 10 log₁₀ of their mean.
double mean_dbsm(const std::vector<double>& sections);

/// {"ghz", "polarization", "mean_dbsm_before", "mean_dbsm_after"}
nlohmann::json radar_json(const RadarComparison& comparison);
/// "azimuth_deg,before_dbsm,after_dbsm", a line per azimuth.
std::string radar_csv(const RadarComparison& comparison);
/// Both as curves around the horizon, 10 dB per ring, as SVG.
std::string radar_svg(const RadarComparison& comparison);

}  // namespace lensforge::reflect
