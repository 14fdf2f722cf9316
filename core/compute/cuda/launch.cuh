// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/compute/cuda/cuda_executor.h"
#include "core/compute/host_device.h"

/// Starts kernels: the functions of core/compute/executor.h for a CudaExecutor.
namespace lensforge {

namespace cuda_detail {

/// Threads per block. The heavy kernels use so many registers that larger blocks gain nothing.
inline constexpr int kThreads = 128;

inline unsigned blocks_for(std::int64_t count, std::int64_t per_block) {
  return static_cast<unsigned>((count + per_block - 1) / per_block);
}

__device__ inline std::int64_t global_index() {
  return static_cast<std::int64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
}

template <class Functor>
__global__ void __launch_bounds__(kThreads) for_each(std::int64_t count, const Functor functor) {
  const std::int64_t i = global_index();
  if (i < count) functor(i);
}

template <class Functor>
__global__ void __launch_bounds__(kThreads)
    for_each_worker(std::int64_t count, const Functor functor) {
  const std::int64_t i = global_index();
  if (i < count) functor(i, 0);
}

/// Sum over the threads of a block, in a fixed tree order.
__device__ inline double block_sum(double value) {
  __shared__ double shared[kThreads];
  const int thread = static_cast<int>(threadIdx.x);
  shared[thread] = value;
  __syncthreads();
  for (int reach = kThreads / 2; reach > 0; reach /= 2) {
    if (thread < reach) shared[thread] += shared[thread + reach];
    __syncthreads();
  }
  const double sum = shared[0];
  __syncthreads();  // The next call writes where this one reads.
  return sum;
}

/// partial[k · blocks + block] ← Σ of term k over the block's items, one item per thread.
template <std::size_t N, class Functor>
__global__ void __launch_bounds__(kThreads)
    sum_blocks(std::int64_t count, const Functor functor, double* partial) {
  const std::int64_t i = global_index();
  std::array<double, N> item{};
  if (i < count) item = functor(i);
  for (std::size_t k = 0; k < N; ++k) {
    const double sum = block_sum(item[k]);
    if (threadIdx.x == 0) partial[k * gridDim.x + blockIdx.x] = sum;
  }
}

/// result[k] ← Σ of partial[k · count …], one block per term.
template <int Threads>
__global__ void __launch_bounds__(Threads)
    sum_partial(std::int64_t count, const double* partial, double* result) {
  const double* term = partial + blockIdx.x * count;
  double value = 0.0;
  for (std::int64_t i = threadIdx.x; i < count; i += Threads) value += term[i];
  const double sum = block_sum(value);
  if (threadIdx.x == 0) result[blockIdx.x] = sum;
}

template <class Scan>
__global__ void __launch_bounds__(kThreads) scan_row(int columns, const Scan scan) {
  using Value = typename Scan::Value;
  __shared__ Value shared[kThreads];
  const std::int64_t row = blockIdx.x;
  const int thread = static_cast<int>(threadIdx.x);
  Value before{};  // Sum of the finished strips.
  for (int first = 0; first < columns; first += kThreads) {
    const int column = first + thread;
    shared[thread] = column < columns ? scan.item(row, column) : Value{};
    __syncthreads();
    for (int reach = 1; reach < kThreads; reach *= 2) {
      const Value left = thread >= reach ? shared[thread - reach] : Value{};
      __syncthreads();
      shared[thread] += left;
      __syncthreads();
    }
    if (column < columns) scan.store(row, column, before + shared[thread]);
    before += shared[kThreads - 1];
    __syncthreads();
  }
}

}  // namespace cuda_detail

template <class Functor>
void parallel_for(const CudaExecutor& executor, const char* kernel, std::int64_t count,
                  const Functor& functor, std::int64_t /*grain*/ = 0) {
  namespace detail = cuda_detail;
  executor.begin_kernel();
  if (count <= 0) return;
  detail::for_each<<<detail::blocks_for(count, detail::kThreads), detail::kThreads, 0,
                     executor.stream()>>>(count, functor);
  executor.end_kernel(kernel);
}

template <class Functor>
void parallel_for_worker(const CudaExecutor& executor, const char* kernel, std::int64_t count,
                         const Functor& functor) {
  namespace detail = cuda_detail;
  executor.begin_kernel();
  if (count <= 0) return;
  detail::for_each_worker<<<detail::blocks_for(count, detail::kThreads), detail::kThreads, 0,
                            executor.stream()>>>(count, functor);
  executor.end_kernel(kernel);
}

/// Sums of blocks, then of the blocks' sums, both in fixed order: the same bits every time.
template <std::size_t N, class Functor>
CudaExecutor::PendingSum<N> pending_sum(const CudaExecutor& executor, const char* kernel,
                                        std::int64_t count, const Functor& functor) {
  namespace detail = cuda_detail;
  static_assert(N <= CudaExecutor::kMaxTerms);
  executor.begin_kernel();
  if (count <= 0) return {};
  const unsigned blocks = detail::blocks_for(count, detail::kThreads);
  double* partial = executor.partial_sums(blocks);
  double* result = executor.next_result();
  detail::sum_blocks<N>
      <<<blocks, detail::kThreads, 0, executor.stream()>>>(count, functor, partial);
  LF_CUDA(cudaGetLastError());
  detail::sum_partial<detail::kThreads>
      <<<static_cast<unsigned>(N), detail::kThreads, 0, executor.stream()>>>(blocks, partial,
                                                                             result);
  executor.end_kernel(kernel);
  return {executor, executor.collect_result(result)};
}

template <class Scan>
void scan_rows(const CudaExecutor& executor, const char* kernel, std::int64_t rows, int columns,
               const Scan& scan) {
  namespace detail = cuda_detail;
  executor.begin_kernel();
  if (rows <= 0 || columns <= 0) return;
  detail::scan_row<<<static_cast<unsigned>(rows), detail::kThreads, 0, executor.stream()>>>(columns,
                                                                                            scan);
  executor.end_kernel(kernel);
}

/// Product of two vectors' entries.
struct ProductEntry {
  const double* a;
  const double* b;
  LF_HD std::array<double, 1> operator()(std::int64_t i) const { return {a[i] * b[i]}; }
};

inline double dot(const CudaExecutor& executor, std::span<const double> a,
                  std::span<const double> b) {
  return pending_sum<1>(executor, "dot", static_cast<std::int64_t>(a.size()),
                        ProductEntry{a.data(), b.data()})
      .get()[0];
}

}  // namespace lensforge
