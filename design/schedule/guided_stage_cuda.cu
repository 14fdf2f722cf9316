// SPDX-License-Identifier: GPL-3.0-or-later
#include <cufft.h>

#include <memory>
#include <string>

#include "core/compute/cuda/cuda_executor.h"
#include "core/compute/cuda/launch.cuh"
#include "core/error.h"
#include "design/energy/objective_cuda.h"
#include "design/optimize/grid_preconditioner.h"
#include "design/schedule/guided_stage_on.h"

namespace lensforge {

namespace {

void check(cufftResult status, const char* call) {
  if (status == CUFFT_SUCCESS) return;
  const std::string reason = status == CUFFT_ALLOC_FAILED ? "not enough GPU memory" : "failed";
  throw RunError(std::string("GPU: ") + call + ": " + reason + " (cuFFT status " +
                 std::to_string(static_cast<int>(status)) + ")");
}

}  // namespace

/// cuFFT behind the interface of ExtendedTransforms.
class CudaFourier {
 public:
  /// @throw RunError if cuFFT cannot plan it.
  CudaFourier(const EvenExtension& size, int planes, const CudaExecutor& executor);
  ~CudaFourier();
  CudaFourier(const CudaFourier&) = delete;
  CudaFourier& operator=(const CudaFourier&) = delete;

  /// Transforms `in` to `out`, both in the GPU's memory; overwrites `in`.
  void run(double* in, double* out);

 private:
  CudaExecutor executor_;
  cufftHandle plan_ = 0;
};

template <>
class GridTransforms<CudaExecutor> : public ExtendedTransforms<CudaExecutor, CudaFourier> {
 public:
  using ExtendedTransforms::ExtendedTransforms;
};

CudaFourier::CudaFourier(const EvenExtension& size, int planes, const CudaExecutor& executor)
    : executor_(executor) {
  int extent[2] = {size.extended_rows(), size.extended_columns()};
  int in[2] = {extent[0], extent[1]};
  int out[2] = {extent[0], size.columns};
  check(cufftPlanMany(&plan_, 2, extent, in, 1, static_cast<int>(size.extended_nodes()), out, 1,
                      static_cast<int>(size.coefficients()), CUFFT_D2Z, planes),
        "cufftPlanMany");
  check(cufftSetStream(plan_, executor_.stream()), "cufftSetStream");
  LF_CUDA(cudaDeviceSynchronize());  // The plan's tables are filled in another stream.
}

CudaFourier::~CudaFourier() { static_cast<void>(cufftDestroy(plan_)); }

void CudaFourier::run(double* in, double* out) {
  static_assert(sizeof(cufftDoubleComplex) == 2 * sizeof(double));
  executor_.begin_kernel();
  check(cufftExecD2Z(plan_, in, reinterpret_cast<cufftDoubleComplex*>(out)), "cufftExecD2Z");
  executor_.end_kernel("fourier transform");
}

std::unique_ptr<GuidedStage> make_cuda_stage(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                             double aspect, const DesignGoal& goal,
                                             const ObjectiveOptions& options,
                                             const Executor& executor) {
  return std::make_unique<GuidedStageOn<CudaExecutor>>(mesh, setup, aspect, goal, options,
                                                       CudaExecutor(executor));
}

}  // namespace lensforge
