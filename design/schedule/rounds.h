// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/mesh/surface_mesh.h"
#include "design/schedule/checkpoint.h"
#include "design/schedule/guided_optimization.h"
#include "design/schedule/levels.h"

namespace lensforge {

/// Maximum number of faces of the even mesh whose transport shapes the mesh. On the 512² logo
/// 942,080 sites were not done after 11 processor minutes, 235,520 took at most 80 s.
inline constexpr double kMaxEvenFaces = 250'000.0;
/// The same for pictures with much black, which hold up a transport of many sites and gain nothing
/// from it: the 256² logo as a spline ends at 0.0035 after 92 processor seconds with 250,000 faces,
/// at 0.0030 after 57 with these; a photograph at 0.0030 after 40 and 55.
inline constexpr double kMaxDarkFaces = 60'000.0;

/// A level while its rounds run.
struct LevelSite {
  const DesignTask& task;
  const Level& level;
  const LevelProblem& problem;
  GuidedOptimization& stage;  ///< Rendering-guided.
  DesignLog& log;
};

/// One alternation of Sun et al., section 3.4: transport_step() if it is due (never for a spline),
/// then rendering-guided optimisation, then conclude_round(). If it is stopped in between, the
/// state holds the best surface so far and the same round number.
/// @return false if it was asked to stop.
/// @throw Interrupted; InputError if no surface can send the light so far over so short a distance,
///        or no surface to start from is allowed.
bool run_round(const LevelSite& site, Checkpoint& state);

/// A round that lowers the objective by less than this share counts as idle.
inline constexpr double kIdleRound = 1e-3;

/// Result of a round's two halves.
struct RoundOutcome {
  const SurfaceMesh& before;
  double value = 0.0;        ///< Objective of the state's mesh.
  bool transported = false;  ///< It began with transport.
  bool rescaled = false;     ///< Its steps were measured anew, or never will be.
  bool enough = false;       ///< Its picture is good enough (Finish).
  /// Share by which it must lower the objective.
  double idle = kIdleRound;
};

/// Keeps a round's mesh or the one before, whichever is better, and decides what is next. A round
/// that lowers the objective by less than it must has failed: if it began with transport, the
/// level's further rounds do without; if its steps were scaled for an earlier surface, the next one
/// measures them anew; if neither, the level ends, as it does when its picture is good enough.
/// @param rounds  number of rounds of the level.
void conclude_round(const RoundOutcome& outcome, int rounds, Checkpoint& state);

/// Returns the state in the checkpoint of a task that is resumed.
/// @throw InputError if it is missing, corrupt, or belongs to another picture or other options.
Checkpoint saved_state(const DesignTask& task);

/// Writes the state, with the time that the log has counted, if the task has a checkpoint.
/// @throw RunError if it cannot be written.
void save_state(const DesignTask& task, const DesignLog& log, Checkpoint& state);

/// Returns the state that a design starts from: a flat surface, or saved_state().
/// @throw InputError as saved_state() does.
Checkpoint first_state(const DesignTask& task);

/// Runs the remaining levels, coarse to fine, round by round (Sun et al., section 3.4 and Appendix
/// E), and writes the state after each round. @return false if it was asked to stop.
/// @throw InputError as run_round() does.
bool run_levels(const DesignTask& task, DesignLog& log, Checkpoint& state);

}  // namespace lensforge
