// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cam/cut_plan.h"
#include "cam/leakage/render_field.h"
#include "cam/part_surfaces.h"
#include "cam/tolerance/part_model.h"
#include "cam/tolerance/tolerance_forecast.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/surface/lens.h"

namespace lensforge {

/// A cut whose parts are drawn.
struct ToleranceSite {
  const CutPlan& plan;
  const Lens& lens;
  const PartSurfaces& surfaces;
  const FluxPicture& designed;  ///< Picture of the design.
};

/// What the programs of a cut assume of a part.
PartPlan part_plan(const CamOptions& options, const Lens& lens, const CutPlan& plan);

/// Draws CamOptions::tolerances parts with the workshop's errors and predicts them.
/// @throw Interrupted
ToleranceForecast draw_parts(const ToleranceSite& site, const Executor& executor,
                             const RunControl& control);

}  // namespace lensforge
