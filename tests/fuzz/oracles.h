// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "fuzz/child.h"
#include "fuzz/sandbox.h"
#include "fuzz/scene.h"

/// What has to hold after any run, whatever the input.
namespace lensforge::fuzz {

/// What is wrong with how a command ended and what it said; one line each.
std::vector<std::string> wrong_endings(const Plan& plan, const Command& command,
                                       const Ending& ending);

/// What is wrong with the files that it left; one line each.
std::vector<std::string> wrong_files(const Plan& plan, const std::vector<Ending>& endings,
                                     const Snapshot& before, const Snapshot& after);

}  // namespace lensforge::fuzz
