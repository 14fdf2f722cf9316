// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/flux/lanes.h"

namespace lensforge {

Lanes widest_lanes() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") != 0) return Lanes::kFour;
#endif
  return Lanes::kTwo;
}

}  // namespace lensforge
