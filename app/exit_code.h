// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge::app {

/// What the command returns to the shell (docs/interface.md, "Exit codes").
enum ExitCode : int {
  kDone = 0,
  kFailed = 1,         ///< It failed while running.
  kBadInput = 2,       ///< Bad usage or bad input.
  kLimitMissed = 3,    ///< Done, but a stated quality or safety limit was not met.
  kInterrupted = 130,  ///< Interrupted, everything done so far kept.
};

}  // namespace lensforge::app
