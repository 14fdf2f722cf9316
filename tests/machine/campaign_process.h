// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>

#include "machine/link/link.h"
#include "machine/sim/simulated_machine.h"

namespace lensforge::campaign {

/// Runs `job` in a process of its own, with a link and a clock that lead to `machine` here, and
/// kills it (SIGKILL) once it has handed over `bytes` bytes, in the middle of a line or not.
/// @return whether it was killed; false if it ended by itself before.
bool run_and_kill(SimulatedMachine& machine, std::size_t bytes,
                  const std::function<void(Link&, Clock&)>& job);

}  // namespace lensforge::campaign
