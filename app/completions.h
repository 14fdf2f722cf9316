// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "core/text/option_field.h"

namespace lensforge::app {

/// One command with what can follow it on the command line.
struct CompletedCommand {
  std::string name;
  std::string summary;
  std::vector<OptionSpec> options;
};

/// The script by which a shell completes commands, options and their values.
/// @throw InputError unless the shell is bash, zsh or fish.
std::string completion_script(const std::string& shell,
                              const std::vector<CompletedCommand>& commands);

}  // namespace lensforge::app
