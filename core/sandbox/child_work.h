// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "core/compute/run_control.h"

namespace lensforge {

/// What a child process may use at most.
struct ChildLimits {
  double memory_bytes = 0.0;  ///< Beside what its parent has; 0 for as much as there is.
  double cpu_seconds = 0.0;   ///< Of all its threads together; 0 for no limit.
};

/// A child process ended without a result: what() says why in a clause, such as "crashed".
class ChildFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Runs `work` in a forked copy of this process and returns what it returns. Whatever happens to
/// the child, the caller goes on; the child's stdout and stderr lead nowhere. While it runs,
/// `control` is told `stage` and, of what the work reports to its own RunControl, how far it is.
/// @pre `work` uses no threads that the caller has started (oneTBB's are such), and no other thread
///      is inside of the library that it calls.
/// @throw InputError, RunError as the work throws them; ChildFailure if it crashes or exceeds the
///        limits; Interrupted, with the child killed, at most 0.1 s after the stop request.
std::string run_in_child(const std::string& stage, const ChildLimits& limits,
                         const std::function<std::string(const RunControl&)>& work,
                         const RunControl& control);

/// Takes the pieces of a large result, one after another.
using PieceSink = std::function<void(std::string_view)>;

/// Work that sends pieces before it returns the rest of its result.
using PiecewiseWork = std::function<std::string(const RunControl&, const PieceSink& send)>;

/// The same for a result that is too large to be kept twice: `take` gets every piece that the work
/// sends, in this process and in their order. @throw what `take` throws, with the child killed.
std::string run_in_child(const std::string& stage, const ChildLimits& limits,
                         const PiecewiseWork& work, const PieceSink& take,
                         const RunControl& control);

/// Lowers the limits of a process from within: for work that knows better than its caller how much
/// it may take. Memory counts beside what the process has now.
void limit_this_process(const ChildLimits& limits);

/// Calls `functor(i)` for i in 0 … count − 1 on `threads` threads of its own, which a child process
/// may do. The first exception reaches the caller.
void for_each_in_threads(int threads, std::int64_t count,
                         const std::function<void(std::int64_t)>& functor);

}  // namespace lensforge
