// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/mpi/session.h"

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <initializer_list>

#include "design/mpi/rank_stage.h"
#include "design/mpi/ranks.h"

namespace lensforge {

namespace {

/// The number that a variable holds, 0 where there is none.
int number_in(const char* variable) {
  const char* const text = std::getenv(variable);
  return text != nullptr ? std::atoi(text) : 0;
}

/// The first of these variables that is set.
int first_of(std::initializer_list<const char*> variables) {
  for (const char* variable : variables) {
    if (const int number = number_in(variable); number > 0) return number;
  }
  return 0;
}

/// What starts processes tells them their number, each in its own way: Open MPI, then MPICH's and
/// Slurm's PMI, then Slurm with PMIx.
int started_together() {
  if (const int number = first_of({"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"}); number > 0) return number;
  if (std::getenv("PMIX_RANK") == nullptr) return 1;
  return std::max(1, number_in("SLURM_STEP_NUM_TASKS"));
}

}  // namespace

int rank_count() { return MpiSession::lives() ? Ranks::world().count() : 1; }

int ranks_here() {
  if (rank_count() == 1) return 1;
  const int here = first_of({"OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS"});
  return here > 0 ? here : rank_count();
}

int run_on_ranks(const std::function<int()>& first) {
  if (started_together() == 1) return first();
  const MpiSession session;
  if (!Ranks::world().is_first()) {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_IGN);
    serve_rank();
    return 0;
  }
  const int outcome = first();
  dismiss_ranks();
  return outcome;
}

}  // namespace lensforge
