// SPDX-License-Identifier: GPL-3.0-or-later
#include <cuda_runtime_api.h>

#include "core/compute/executor.h"

namespace lensforge {

namespace {

/// An empty kernel: it loads only if this build has code for the GPU.
__global__ void probe() {}

}  // namespace

Gpu find_gpu() {
  int count = 0;
  cudaError_t status = cudaGetDeviceCount(&count);
  if (status == cudaSuccess && count == 0) status = cudaErrorNoDevice;
  if (status != cudaSuccess) return {false, "", cudaGetErrorString(status)};
  cudaDeviceProp properties{};
  status = cudaGetDeviceProperties(&properties, 0);
  if (status != cudaSuccess) return {false, "", cudaGetErrorString(status)};
  cudaFuncAttributes attributes{};
  status = cudaFuncGetAttributes(&attributes, probe);
  if (status != cudaSuccess) return {false, properties.name, cudaGetErrorString(status)};
  return {true, properties.name, ""};
}

}  // namespace lensforge
