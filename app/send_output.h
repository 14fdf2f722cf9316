// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "app/send_settings.h"
#include "machine/stream/controller_info.h"
#include "machine/stream/preflight.h"
#include "machine/stream/program_facts.h"
#include "machine/stream/resume_plan.h"
#include "machine/stream/sender.h"

namespace lensforge::app {

/// All that a run of `lensforge send` found out.
struct SendSummary {
  JobIdentity job;
  std::optional<bool> seal_holds;  ///< machine/gcode/program_seal.h; nothing without a seal.
  ProgramFacts facts;
  std::optional<ControllerInfo> controller;
  Findings findings;
  std::optional<std::int64_t> checked_lines;  ///< By the controller itself.
  std::optional<ResumePlan> plan;
  std::optional<SendResult> result;
};

/// "done", "interrupted", "fault", or "checked" of a dry run.
std::string status_word(const SendSummary& summary);

/// "done", "interrupted" or "fault".
std::string status_word(SendStatus status);

/// Size, extent and time of a program, a line each.
std::string facts_text(const ProgramFacts& facts);

nlohmann::json send_json(const OptionSet& options, const SendSummary& summary);
std::string send_text(const SendSettings& settings, const SendSummary& summary);

}  // namespace lensforge::app
