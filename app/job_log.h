// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>

#include "app/option_set.h"
#include "app/send_output.h"
#include "app/send_settings.h"
#include "app/text_sink.h"

namespace lensforge::app {

/// Where a trouble with a file beside the job is said.
using Warn = std::function<void(const std::string&)>;

/// What happened to a job, in words for whoever looks into it later: one line each with a time
/// stamp (UTC), appended. A log that cannot be written is a warning and stops nothing.
class JobLog {
 public:
  /// @throw InputError if a file that --log names cannot be opened.
  JobLog(const SendSettings& settings, Warn warn);

  /// Version, options, file and hash.
  void begin(const OptionSet& options, const JobIdentity& job);
  /// Who the controller is, and those of its settings that decide what it does with the program.
  void controller(const ControllerInfo& info);
  void preflight(const ProgramFacts& facts, const Findings& findings);
  void resume(const ResumePlan& plan);
  /// What an event says, and where the job stands once a minute.
  void take(const SendEvent& event);
  void end(const SendResult& result);
  void line(const std::string& text);

 private:
  Warn warn_;
  TextSink file_;
  double next_standing_ = 0.0;
};

}  // namespace lensforge::app
