// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/compute/cuda/cuda_executor.h"

#include <cstdio>
#include <string>
#include <utility>

#include "core/error.h"

namespace lensforge {
namespace {

std::string megabytes(std::size_t bytes) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.1f MB", static_cast<double>(bytes) / 1e6);
  return text;
}

}  // namespace

void check_cuda(cudaError_t status, const char* call) {
  if (status == cudaSuccess) return;
  throw RunError(std::string("GPU: ") + call + ": " + cudaGetErrorString(status));
}

std::string out_of_gpu_memory(std::size_t bytes, std::size_t free, std::size_t total) {
  return "GPU memory: " + megabytes(bytes) + " more are needed, " + megabytes(free) + " of " +
         megabytes(total) + " are free; --device cpu does without";
}

namespace cuda_detail {

void* allocate(std::size_t bytes) {
  void* memory = nullptr;
  const cudaError_t status = cudaMalloc(&memory, bytes);
  if (status == cudaErrorMemoryAllocation) {
    static_cast<void>(
        cudaGetLastError());  // Clears the error, which later calls must not report as their own.
    std::size_t free = 0;
    std::size_t total = 0;
    LF_CUDA(cudaMemGetInfo(&free, &total));
    throw RunError(out_of_gpu_memory(bytes, free, total));
  }
  check_cuda(status, "cudaMalloc");
  return memory;
}

void release(void* memory) noexcept {
  // An error here comes from an earlier kernel; wait() reports it.
  if (memory != nullptr) static_cast<void>(cudaFree(memory));
}

}  // namespace cuda_detail

struct CudaExecutor::State {
  State() {
    LF_CUDA(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
    LF_CUDA(cudaEventCreate(&begin));
    LF_CUDA(cudaEventCreate(&end));
    LF_CUDA(cudaMallocHost(reinterpret_cast<void**>(&collected), kResults * sizeof(double)));
    results = DeviceBuffer<double>(kResults);
    LF_CUDA(cudaMemsetAsync(results.data(), 0, kResults * sizeof(double), stream));
  }
  ~State() {
    if (stream != nullptr) static_cast<void>(cudaStreamSynchronize(stream));
    if (collected != nullptr) static_cast<void>(cudaFreeHost(collected));
    if (end != nullptr) static_cast<void>(cudaEventDestroy(end));
    if (begin != nullptr) static_cast<void>(cudaEventDestroy(begin));
    if (stream != nullptr) static_cast<void>(cudaStreamDestroy(stream));
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  static constexpr std::size_t kResults =
      static_cast<std::size_t>(kMaxPendingSums) * static_cast<std::size_t>(kMaxTerms);

  cudaStream_t stream = nullptr;
  cudaEvent_t begin = nullptr;
  cudaEvent_t end = nullptr;
  double* collected = nullptr;   ///< Page-locked host memory.
  DeviceBuffer<double> results;  ///< A ring of kMaxPendingSums × kMaxTerms.
  std::size_t next = 0;
  DeviceBuffer<double> partial;
  KernelProfile* profile = nullptr;
  std::stop_token stop;
};

CudaExecutor::CudaExecutor(const Executor& options) : state_(std::make_shared<State>()) {
  state_->profile = options.profile();
  state_->stop = options.stop_token();
}

cudaStream_t CudaExecutor::stream() const { return state_->stream; }

void CudaExecutor::wait() const { LF_CUDA(cudaStreamSynchronize(state_->stream)); }

void CudaExecutor::begin_kernel() const {
  if (state_->stop.stop_requested()) throw Interrupted();
  if (state_->profile != nullptr) LF_CUDA(cudaEventRecord(state_->begin, state_->stream));
}

void CudaExecutor::end_kernel(const char* kernel) const {
  check_cuda(cudaGetLastError(), kernel);
  if (state_->profile == nullptr) return;
  LF_CUDA(cudaEventRecord(state_->end, state_->stream));
  check_cuda(cudaEventSynchronize(state_->end), kernel);
  float milliseconds = 0.0F;
  LF_CUDA(cudaEventElapsedTime(&milliseconds, state_->begin, state_->end));
  state_->profile->add(kernel, 1e-3 * static_cast<double>(milliseconds));
}

double* CudaExecutor::partial_sums(std::size_t blocks) const {
  const std::size_t size = blocks * static_cast<std::size_t>(kMaxTerms);
  if (state_->partial.size() < size) {
    wait();  // Running kernels may still use the old ones.
    state_->partial = DeviceBuffer<double>(size);
  }
  return state_->partial.data();
}

double* CudaExecutor::next_result() const {
  double* result = state_->results.data() + state_->next;
  state_->next = (state_->next + static_cast<std::size_t>(kMaxTerms)) % State::kResults;
  return result;
}

const double* CudaExecutor::collect_result(const double* result) const {
  double* collected = state_->collected + (result - state_->results.data());
  LF_CUDA(cudaMemcpyAsync(collected, result, kMaxTerms * sizeof(double), cudaMemcpyDeviceToHost,
                          state_->stream));
  return collected;
}

void CudaExecutor::copy_in(void* to, const void* from, std::size_t bytes) const {
  if (bytes == 0) return;
  LF_CUDA(cudaMemcpyAsync(to, from, bytes, cudaMemcpyHostToDevice, state_->stream));
  wait();
}

void CudaExecutor::copy_out(void* to, const void* from, std::size_t bytes) const {
  if (bytes == 0) return;
  LF_CUDA(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, state_->stream));
  wait();
}

void CudaExecutor::clear(void* memory, std::size_t bytes) const {
  if (bytes == 0) return;
  LF_CUDA(cudaMemsetAsync(memory, 0, bytes, state_->stream));
}

}  // namespace lensforge
