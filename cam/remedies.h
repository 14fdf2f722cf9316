// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "cam/trial_cut.h"

namespace lensforge {

/// Tries at every place what may help against its main cause, and against the next one if that
/// does not halve the leak, and notes in LeakPlace::trials what would leak then. Against creases:
/// smaller balls, one after the other until the leak is halved, three at most; against scallops
/// half the pitch; against chords half the tolerances; against decimals one more; against polishing
/// half of it, then half of it and half the pitch. Everything else stays as it is.
/// @throw Interrupted
void try_remedies(const TrialSite& site, std::vector<LeakPlace>& places, const Executor& executor,
                  const RunControl& control);

}  // namespace lensforge
