// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/image/image.h"
#include "core/image/image_io.h"
#include "core/surface/lens.h"
#include "design/design_options.h"
#include "design/fringe.h"
#include "design/schedule/convergence.h"
#include "design/source_picture.h"

namespace lensforge {

struct DesignResult {
  enum class Status { kDone, kInterrupted };
  Status status = Status::kInterrupted;
  std::string message;            ///< Why it ended, in one line.
  std::uint64_t fingerprint = 0;  ///< design_identity() of picture and options.
  /// What the part will project that DesignOptions::made_by makes of the lens.
  struct Made {
    ImageMetrics metrics;
    Image picture;
  };
  std::optional<Made> made;
  std::optional<SourceCheck> source;  ///< Of an extended source.
  /// Of a spectrum.
  struct Colors {
    ColorImage picture;  ///< What the lens projects; white where all wavelengths do the target's.
    Fringe fringe;
  };
  std::optional<Colors> colors;
  Lens lens;  ///< The best surface so far, at the resolution that was reached.
  std::vector<ConvergenceRow> convergence;
};

/// Shapes a lens that projects `target` (linear light, any size, not all black).
/// Coarse to fine over picture and mesh (Sun et al., section 3.4 and Appendix E).
/// @throw InputError if an option breaks its rule, the picture is all black, or a checkpoint to
///        resume from is missing, corrupt, or belongs to another picture or other options;
///        RunError if a checkpoint cannot be written or a GPU's memory does not suffice;
///        Interrupted if it is stopped before its first surface: later it returns what it has.
DesignResult design_lens(const Image& target, const DesignOptions& options,
                         const Executor& executor, const RunControl& control);

/// A number that differs for pictures or options that give another result.
/// @pre validate(options, target) passes.
std::uint64_t design_identity(const Image& target, const DesignOptions& options);

}  // namespace lensforge
