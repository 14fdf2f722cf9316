// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/compute/executor.h"

namespace lensforge {

Gpu find_gpu() { return {false, "", "this build has no CUDA"}; }

}  // namespace lensforge
