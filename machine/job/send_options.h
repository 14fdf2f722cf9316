// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "machine/guard/register_map.h"
#include "machine/guard/spindle_guard.h"
#include "machine/stream/resume_plan.h"
#include "machine/stream/sender.h"

namespace lensforge {

class Description;

/// Options for sending a program to a machine.
struct SendOptions {
  std::string port;              ///< For parse_port_spec(); empty only for a dry run.
  std::string dialect = "grbl";  ///< Dialect for a dry run without a port.
  bool home = false;             ///< Home the machine first.
  bool dry_run = false;          ///< Check only.
  bool allow_changed = false;    ///< Send a program whose seal does not hold.
  std::string spindle;           ///< MAP[@PLACE]; empty for none.
  SpindleOwner owner = SpindleOwner::kHost;
  std::string interlocks;  ///< MAP[@PLACE] of a device without a spindle; empty for none.
  /// Only the operator switches the spindle: cuts need no M3.
  bool spindle_by_hand = false;
  double spin_up = 5.0;  ///< Time per spindle change, for the time estimate, s.
  std::string journal;   ///< File; if empty, the program's name with ".journal".
  bool resume = false;   ///< Resume after a fault.
  bool restart = false;  ///< Start again despite an unfinished journal.
  ResumeOptions entry;
  SenderOptions sender;

  [[nodiscard]] std::filesystem::path journal_of(const std::filesystem::path& program) const {
    return journal.empty() ? std::filesystem::path(program.string() + ".journal")
                           : std::filesystem::path(journal);
  }
};

/// Every option of a job.
void describe(Description& d, SendOptions& o);

/// @throw InputError for an option that breaks its rule, and for those that exclude each other or
///        are missing.
void validate(const SendOptions& options);

/// The register maps named by `spindle` and `interlocks`, with their endpoints. @throw InputError
std::vector<RegisterMap> register_maps(const SendOptions& options);

}  // namespace lensforge
