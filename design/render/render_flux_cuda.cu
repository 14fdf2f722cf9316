// SPDX-License-Identifier: GPL-3.0-or-later
#include <vector>

#include "core/compute/cuda/launch.cuh"
#include "design/render/render_flux.h"

namespace lensforge {

std::vector<double> render_flux_cuda(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                     SurfaceModel model, const Executor& executor) {
  return render_flux(mesh, setup, model, CudaExecutor(executor));
}

}  // namespace lensforge
