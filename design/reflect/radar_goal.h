// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "design/reflect/input.h"
#include "design/reflect/radar.h"
#include "design/reflect/reflect_shape.h"

namespace lensforge::reflect {

/// ∫ e^{iφ} over a triangle of area ½ on which φ is linear, and its derivatives by the phases at
/// the corners.
struct TriangleWave {
  std::complex<double> value;
  std::array<std::complex<double>, 3> by_phase;
};

/// Divided differences of e^{ix} (Hermite–Genocchi), with a power series where the phases hardly
/// differ. Error below 1e-7.
TriangleWave wave_with_slopes(const std::array<double, 3>& phase);

/// Frequencies and azimuths on the horizon over which --goal radar averages.
struct RadarSector {
  std::vector<double> ghz;
  std::vector<double> azimuth_deg;  ///< From +x towards +y.
};

/// Checks --frequency, --sector and what --goal radar does not go with.
/// @throw InputError naming the option, the value and the rule.
void require_radar_goal(const ReflectOptions& options);

/// The frequencies and the sector of the options. Between the sector's azimuths lie as many others
/// as `mesh`, in millimetres, needs: at λ/(6 R) no lobe hides between two of them, where R is the
/// largest distance from the vertical axis. @throw InputError naming --frequency or --sector
RadarSector radar_sector(const ReflectOptions& options, const SurfaceMesh& mesh);

/// The mean cross-sections of a mesh in millimetres over a sector, m²: of one bounce alone, and of
/// all. @throw Interrupted
Energies radar_energies(const SurfaceMesh& mesh, const RadarSector& sector,
                        Polarization polarization, const Executor& executor);

/// Two meshes in millimetres over a sector, averaged over its frequencies. @throw Interrupted
RadarComparison compare_radar(const SurfaceMesh& before, const SurfaceMesh& after,
                              const RadarSector& sector, Polarization polarization,
                              const Executor& executor);

/// The mean cross-section of a shape over a sector as a smooth function of its vertices near it.
/// Which faces the radar sees, their weights for curvature, and the field of edges and of two and
/// three bounces are kept as they are at the shape.
class RadarEchoes {
 public:
  /// @param mesh  in millimetres. @throw Interrupted
  RadarEchoes(const SurfaceMesh& mesh, const RadarSector& sector, Polarization polarization,
              const Executor& executor);

  /// The mean cross-section of the shape, m².
  [[nodiscard]] double mean() const;

  /// The mean cross-section, m², and its derivative by the vertices, 3 × V, which is exact for the
  /// sum of physical optics. Same bits for any number of threads. @throw Interrupted
  double value_and_gradient(const Eigen::Matrix3Xd& vertices, Eigen::Matrix3Xd& gradient) const;

 private:
  /// One direction at one frequency.
  struct Echo {
    Eigen::Vector3d towards;
    double wave_number = 0.0;
    double scale = 0.0;          ///< Of its |amplitude|² in the mean.
    std::complex<double> total;  ///< Amplitude of the shape.
    std::complex<double> rest;   ///< The same without the faces.
    std::vector<SeenFace> faces;
  };

  /// Adds a direction's derivative by the vertices. @return its share of the mean.
  double add(const Echo& echo, const Eigen::Matrix3Xd& vertices, Eigen::Matrix3Xcd& by_vertex,
             Eigen::Matrix3Xd& gradient) const;

  Eigen::Matrix3Xi triangles_;
  Eigen::Vector3d middle_;
  std::vector<Echo> echoes_;
  Executor executor_;
};

struct RadarDescentOptions {
  double wavelength = 0.0;     ///< The longest one, mm.
  double anchor = 0.0;         ///< β
  double first_section = 0.0;  ///< Mean cross-section of the reference, m².
};

/// Lowers a shape's mean cross-section by moving its vertices: L-BFGS on
///
///     σ/σ₀ + β/A Σ_edges w ‖u_i − u_j‖²,
///
/// where u is the displacement from the reference and w are the cotangent weights: β times the mean
/// squared slope of the displacement (Dirichlet energy over the area A). Steps are smooth over
/// kSmoothness wavelengths: the gradient goes through (M + ℓ²L)⁻¹ M (M + ℓ²L)⁻¹ with the mass M and
/// the Laplacian L of the reference.
class RadarDescent {
 public:
  /// @param reference  in millimetres.
  /// @param fixed      one flag per vertex, set for those that do not move. Empty: all move.
  RadarDescent(const SurfaceMesh& reference, const std::vector<std::uint8_t>& fixed,
               const RadarDescentOptions& options);
  ~RadarDescent();
  RadarDescent(RadarDescent&&) noexcept;
  RadarDescent& operator=(RadarDescent&&) noexcept;

  /// @param vertices  the shape of the echoes. No vertex moves by more than kRadarReach
  /// wavelengths. @throw Interrupted
  [[nodiscard]] Eigen::Matrix3Xd moved(const Eigen::Matrix3Xd& vertices, const RadarEchoes& echoes,
                                       const Executor& executor) const;

 private:
  struct Metric;
  std::unique_ptr<Metric> metric_;
};

}  // namespace lensforge::reflect
