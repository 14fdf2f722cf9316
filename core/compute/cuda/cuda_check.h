// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <string>

namespace lensforge {

/// @throw RunError naming the call and what CUDA says, unless `status` is success.
void check_cuda(cudaError_t status, const char* call);

/// What to tell when `bytes` of GPU memory are asked for and `free` of `total` are left.
std::string out_of_gpu_memory(std::size_t bytes, std::size_t free, std::size_t total);

}  // namespace lensforge

/// Every call of the CUDA runtime goes through this.
#define LF_CUDA(call) ::lensforge::check_cuda((call), #call)
