// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "core/compute/executor.h"
#include "core/lens/optical_surface.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// A grid of nodes over a part of a surface: node (i, j) lies at origin + step ∘ (i, j), mm.
struct WaveGrid {
  Eigen::Vector2d origin{0.0, 0.0};
  Eigen::Vector2d step{0.0, 0.0};
  int columns = 0;
  int rows = 0;

  [[nodiscard]] Eigen::Vector2d place(int i, int j) const {
    return origin + step.cwiseProduct(Eigen::Vector2d(i, j));
  }
};

/// Heights (mm) and slopes at the nodes of a grid, row by row.
struct WaveSamples {
  std::vector<double> z, slope_x, slope_y;
};

/// Samples a surface over its lens's rectangle; called by several threads at once.
using WaveSurface = std::function<void(const WaveGrid&, WaveSamples&)>;

/// Samples a lens's surface. @param surface  must outlive the result; without creases.
WaveSurface wave_surface(const OpticalSurface& surface);

/// Length over which such a surface bends smoothly, mm: the mean knot cell of a spline, the mean
/// side of other surfaces' triangles.
double wave_detail(const OpticalSurface& surface);

/// Light as a scalar wave.
struct WaveOptions {
  double wavelength = 550e-6;  ///< In air, mm, > 0.
  /// Length over which the surface bends smoothly, mm, > 0: rays are traced a quarter of it apart.
  double detail = 0.08;
  /// Angle within which the surface scatters beside its rays, rad: λ / pitch for a tool's marks.
  double scatter = 0.0;
  /// Side of the tiles into which the lens is divided, and width over which neighbours overlap, in
  /// lengths over which waves interfere: λ f / pixel, at least √(λ f). With 0 the lens is one
  /// piece.
  double tile = 24.0;
  double overlap = 8.0;
};

/// Light that a surface sends to every pixel of `setup`, as shares of the lens's whole, by scalar
/// waves of one wavelength; row by row from the top. An extended source is many points whose light
/// does not interfere: its picture is blurred, as by rays (source_kernel()).
///
/// The lens is divided into tiles with windows whose squares sum to 1. The rays of each are traced
/// through its surface to a plane at its mean height, exactly; where they fold above the surface
/// every branch adds its field with its own optical path, and −π/2 beyond a fold. The field without
/// the phase of the mean ray, amplitude √(light per area), goes to the screen by the angular
/// spectrum along that ray (Goodman, Introduction to Fourier Optics, section 3.10), and the tiles'
/// intensities are added. Waves of points farther apart than about λ f / pixel do not interfere in
/// a pixel's mean, so windows that overlap more than that change nothing but the speed;
/// WavePicture.* bound the error against one piece by 2e-4 MAE.
///
/// Same bits for any number of threads.
/// @throw Interrupted.
std::vector<double> wave_flux(const OpticalSetup& setup, const WaveSurface& surface,
                              const WaveOptions& options, const Executor& executor,
                              const RunControl& control);

}  // namespace lensforge
