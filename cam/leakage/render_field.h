// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "cam/leakage/leakage.h"
#include "core/compute/executor.h"
#include "core/lens/surface_field.h"
#include "core/optics/optical_setup.h"
#include "design/flux/flux_image.h"

namespace lensforge {

/// Common settings for rendering the surfaces of a lens.
struct FieldRenderSetup {
  OpticalSetup optics;
  GridWindow grid;          ///< Over the whole lens, see lens_grid().
  std::int64_t tile = 768;  ///< Side of the tiles sampled at once, cells: 30 MB.
  /// LightPath::intake() of the whole surface, mm², in each of light_colors(); if empty, the grid's
  /// area, that of light along z.
  std::vector<double> whole{};
  /// Approximate height of the surface, mm, for the image of an extended source.
  double surface_height = 0.0;

  [[nodiscard]] double whole_in(std::size_t color) const {
    return whole.empty() ? 0.0 : whole[color];
  }

  /// Blur of an extended source against a point.
  [[nodiscard]] SourceKernel blur() const { return source_kernel(optics, surface_height); }
  /// The optics with pixels divided as the blur requires.
  [[nodiscard]] OpticalSetup optics_in_parts(const SourceKernel& kernel) const;
};

/// Renders a surface tile by tile: memory does not grow with the grid. Every image triangle is
/// deposited exactly (design/flux); only the curvature of the slope inside a triangle is neglected.
/// Under an extended source the picture is blurred as the optimiser does it, see source_kernel();
/// for a spectrum it is the sum of the colours' pictures. Same bits for any tile and any number of
/// threads.
/// @throw Interrupted if `control` or the executor asks for an end.
FluxPicture render_field(const SurfaceField& field, const FieldRenderSetup& setup,
                         const Executor& executor, const RunControl& control);

/// Renders several surfaces tile by tile, each tile for all of them in order, so that surfaces made
/// from one another can share samples (HeldField). One picture per surface, with the same bits as
/// when rendered alone.
std::vector<FluxPicture> render_fields(std::span<const SurfaceField* const> fields,
                                       const FieldRenderSetup& setup, const Executor& executor,
                                       const RunControl& control, const TileObserver& observe = {});

/// Picture that a part of the lens projects, as shares of the whole lens's flux.
FluxPicture render_cells(const SurfaceField& field, const FieldRenderSetup& setup,
                         const CellRange& cells, const Executor& executor,
                         const RunControl& control);

/// The same, by waves if there are options for them: wave_flux_of().
FluxPicture light_of_cells(const SurfaceField& field, const FieldRenderSetup& setup,
                           const CellRange& cells, const std::optional<WaveOptions>& waves,
                           const Executor& executor, const RunControl& control);

}  // namespace lensforge
