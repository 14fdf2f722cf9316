// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/cpu_reference.h"

#include "core/compute/executor.h"
#include "design/executor_parity.h"
#include "design/render/render_flux.h"
#include "design/stage_on_rough_mesh.h"

namespace lensforge::testing {

std::vector<double> cpu_flux(const std::vector<ImageTriangle>& triangles) {
  return flux_of(triangles, Executor::serial());
}

std::vector<double> cpu_cotangent_sums(const std::vector<double>& pixels, int rows) {
  return cotangent_sums(pixels, rows, Executor::serial());
}

std::vector<double> cpu_render(SurfaceModel model) {
  return render_flux(rough_mesh(), kSetup, model, Executor::serial());
}

std::unique_ptr<GuidedStage> cpu_stage(SurfaceModel model, Goal goal) {
  return stage_on(model, goal, Executor::serial());
}

}  // namespace lensforge::testing
