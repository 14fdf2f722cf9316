// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/mesh/surface_mesh.h"
#include "design/schedule/checkpoint.h"
#include "design/schedule/guided_optimization.h"
#include "design/schedule/levels.h"

namespace lensforge {

/// Faces at most of the even mesh whose transport shapes the mesh: a finer one is not worth it. On
/// the 512² logo, 942,080 sites were not done after 11 processor minutes, 235,520 in 80 s at most.
inline constexpr double kMaxEvenFaces = 250'000.0;

/// One level at work.
struct LevelSite {
  const DesignTask& task;
  const Level& level;
  const LevelProblem& problem;
  GuidedOptimization& stage;  ///< Rendering-guided.
  DesignLog& log;
};

/// One alternation of Sun et al., section 3.4: transport_step() where it is due (never of a
/// spline), then rendering-guided optimisation, then conclude_round(). Where it is stopped on the
/// way, the state holds the best surface so far and names the same round.
/// @return false if it was asked to stop.
/// @throw Interrupted; InputError if no surface can send the light so far in so short a distance,
///        or none can be begun with.
bool run_round(const LevelSite& site, Checkpoint& state);

/// What came of a round's two halves.
struct RoundOutcome {
  const SurfaceMesh& before;
  double value = 0.0;        ///< Objective of the state's mesh.
  bool transported = false;  ///< It began with transport.
  bool rescaled = false;     ///< Its steps were measured anew.
};

/// Takes a round's mesh or the one before, whichever is better, and says what is next. A round that
/// lowers the objective by less than a thousandth has brought nothing: if it began with transport,
/// the level's further rounds do without; if its steps were scaled for an earlier surface, the next
/// one measures them anew; if neither, the level ends.
/// @param rounds  of a level.
void conclude_round(const RoundOutcome& outcome, int rounds, Checkpoint& state);

/// The state that a design begins with: a flat surface, or what its checkpoint holds.
/// @throw InputError if a checkpoint to resume from is missing, corrupt, or belongs to another
///        picture or other options.
Checkpoint first_state(const DesignTask& task);

/// Does all levels that are left, coarse to fine, round by round (Sun et al., section 3.4 and
/// Appendix E), and writes the state after each. @return false if it was asked to stop.
/// @throw InputError as run_round() does.
bool run_levels(const DesignTask& task, DesignLog& log, Checkpoint& state);

}  // namespace lensforge
