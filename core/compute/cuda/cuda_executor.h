// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cuda_runtime_api.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stop_token>

#include "core/compute/cuda/cuda_check.h"
#include "core/compute/cuda/device_buffer.h"
#include "core/compute/executor.h"

namespace lensforge {

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
