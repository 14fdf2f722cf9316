// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "app/frame/command_run.h"
#include "app/frame/option_set.h"
#include "export/export.h"

namespace lensforge::app {

/// Options of `lensforge export`.
struct ExportSettings {
  std::string source;
  std::string out;
  ExportSurface surface = ExportSurface::kDesigned;
  ExportOptions options;
};

/// Describes every option of the command.
void describe(Description& d, ExportSettings& settings);

/// @throw InputError naming an option that was given but does not apply to the format.
void require_fitting_options(const OptionSet& options, const ExportFormat& format);

/// What was written, without the file itself.
CommandResult export_report(const ExportResult& result);

}  // namespace lensforge::app
