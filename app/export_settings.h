// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "app/option_set.h"
#include "export/export_options.h"

namespace lensforge::app {

/// What `lensforge export` was asked for.
struct ExportSettings {
  std::string source;
  std::string out;
  ExportOptions options;
};

/// Adds every option of the command.
void add_export_options(OptionSet& options, ExportSettings& settings);

}  // namespace lensforge::app
