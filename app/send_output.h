// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "app/send_settings.h"
#include "machine/job/send_job.h"

namespace lensforge::app {

/// "done", "interrupted", "fault", or "checked" of a dry run.
std::string status_word(const SendSummary& summary);

/// "done", "interrupted" or "fault".
std::string status_word(SendStatus status);

/// Size, extent and time of a program, a line each.
std::string facts_text(const ProgramFacts& facts);

nlohmann::json send_json(const OptionSet& options, const SendSummary& summary);
std::string send_text(const SendSettings& settings, const SendSummary& summary);

}  // namespace lensforge::app
