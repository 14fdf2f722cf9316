// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cufft.h>

#include "core/compute/cuda/cuda_executor.h"
#include "design/optimize/cosine_transform.h"

namespace lensforge {

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

}  // namespace lensforge
