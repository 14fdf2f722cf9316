// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/compute/host_device.h"

/// One entry of the vector operations of a minimiser.
namespace lensforge {

/// Entries that one task of a vector operation handles.
inline constexpr std::int64_t kVectorGrain = 16384;

/// y ← x + a d
struct StepEntry {
  const double* x;
  double a;
  const double* d;
  double* y;
  LF_HD void operator()(std::int64_t i) const { y[i] = a * d[i] + x[i]; }
};

/// y ← a − b
template <class T>
struct DifferenceEntry {
  const double* a;
  const double* b;
  T* y;
  LF_HD void operator()(std::int64_t i) const { y[i] = static_cast<T>(a[i] - b[i]); }
};

/// x ← a x
struct ScaleEntry {
  double a;
  double* x;
  LF_HD void operator()(std::int64_t i) const { x[i] *= a; }
};

/// Vectors that one pass over memory handles together.
inline constexpr std::size_t kVectorGroup = 4;
using VectorGroup = std::array<const float*, kVectorGroup>;

/// Products of each vector of a group with v.
template <class T>
struct GroupProducts {
  VectorGroup group;
  const T* v;
  LF_HD std::array<double, kVectorGroup> operator()(std::int64_t i) const {
    const double factor = v[i];
    std::array<double, kVectorGroup> items;
    for (std::size_t k = 0; k < kVectorGroup; ++k) items[k] = factor * group[k][i];
    return items;
  }
};

/// s·y, s·s and y·y.
struct CurvatureEntry {
  const float* s;
  const float* y;
  LF_HD std::array<double, 3> operator()(std::int64_t i) const {
    const double step = s[i];
    const double change = y[i];
    return {step * change, step * step, change * change};
  }
};

/// y ← x + Σ a v over a group.
struct AddGroup {
  VectorGroup group;
  std::array<double, kVectorGroup> a;
  const double* x;
  double* y;
  LF_HD void operator()(std::int64_t i) const {
    double sum = x[i];
    for (std::size_t k = 0; k < kVectorGroup; ++k) sum += a[k] * group[k][i];
    y[i] = sum;
  }
};

}  // namespace lensforge
