// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/option_set.h"
#include "machine/gcode/gcode_dialect.h"
#include "machine/guard/register_map.h"
#include "machine/guard/spindle_guard.h"
#include "machine/link/port_spec.h"
#include "machine/stream/resume_plan.h"
#include "machine/stream/sender.h"

namespace lensforge::app {

/// What `lensforge send` was asked for.
struct SendSettings {
  std::string file;
  std::string port;
  std::string dialect = "grbl";
  std::string journal;     ///< FILE.journal if empty.
  std::string log;         ///< FILE.log if empty.
  std::string events;      ///< JSON lines go here; none if empty.
  std::string spindle;     ///< MAP[@PLACE]; empty for none.
  std::string interlocks;  ///< MAP[@PLACE] of a device without a spindle; empty for none.
  SpindleOwner owner = SpindleOwner::kHost;
  bool dry_run = false;
  bool resume = false;
  bool restart = false;
  bool yes = false;
  bool allow_changed = false;  ///< Send a program whose seal does not hold.
  bool home = false;
  int margin = 20;
  double spin_up = 5.0;  ///< s, for the estimate of the time.
  ResumeOptions entry;
  SenderOptions sender;

  [[nodiscard]] std::filesystem::path journal_path() const {
    return journal.empty() ? std::filesystem::path(file + ".journal")
                           : std::filesystem::path(journal);
  }
  [[nodiscard]] std::filesystem::path log_path() const {
    return log.empty() ? std::filesystem::path(file + ".log") : std::filesystem::path(log);
  }
};

/// Adds every option of the command.
void add_send_options(OptionSet& options, SendSettings& settings);

/// @throw InputError for options that exclude each other or are missing.
void require_consistent(const SendSettings& settings, bool json);

/// The register maps that --spindle and --interlocks name, with their places. @throw InputError
std::vector<RegisterMap> register_maps(const SendSettings& settings);

}  // namespace lensforge::app
