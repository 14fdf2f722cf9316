// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "export/export.h"

namespace lensforge::app {

/// What an export says of what it wrote, for programs and for people.
struct ExportReport {
  nlohmann::json json;
  std::string text;
};

ExportReport export_report(const ExportResult& result);

}  // namespace lensforge::app
