// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace lensforge {

/// The GPU used for Device::kCuda: the first one.
struct Gpu {
  bool usable = false;
  std::string name;    ///< The maker's name for it.
  std::string reason;  ///< Why it is not usable, to follow a colon.
};

Gpu find_gpu();

}  // namespace lensforge
