// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "cam/cam_options.h"
#include "cam/leakage/leak_map.h"
#include "cam/leakage/leakage.h"
#include "cam/milled/creases.h"
#include "cam/part_surfaces.h"
#include "cam/report/report_data.h"
#include "cam/tolerance/tolerance_forecast.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/image/layered_image.h"
#include "core/surface/lens.h"
#include "core/surface/surface_mesh.h"

namespace lensforge {

/// What a part will project, before it is cut.
struct Prediction {
  LeakageResult leakage;
  SamplingCheck sampling;         ///< Of the part.
  std::vector<LeakPlace> places;  ///< That leak most, worst first.
  CreaseMap creases;
  ReportMap height;              ///< Part − designed, µm.
  LensRaster surface;            ///< Heights of the part, mm.
  SurfaceMesh milled;            ///< The surface as milled, at kMeshSpacing.
  LayeredImage surfaces;         ///< Designed but polished, and the part: PartLayers.
  ToleranceForecast tolerances;  ///< Empty unless it is asked for.
};

/// Spacing of the nodes of milled.ply, mm: 100 mm take 1 million.
inline constexpr double kMeshSpacing = 0.1;

/// Renders every surface from the design to the polished part and finds where light leaks. Memory
/// does not grow with the number of samples. @throw Interrupted
Prediction predict_part(const PartSurfaces& surfaces, const Lens& lens, const CamOptions& options,
                        const Executor& executor, const RunControl& control);

}  // namespace lensforge
