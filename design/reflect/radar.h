// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge::reflect {

/// Maximum number of rays per direction; a mesh that is larger in wavelengths is refused.
inline constexpr double kMaxRadarRays = 4e6;

/// @throw InputError naming --radar if a direction takes more than kMaxRadarRays.
void require_radar_size(const SurfaceMesh& mesh, double wavelength);

/// Radar cross-section of a perfectly conducting shape seen from the unit vector `towards`, in the
/// square of the mesh's unit, by physical optics: σ = 4π/λ² |Σ (n·ω) ∫ e^{2ikω·r} dA|² over the
/// visible surface, with every face's integral exact. Light of two and three bounces is added by
/// shooting and bouncing rays (Ling, Chou & Lee 1989), Σ_tubes ΔA ½(1 + n·ω/|n·d|) e^{ik·path} with
/// a sign per bounce; tubes are a tenth of a wavelength wide. Same bits for any number of threads.
/// @param wavelength  in the mesh's unit, > 0.
/// @throw InputError as require_radar_size(); Interrupted.
double radar_cross_section(const SurfaceMesh& mesh, const Eigen::Vector3d& towards,
                           double wavelength, const Executor& executor);

/// The cross-sections from `count` azimuths on the horizon, the first from +x.
std::vector<double> horizon_cross_sections(const SurfaceMesh& mesh, double wavelength, int count,
                                           const Executor& executor);

/// Number of directions around the horizon, one every 5°.
inline constexpr int kRadarAzimuths = 72;

/// Wavelength of a frequency, mm.
double radar_wavelength(double ghz);

/// Cross-sections around the horizon of the original mesh and of the new shape, m²; the meshes are
/// in millimetres.
struct RadarComparison {
  double ghz = 0.0;
  std::vector<double> before;
  std::vector<double> after;
};

/// @throw InputError naming --radar; Interrupted.
RadarComparison compare_radar(const SurfaceMesh& before, const SurfaceMesh& after, double ghz,
                              const Executor& executor);

/// The mean of cross-sections in dBsm, 10 log₁₀ of their mean.
double mean_dbsm(const std::vector<double>& sections);

/// {"ghz", "mean_dbsm_before", "mean_dbsm_after"}
nlohmann::json radar_json(const RadarComparison& comparison);
/// "azimuth_deg,before_dbsm,after_dbsm", a line per azimuth.
std::string radar_csv(const RadarComparison& comparison);
/// Both as curves around the horizon, 10 dB per ring, as SVG.
std::string radar_svg(const RadarComparison& comparison);

}  // namespace lensforge::reflect
