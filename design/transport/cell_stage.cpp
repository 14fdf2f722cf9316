// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/cell_stage.h"

#include "design/transport/cell_stage_on.h"

namespace lensforge {

std::unique_ptr<CellStage> make_cell_stage(const Eigen::Matrix2Xd& sites,
                                           const Executor& executor) {
#if defined(LENSFORGE_CUDA)
  if (executor.device() == Device::kCuda && sites.cols() > kDirectLimit) {
    return make_cuda_cell_stage(sites, executor);
  }
#endif
  return std::make_unique<CellStageOn<Executor>>(sites, executor);
}

}  // namespace lensforge
