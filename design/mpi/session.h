// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

namespace lensforge {

/// Processes that share the work: those that mpirun has started together, inside of
/// run_on_ranks(); else 1.
int rank_count();

/// Those of them that share this machine's memory.
int ranks_here();

/// Runs `first` in one process. Of several that mpirun has started, rank 0 runs it, and the others
/// do their parts of its stages (Device::kRanks) until it returns; signals are rank 0's to heed.
/// @return what `first` returns, on the other ranks 0.
int run_on_ranks(const std::function<int()>& first);

/// Does the parts of rank 0's stages until dismiss_ranks(). @pre not rank 0.
void serve_rank();

/// Lets the others' serve_rank() end. @pre rank 0; no stage on ranks lives.
void dismiss_ranks();

}  // namespace lensforge
