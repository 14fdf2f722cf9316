// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/lens/optical_surface.h"
#include "core/lens/surface_field.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "core/optics/picture_blur.h"

namespace lensforge {

/// The picture by waves of a surface that is given by its nodes, and the adjoint; for a design's
/// loop. Tiles are as in wave_flux(), on a grid that need not be even.
class NodeWaves {
 public:
  /// @param nodes  along x and y; the outermost are on the lens's rim. @param height  of the
  /// surface,
  ///        about, mm. @param control  stops it.
  NodeWaves(const OpticalSetup& setup, const GridShape& nodes, double height,
            const WaveOptions& options, const Executor& executor, const RunControl& control);
  NodeWaves(const NodeWaves&) = delete;
  NodeWaves& operator=(const NodeWaves&) = delete;
  ~NodeWaves();

  /// The picture, as of wave_flux(); none if rays went so far apart since the last look that it
  /// would take many times as long. @param positions, normals  three numbers a node; normals of any
  /// length, z > 0. @throw Interrupted.
  std::vector<double> look(const double* positions, const double* normals);
  /// Derivatives of Σ by_pixel · flux of the last look() by the positions. Slopes follow heights;
  /// see tile_heights_bar() for what is left out. @throw Interrupted.
  void look_adjoint(std::span<const double> by_pixel, double* positions_bar);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The grid on which waves follow a surface's rays: a quarter of the length over which it bends
/// apart, which is the mean knot cell of a spline, the mean side of other surfaces' triangles.
GridWindow wave_grid(const OpticalSetup& setup, const OpticalSurface& surface);

/// Light that each of several surfaces of one lens sends to every pixel of `setup`, as shares of
/// its whole, by scalar waves; row by row from the top. An extended source is many points whose
/// light does not interfere: its picture is blurred, as by rays (source_kernel()). A spectrum's is
/// the sum of its wavelengths'.
///
/// The lens is divided into tiles with windows whose squares sum to 1. The rays of each are traced
/// through its surface to a plane across its mean ray, exactly; where they fold above the surface
/// every branch adds its field with its own optical path, and −π/2 beyond a fold. The field, of
/// amplitude √(light per area), goes to the screen by the angular spectrum (Goodman, Introduction
/// to Fourier Optics, section 3.10) without the phases of the mean ray and of the rays' common
/// curvature (laid_ray()), on a screen that is tilted against it to several planes (OnPicture), and
/// the tiles' intensities are added. Waves of points farther apart than
/// about λ f / pixel do not interfere in a pixel's mean, so windows that overlap more than that
/// change nothing but the speed; WavePicture.* bound the error against one piece by 2e-4 MAE.
///
/// Tiles are sampled one after the other, each from all surfaces in order, so that surfaces made
/// from one another can share samples (HeldField). Same bits for any number of threads.
/// @param grid      nodes over the whole lens from which rays are traced; between them a surface is
///                  the cubic of its heights and slopes.
/// @param surfaces  without creases.
/// @throw Interrupted.
std::vector<std::vector<double>> wave_flux(const OpticalSetup& setup, const GridWindow& grid,
                                           std::span<const SurfaceField* const> surfaces,
                                           const WaveOptions& options, const Executor& executor,
                                           const RunControl& control);

/// A rectangle of a lens. Its window fades over ramp_width(), half of it beyond its sides: what
/// rectangles side by side send adds up to what they send together.
struct WavePart {
  GridWindow grid;  ///< Over the whole lens.
  CellRange cells;
  /// What the whole lens takes in, LightPath::intake(), mm², by wavelength; none: the grid's area.
  std::span<const double> whole;
};
/// wave_flux() of a part of one surface.
std::vector<double> wave_flux_of(const WavePart& part, const OpticalSetup& setup,
                                 const SurfaceField& surface, const WaveOptions& options,
                                 const Executor& executor, const RunControl& control);
/// mm. @param height  of the surface, about, mm.
double ramp_width(const OpticalSetup& setup, double height, const WaveOptions& options);

/// Processor seconds of one surface's picture in one wavelength, about, on 2 GHz cores: 128² on 25
/// mm at 75 mm take 4 to 5.
/// @param wavelength  mm; of each wavelength of a spectrum about as long.
double wave_seconds(const OpticalSetup& setup, double wavelength);

}  // namespace lensforge
