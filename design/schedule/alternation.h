// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "design/schedule/checkpoint.h"
#include "design/schedule/design_log.h"
#include "design/schedule/design_task.h"
#include "design/schedule/round.h"

namespace lensforge {

/// The state that a design begins with: a flat surface, or what its checkpoint holds.
/// @throw InputError if a checkpoint to resume from is missing, corrupt, or belongs to another
///        picture or other options.
Checkpoint first_state(const DesignTask& task);

/// Does all levels that are left, coarse to fine, round by round (Sun et al., section 3.4 and
/// Appendix E), and writes the state after each. @return false if it was asked to stop.
/// @throw InputError as run_round() does.
bool run_levels(const DesignTask& task, DesignLog& log, Checkpoint& state);

}  // namespace lensforge
