// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "core/optics/optical_setup.h"
#include "design/flux/flux_triangle.h"
#include "design/objective_setups.h"
#include "design/schedule/guided_optimization.h"

/// The CPU's results, for comparison with other executors. Compiled separately: nvcc, which
/// compiles the tests on a GPU, rounds the CPU's part in other places than the C++ compiler does.
namespace lensforge::testing {

std::vector<double> cpu_flux(const std::vector<ImageTriangle>& triangles);
/// Sums from the right of `rows` rows.
std::vector<double> cpu_cotangent_sums(const std::vector<double>& pixels, int rows);
std::vector<double> cpu_render(SurfaceModel model);
/// The stage on the rough mesh.
std::unique_ptr<GuidedStage> cpu_stage(SurfaceModel model, Goal goal);

}  // namespace lensforge::testing
