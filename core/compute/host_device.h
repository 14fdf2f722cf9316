// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <type_traits>

/// Marks a per-item function that runs on the CPU and, compiled by nvcc, on the GPU as well.
#if defined(__CUDACC__)
#define LF_HD __host__ __device__
#else
#define LF_HD
#endif

/// Forces a function inline, so that results its caller does not use are not computed.
#if defined(__CUDACC__)
#define LF_INLINE __forceinline__
#else
#define LF_INLINE [[gnu::always_inline]] inline
#endif

/// Keeps a function out of line, so that light which never calls it does not pay for its registers
/// (4 % of an objective for parallel light).
#if defined(__CUDACC__)
#define LF_APART
#else
#define LF_APART [[gnu::noinline]]
#endif

namespace lensforge {

/// min(max(x, low), high), low for a NaN. std::fmin() and std::fmax() compile to calls because of
/// their NaN rules; this compiles to two instructions.
template <class T>
LF_HD LF_INLINE T clamped(const T& x, const std::type_identity_t<T>& low,
                          const std::type_identity_t<T>& high) {
  const T raised = x > low ? x : low;
  return raised < high ? raised : high;
}

}  // namespace lensforge
