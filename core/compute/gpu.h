// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace lensforge {

/// The GPU that Device::kCuda stands for: the first one.
struct Gpu {
  bool usable = false;
  std::string name;    ///< As its maker calls it.
  std::string reason;  ///< Why it is not usable, to be read after a colon.
};

Gpu find_gpu();

}  // namespace lensforge
