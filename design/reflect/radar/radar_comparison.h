// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge::reflect {

/// Directions around the horizon, one every 5°.
inline constexpr int kRadarAzimuths = 72;

/// Wavelength of a frequency, mm.
double radar_wavelength(double ghz);

/// Cross-sections around the horizon of the mesh as it came and of the new shape, m²; the meshes
/// are in millimetres.
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
/// "azimuth_deg,before_dbsm,after_dbsm", a line for every azimuth.
std::string radar_csv(const RadarComparison& comparison);
/// Both as curves around the horizon, 10 dB a ring, as SVG.
std::string radar_svg(const RadarComparison& comparison);

}  // namespace lensforge::reflect
