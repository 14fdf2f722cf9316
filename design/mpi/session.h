// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

namespace lensforge {

/// Number of processes that share the work: those that mpirun has started together, inside
/// run_on_ranks(); else 1.
int rank_count();

/// Number of them that share this machine's memory.
int ranks_here();

/// Runs `first` in one process. If mpirun has started several, rank 0 runs it and handles signals;
/// the others do their parts of its stages (Device::kRanks) until it returns.
/// @return the result of `first`; on the other ranks 0.
int run_on_ranks(const std::function<int()>& first);

/// Works on rank 0's stages until dismiss_ranks(). @pre not rank 0.
void serve_rank();

/// Ends the others' serve_rank(). @pre rank 0; no stage on ranks lives.
void dismiss_ranks();

}  // namespace lensforge
