// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "app/job_log.h"
#include "app/operator_view.h"

namespace lensforge::app {

/// A running job as JSON, one object a line that needs no other to be understood (--events). A
/// reader that does not keep up loses lines; the next one says how many. Stops nothing.
class JobEvents {
 public:
  /// @throw InputError if the file that --events names cannot be opened.
  JobEvents(const SendSettings& settings, Warn warn);

  void begin(const JobIdentity& job, const JobView& view);
  /// @param left  s
  void take(const SendEvent& event, double left);
  void end(const SendResult& result);

 private:
  void write(nlohmann::json object);

  Warn warn_;
  TextSink file_;
  JobIdentity job_;
  JobView view_;
  nlohmann::json last_;  ///< Where the job stood at the last event.
};

}  // namespace lensforge::app
