// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/compute/cuda/launch.cuh"
#include "design/energy/objective_cuda.h"

namespace lensforge {

template class DesignObjectiveOn<CudaExecutor>;

}  // namespace lensforge
