// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/text/option_field.h"
#include "machine/guard/register_map.h"
#include "machine/guard/spindle_guard.h"
#include "machine/stream/resume_plan.h"
#include "machine/stream/sender.h"

namespace lensforge {

/// How a program is sent to a machine.
struct SendOptions {
  std::string port;              ///< As parse_port_spec() reads it; empty for a dry run alone.
  std::string dialect = "grbl";  ///< What a dry run without port checks for.
  bool home = false;             ///< Home the machine first.
  bool dry_run = false;          ///< Check only.
  bool allow_changed = false;    ///< Send a program whose seal does not hold.
  std::string spindle;           ///< MAP[@PLACE]; empty for none.
  SpindleOwner owner = SpindleOwner::kHost;
  std::string interlocks;  ///< MAP[@PLACE] of a device without a spindle; empty for none.
  /// Nothing but the operator switches the spindle: cuts need no M3.
  bool spindle_by_hand = false;
  double spin_up = 5.0;  ///< Of every spindle change, for the estimate of the time, s.
  std::string journal;   ///< File; the program's with ".journal" if empty.
  bool resume = false;   ///< Go on after a fault.
  bool restart = false;  ///< Begin again in spite of an unfinished journal.
  ResumeOptions entry;
  SenderOptions sender;

  [[nodiscard]] std::filesystem::path journal_of(const std::filesystem::path& program) const {
    return journal.empty() ? std::filesystem::path(program.string() + ".journal")
                           : std::filesystem::path(journal);
  }
};

/// Every option of a job.
const OptionTable<SendOptions>& send_fields();

/// @throw InputError for an option that breaks its rule, and for those that exclude each other or
///        are missing.
void validate(const SendOptions& options);

/// The register maps that `spindle` and `interlocks` name, with their places. @throw InputError
std::vector<RegisterMap> register_maps(const SendOptions& options);

}  // namespace lensforge
