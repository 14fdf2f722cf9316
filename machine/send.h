// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "machine/guard/register_map.h"
#include "machine/stream/controller_dialogue.h"
#include "machine/stream/program_facts.h"
#include "machine/stream/resume_plan.h"
#include "machine/stream/sender.h"

namespace lensforge {

class Description;

/// Options for sending a program to a machine.
struct SendOptions {
  /// For parse_port_spec(); "sim:grbl" and "sim:grblhal" are simulated mills. Empty only for a dry
  /// run.
  std::string port;
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

/// A file that is written during a job.
struct NamedFile {
  std::string option;  ///< The option that names it.
  std::filesystem::path path;
};

/// Results of a job.
struct SendSummary {
  JobIdentity job;
  std::optional<bool> seal_holds;  ///< machine/gcode/program_seal.h; empty without a seal.
  ProgramFacts facts;
  std::optional<ControllerInfo> controller;
  Findings findings;
  std::optional<std::int64_t> checked_lines;  ///< By the controller itself.
  std::optional<ResumePlan> plan;
  std::optional<SendResult> result;
};

/// Observer of a job. Its functions are called in the order listed; each does nothing by default.
class JobWatcher {
 public:
  JobWatcher() = default;
  virtual ~JobWatcher() = default;
  JobWatcher(const JobWatcher&) = delete;
  JobWatcher& operator=(const JobWatcher&) = delete;

  /// Files that the watcher writes while the job runs; none may be one of the job's own.
  [[nodiscard]] virtual std::vector<NamedFile> files() const { return {}; }
  /// The program can be read; nothing was written yet.
  virtual void opened(const JobIdentity& /*program*/) {}
  virtual void warned(const std::string& /*text*/) {}
  /// Progress of a pass over the program, and its end.
  virtual void passing(const Progress& /*progress*/) {}
  virtual void passed() {}
  virtual void connected(const ControllerInfo& /*controller*/) {}
  /// Result of checking the program against the controller; refusals end the job.
  virtual void examined(const ProgramFacts& /*facts*/, const Findings& /*findings*/) {}
  /// Called before the machine moves to resume. @throw InputError to refuse
  virtual void confirm(const JournalRecord& /*before*/, const ResumePlan& /*plan*/) {}
  virtual void resumed(const ResumePlan& /*plan*/) {}
  /// The first line is about to leave. @param first_byte  where this run begins in the file.
  virtual void began(const SendSummary& /*so_far*/, std::int64_t /*first_byte*/) {}
  virtual void took(const SendEvent& /*event*/) {}
  virtual std::optional<OperatorKey> key() { return std::nullopt; }
  virtual void ended(const SendResult& /*result*/) {}
};

/// Sends a program to a machine: its seal, its limits and the controller's are checked first, its
/// spindle and interlocks are watched, and a journal records its progress.
/// @param stop, reset  SendControl's.
/// @throw InputError for unsuitable options, files and programs; StreamFault; LinkLost;
///        Interrupted. In all these cases nothing of the program was sent.
SendSummary send_job(const std::filesystem::path& program, const SendOptions& options,
                     JobWatcher& watcher, const std::stop_token& stop = {},
                     const std::stop_token& reset = {});

}  // namespace lensforge
