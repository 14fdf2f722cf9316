// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge::reflect {

/// Most rays that one direction may take; a mesh that is larger in wavelengths is refused.
inline constexpr double kMaxRadarRays = 4e6;

/// @throw InputError naming --radar if a direction takes more than kMaxRadarRays.
void require_radar_size(const SurfaceMesh& mesh, double wavelength);

/// Radar cross-section of a perfectly conducting shape seen from the unit vector `towards`, in the
/// square of the mesh's unit, by physical optics: σ = 4π/λ² |Σ (n·ω) ∫ e^{2ikω·r} dA|² over what is
/// seen, every face's integral exact, plus light of two and three bounces by shooting and bouncing
/// rays (Ling, Chou & Lee 1989), Σ_tubes ΔA ½(1 + n·ω/|n·d|) e^{ik·path} with a sign for every
/// bounce, a tenth of a wavelength wide. Same bits for any number of threads.
/// @param wavelength  in the mesh's unit, > 0.
/// @throw InputError as require_radar_size(); Interrupted.
double radar_cross_section(const SurfaceMesh& mesh, const Eigen::Vector3d& towards,
                           double wavelength, const Executor& executor);

/// The cross-sections from `count` azimuths on the horizon, the first from +x.
std::vector<double> horizon_cross_sections(const SurfaceMesh& mesh, double wavelength, int count,
                                           const Executor& executor);

}  // namespace lensforge::reflect
