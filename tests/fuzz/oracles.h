// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "fuzz/child.h"
#include "fuzz/sandbox.h"
#include "fuzz/scene.h"

/// Conditions that must hold after any run, whatever the input.
namespace lensforge::fuzz {

/// Faults of a command's end and output, one line each.
std::vector<std::string> wrong_endings(const Plan& plan, const Command& command,
                                       const Ending& ending);

/// Faults of the files that it left, one line each.
std::vector<std::string> wrong_files(const Plan& plan, const std::vector<Ending>& endings,
                                     const Snapshot& before, const Snapshot& after);

}  // namespace lensforge::fuzz
