// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "core/compute/executor.h"

namespace lensforge {

/// Limits of a child process.
struct ChildLimits {
  double memory_bytes = 0.0;  ///< In addition to its parent's; 0 for no limit.
  double cpu_seconds = 0.0;   ///< All its threads together; 0 for no limit.
};

/// A child process ended without a result: what() says why in a clause, such as "crashed".
class ChildFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Runs `work` in a forked copy of this process and returns what it returns. The caller survives
/// whatever happens to the child; the child's stdout and stderr are discarded. While it runs,
/// `control` gets `stage` and the progress that the work reports to its own RunControl.
/// @pre `work` uses no threads started by the caller (such as oneTBB's), and no other thread is
///      inside the library that it calls.
/// @throw InputError, RunError thrown by the work; ChildFailure if it crashes or exceeds the
///        limits; Interrupted, with the child killed, at most 0.1 s after the stop request.
std::string run_in_child(const std::string& stage, const ChildLimits& limits,
                         const std::function<std::string(const RunControl&)>& work,
                         const RunControl& control);

/// Receives the pieces of a large result, one after another.
using PieceSink = std::function<void(std::string_view)>;

/// Work that sends pieces before it returns the rest of its result.
using PiecewiseWork = std::function<std::string(const RunControl&, const PieceSink& send)>;

/// The same for a result too large to hold twice: `take` gets every piece that the work sends, in
/// this process and in order. @throw what `take` throws, with the child killed.
std::string run_in_child(const std::string& stage, const ChildLimits& limits,
                         const PiecewiseWork& work, const PieceSink& take,
                         const RunControl& control);

/// Lowers the limits of this process, for work that knows its needs better than its caller. Memory
/// is counted in addition to the present use.
void limit_this_process(const ChildLimits& limits);

/// Calls `functor(i)` for i in 0 … count − 1 on `threads` new threads, which a child process may
/// do. The first exception reaches the caller.
void for_each_in_threads(int threads, std::int64_t count,
                         const std::function<void(std::int64_t)>& functor);

}  // namespace lensforge
