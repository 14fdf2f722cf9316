// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "app/frame/option_set.h"
#include "machine/send.h"

namespace lensforge::app {

/// Options of `lensforge send`.
struct SendSettings {
  std::string file;
  std::string log;     ///< FILE.log if empty.
  std::string events;  ///< Destination of the JSON lines; none if empty.
  bool yes = false;    ///< Do not ask before resuming.
  bool keys = false;   ///< Take keys from standard input even if it is no terminal.
  SendOptions job;

  [[nodiscard]] bool has_log() const { return !job.dry_run || !log.empty(); }
  [[nodiscard]] std::filesystem::path log_path() const {
    return log.empty() ? std::filesystem::path(file + ".log") : std::filesystem::path(log);
  }
};

/// Describes every option of the command.
void describe(Description& d, SendSettings& settings);

/// "done", "interrupted" or "fault".
std::string status_word(SendStatus status);

/// Size, extent and run time of a program, one line each.
std::string facts_text(const ProgramFacts& facts);

}  // namespace lensforge::app
