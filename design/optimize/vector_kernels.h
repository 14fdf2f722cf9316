// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "core/compute/host_device.h"

/// One entry of the vector operations of a minimiser.
namespace lensforge {

/// Entries that one task of a vector operation handles.
inline constexpr std::int64_t kVectorGrain = 16384;

/// y ← y + a x
struct AddMultiple {
  double a;
  const double* x;
  double* y;
  LF_HD void operator()(std::int64_t i) const { y[i] = a * x[i] + y[i]; }
};

/// y ← x + a d
struct StepEntry {
  const double* x;
  double a;
  const double* d;
  double* y;
  LF_HD void operator()(std::int64_t i) const { y[i] = a * d[i] + x[i]; }
};

/// y ← a − b
struct DifferenceEntry {
  const double* a;
  const double* b;
  double* y;
  LF_HD void operator()(std::int64_t i) const { y[i] = a[i] - b[i]; }
};

/// x ← a x
struct ScaleEntry {
  double a;
  double* x;
  LF_HD void operator()(std::int64_t i) const { x[i] *= a; }
};

/// y ← x
struct CopyEntry {
  const double* x;
  double* y;
  LF_HD void operator()(std::int64_t i) const { y[i] = x[i]; }
};

}  // namespace lensforge
