// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <limits>

#include "bench/gpu_rates.h"
#include "core/compute/cuda/cuda_executor.h"

namespace lensforge::bench {

namespace {

constexpr std::size_t kCopyBytes = std::size_t{1} << 30;
constexpr int kRepeats = 10;
constexpr int kBlocks = 2048;
constexpr int kThreads = 256;
constexpr int kSteps = 4096;

/// Eight chains that do not wait for each other; two operations a step each.
__global__ void multiply_and_add(double factor, double* out) {
  double chain[8];
  for (int k = 0; k < 8; ++k) chain[k] = 1.0 + k + threadIdx.x;
  for (int i = 0; i < kSteps; ++i) {
    for (int k = 0; k < 8; ++k) chain[k] = __dadd_rn(__dmul_rn(chain[k], factor), 0.5);
  }
  double sum = 0.0;
  for (int k = 0; k < 8; ++k) sum += chain[k];
  out[blockIdx.x * kThreads + threadIdx.x] = sum;
}

/// Seconds of the fastest of several runs, the first left out.
double fastest(const std::function<void()>& work) {
  cudaEvent_t begin = nullptr;
  cudaEvent_t end = nullptr;
  LF_CUDA(cudaEventCreate(&begin));
  LF_CUDA(cudaEventCreate(&end));
  float best = std::numeric_limits<float>::infinity();
  for (int i = 0; i <= kRepeats; ++i) {
    LF_CUDA(cudaEventRecord(begin));
    work();
    LF_CUDA(cudaEventRecord(end));
    LF_CUDA(cudaEventSynchronize(end));
    float milliseconds = 0.0F;
    LF_CUDA(cudaEventElapsedTime(&milliseconds, begin, end));
    if (i > 0) best = std::min(best, milliseconds);
  }
  LF_CUDA(cudaEventDestroy(end));
  LF_CUDA(cudaEventDestroy(begin));
  return 1e-3 * static_cast<double>(best);
}

}  // namespace

GpuRates measure_gpu_rates() {
  GpuRates rates;
  {
    DeviceBuffer<char> from(kCopyBytes);
    DeviceBuffer<char> to(kCopyBytes);
    LF_CUDA(cudaMemset(from.data(), 1, kCopyBytes));
    const double seconds = fastest([&] {
      LF_CUDA(cudaMemcpyAsync(to.data(), from.data(), kCopyBytes, cudaMemcpyDeviceToDevice));
    });
    rates.copy = 2.0 * static_cast<double>(kCopyBytes) / seconds;
  }
  DeviceBuffer<double> out(static_cast<std::size_t>(kBlocks) * kThreads);
  const double seconds = fastest([&] {
    multiply_and_add<<<kBlocks, kThreads>>>(0.999, out.data());
    LF_CUDA(cudaGetLastError());
  });
  rates.operations = 16.0 * kSteps * kBlocks * kThreads / seconds;
  return rates;
}

void print_kernel_rows(const KernelProfile& profile,
                       const std::map<std::string, double>& least_bytes, const GpuRates& rates) {
  std::printf("\n%-20s %10s %12s %10s %12s\n", "kernel", "calls", "us a call", "least MB",
              "of copy rate");
  for (const auto& [kernel, entry] : profile.entries()) {
    const double seconds = entry.seconds / static_cast<double>(entry.calls);
    std::printf("%-20s %10lld %12.1f", kernel.c_str(), static_cast<long long>(entry.calls),
                1e6 * seconds);
    if (const auto found = least_bytes.find(kernel); found != least_bytes.end()) {
      std::printf(" %10.2f %11.0f%%", 1e-6 * found->second,
                  100.0 * found->second / seconds / rates.copy);
    }
    std::printf("\n");
  }
}

}  // namespace lensforge::bench
