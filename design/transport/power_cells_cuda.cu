// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>

#include "core/compute/cuda/launch.cuh"
#include "design/transport/power_cells_on.h"

namespace lensforge {

std::unique_ptr<CellStage> make_cuda_cell_stage(const Eigen::Matrix2Xd& sites,
                                                const Executor& executor) {
  return std::make_unique<CellStageOn<CudaExecutor>>(sites, CudaExecutor(executor));
}

}  // namespace lensforge
