// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <string>

namespace lensforge {

/// @throw RunError naming the call and CUDA's message, unless `status` is success.
void check_cuda(cudaError_t status, const char* call);

/// Message for a request of `bytes` of GPU memory when `free` of `total` are free.
std::string out_of_gpu_memory(std::size_t bytes, std::size_t free, std::size_t total);

}  // namespace lensforge

/// Every call of the CUDA runtime goes through this.
#define LF_CUDA(call) ::lensforge::check_cuda((call), #call)
