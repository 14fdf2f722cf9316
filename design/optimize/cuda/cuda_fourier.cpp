// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/optimize/cuda/cuda_fourier.h"

#include <string>

#include "core/error.h"

namespace lensforge {

namespace {

void check(cufftResult status, const char* call) {
  if (status == CUFFT_SUCCESS) return;
  const std::string reason = status == CUFFT_ALLOC_FAILED ? "not enough GPU memory" : "failed";
  throw RunError(std::string("GPU: ") + call + ": " + reason + " (cuFFT status " +
                 std::to_string(static_cast<int>(status)) + ")");
}

}  // namespace

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

}  // namespace lensforge
