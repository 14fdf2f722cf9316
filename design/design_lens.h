// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/image/image.h"
#include "core/surface/lens.h"
#include "design/design_options.h"
#include "design/schedule/convergence.h"

namespace lensforge {

struct DesignResult {
  enum class Status { kDone, kInterrupted, kFailed };
  Status status = Status::kFailed;
  std::string message;            ///< Why it ended, in one line.
  std::uint64_t fingerprint = 0;  ///< design_identity() of picture and options.
  Lens lens;                      ///< The best surface so far, at the resolution that was reached.
  std::vector<ConvergenceRow> convergence;
};

/// Shapes a lens that projects `target` (linear light, any size, not all black).
/// Coarse to fine over picture and mesh (Sun et al., section 3.4 and Appendix E).
/// @throw InputError if an option breaks its rule, the picture is all black, or a checkpoint to
///        resume from is missing, corrupt, or belongs to another picture or other options.
DesignResult design_lens(const Image& target, const DesignOptions& options,
                         const Executor& executor, const RunControl& control);

/// A number that differs for pictures or options that give another result.
/// @pre validate(options, target) passes.
std::uint64_t design_identity(const Image& target, const DesignOptions& options);

}  // namespace lensforge
