// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "machine/sim/simulated_machine.h"
#include "machine/stream/controller_dialogue.h"

/// Faults at random bytes of jobs on the simulated controller, each followed by a resume.
namespace lensforge::campaign {

/// Faults: the simulated controller's own and those around it.
enum class Mishap {
  kUnplug,
  kUnplugReset,
  kReset,
  kAlarm,
  kError,
  kLostReply,
  kGarbledReply,
  kDuplicatedOk,
  kStall,
  kRxOverrun,
  kPartialWrite,
  kDoor,
  kHold,
  kBusSilent,     ///< The spindle's drive no longer answers on Modbus.
  kSpindleStall,  ///< Its shaft stands still.
  kKilled,        ///< SIGKILL to the process of the sender.
  kDiskFull,      ///< For the journal.
};
constexpr int kMishaps = 17;

std::string mishap_name(Mishap mishap);

/// One run: everything follows from these.
struct Case {
  Mishap mishap = Mishap::kUnplug;
  bool hal = false;       ///< grblHAL instead of Grbl.
  bool counting = false;  ///< Character counting instead of send-response.
  bool numbered = true;   ///< The controller reports Ln:.
  std::uint64_t seed = 0;
};

/// Outcome of a run.
struct Outcome {
  bool struck = false;                 ///< The mishap came to pass before the job's end.
  bool finished_at_once = false;       ///< The job came to its end in spite of it.
  StopCause cause = StopCause::kNone;  ///< The sender's stop cause; kNone if it was killed.
  bool resumed = false;                ///< A second run took it to its end.
  /// Bytes lost on their way to the controller glued two lines into one that it took for good: Grbl
  /// has no check sum that could tell.
  bool spoilt = false;
  std::int64_t overlap = 0;             ///< Lines that were carried out twice.
  std::vector<std::string> violations;  ///< Invariants that were broken.
};

/// Runs a case in `folder`, which must be empty and stays so.
Outcome run_case(const Case& what, const std::filesystem::path& folder);

/// The i-th of a campaign: mishaps, dialects and modes in turn, a seed of its own each.
Case case_of(std::uint64_t index);

}  // namespace lensforge::campaign
