// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <string>
#include <thread>

#include "core/io/files.h"
#include "machine/sim/sim_firmware.h"

namespace lensforge {

/// A simulated controller behind a pseudo-terminal, which any sender can use like a serial port. It
/// runs on its own thread, in real time or a multiple of it.
class PtyController {
 public:
  /// @param speed  simulated seconds in a second.
  /// @throw RunError if the system gives no pseudo-terminal.
  explicit PtyController(const SimulatedOptions& options, double speed = 1.0,
                         const MachineWatch& watch = {});
  ~PtyController();
  PtyController(const PtyController&) = delete;
  PtyController& operator=(const PtyController&) = delete;

  /// The device that a sender opens.
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  void serve(const SimulatedOptions& options, double speed, const MachineWatch& watch);

  Descriptor master_;
  Descriptor slave_;  ///< Kept open: a sender may close and reopen it.
  std::string path_;
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

}  // namespace lensforge
