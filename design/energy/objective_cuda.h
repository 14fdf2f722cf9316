// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/compute/cuda/cuda_executor.h"
#include "design/energy/objective.h"

namespace lensforge {

/// The objective on a GPU; its kernels are compiled once, in objective_cuda.cu.
extern template class DesignObjectiveOn<CudaExecutor>;

}  // namespace lensforge
