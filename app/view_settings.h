// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "app/option_set.h"

namespace lensforge::app {

/// What `lensforge view` was asked for.
struct ViewSettings {
  std::string source;
  std::string out;
  bool force = false;
};

/// Adds every option of the command.
void add_view_options(OptionSet& options, ViewSettings& settings);

}  // namespace lensforge::app
