// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cuda_runtime_api.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <type_traits>
#include <utility>

#include "core/compute/executor.h"

/// Every call of the CUDA runtime goes through this.
#define LF_CUDA(call) ::lensforge::check_cuda((call), #call)

namespace lensforge {

/// @throw RunError naming the call and CUDA's message, unless `status` is success.
void check_cuda(cudaError_t status, const char* call);

/// Message for a request of `bytes` of GPU memory when `free` of `total` are free.
std::string out_of_gpu_memory(std::size_t bytes, std::size_t free, std::size_t total);

namespace cuda_detail {

/// Plain device memory. @throw RunError naming the size and what is free, if there is too little.
void* allocate(std::size_t bytes);
void release(void* memory) noexcept;

}  // namespace cuda_detail

/// Owns an array in the memory of the GPU. Initially its contents are undefined.
template <class T>
class DeviceBuffer {
  static_assert(
      std::is_trivially_destructible_v<T>);  // Copied byte by byte (Eigen does not say so).

 public:
  DeviceBuffer() = default;
  /// @throw RunError if the GPU's memory does not suffice.
  explicit DeviceBuffer(std::size_t size)
      : data_(size == 0 ? nullptr : static_cast<T*>(cuda_detail::allocate(size * sizeof(T)))),
        size_(size) {}
  ~DeviceBuffer() { cuda_detail::release(data_); }
  DeviceBuffer(DeviceBuffer&& other) noexcept { swap(other); }
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    DeviceBuffer(std::move(other)).swap(*this);
    return *this;
  }
  DeviceBuffer(const DeviceBuffer&) = delete;
  DeviceBuffer& operator=(const DeviceBuffer&) = delete;

  void swap(DeviceBuffer& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
  }

  [[nodiscard]] T* data() { return data_; }
  [[nodiscard]] const T* data() const { return data_; }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Runs kernels on the first GPU, one after the other in its own stream. Members shared with
/// Executor are documented there; the functions that start kernels are in
/// core/compute/cuda/launch.cuh. Copies share stream and memory. Not thread-safe.
class CudaExecutor {
 public:
  template <class T>
  using Buffer = DeviceBuffer<T>;

  /// Result of pending_sum(); get() waits for the GPU. Call get() before kMaxPendingSums more sums
  /// are begun.
  template <std::size_t N>
  class PendingSum {
   public:
    PendingSum() = default;
    PendingSum(const CudaExecutor& executor, const double* slot)
        : executor_(&executor), slot_(slot) {}
    [[nodiscard]] std::array<double, N> get() const {
      std::array<double, N> values{};
      if (slot_ == nullptr) return values;
      executor_->wait();
      for (std::size_t k = 0; k < N; ++k) values[k] = slot_[k];
      return values;
    }

   private:
    const CudaExecutor* executor_ = nullptr;
    const double* slot_ = nullptr;
  };

  static constexpr int kMaxPendingSums = 32;
  static constexpr int kMaxTerms = 8;  ///< Per sum.

  /// Takes over profile and stop token of `options`. @throw RunError without a usable GPU.
  explicit CudaExecutor(const Executor& options);

  /// All kernels add to shared memory with atomics, so there is one worker.
  [[nodiscard]] int concurrency() const { return 1; }

  [[nodiscard]] cudaStream_t stream() const;
  /// Waits until everything begun is done. @throw RunError if a kernel has failed.
  void wait() const;

  /// Called before and after each kernel launch. @throw Interrupted, see Executor.
  void begin_kernel() const;
  void end_kernel(const char* kernel) const;

  /// Memory for the partial sums of `blocks` blocks; valid until the next call.
  [[nodiscard]] double* partial_sums(std::size_t blocks) const;
  /// Address on the GPU for the next sum's terms.
  [[nodiscard]] double* next_result() const;
  /// Starts the copy of that result to the caller's memory and returns its address there.
  [[nodiscard]] const double* collect_result(const double* result) const;

  /// Copies bytes from the caller's memory to the GPU's and back, after everything already begun.
  void copy_in(void* to, const void* from, std::size_t bytes) const;
  void copy_out(void* to, const void* from, std::size_t bytes) const;
  void clear(void* memory, std::size_t bytes) const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

template <class T>
void fill_zero(const CudaExecutor& executor, DeviceBuffer<T>& buffer) {
  executor.clear(buffer.data(), buffer.size() * sizeof(T));
}

template <class T>
void upload(const CudaExecutor& executor, std::span<const T> from, std::span<T> to) {
  executor.copy_in(to.data(), from.data(), from.size_bytes());
}

template <class T>
void download(const CudaExecutor& executor, std::span<const T> from, std::span<T> to) {
  executor.copy_out(to.data(), from.data(), from.size_bytes());
}

}  // namespace lensforge
