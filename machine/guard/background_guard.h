// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "machine/guard/spindle_guard.h"

namespace lensforge {

/// Runs a SpindleGuard on its own thread; a sender never waits for the bus. poll() returns the
/// newest report. Failures and open interlocks that lasted only between two polls appear in at
/// least one report. A report older than the limit counts as kFailed.
class BackgroundGuard final : public Guard {
 public:
  /// @param stale_limit  seconds without a new report after which poll() returns kFailed; see
  /// stale_limit_of().
  BackgroundGuard(std::unique_ptr<SpindleGuard> guard, double stale_limit);
  /// Tries to deliver a pending command, for at most the stale limit.
  ~BackgroundGuard() override;
  BackgroundGuard(const BackgroundGuard&) = delete;
  BackgroundGuard& operator=(const BackgroundGuard&) = delete;

  void spin(double rpm, bool clockwise) override;
  void stop() override;
  GuardReport poll() override;
  std::vector<GuardRecord> take_records() override;

 private:
  using Command = std::function<void(SpindleGuard&)>;

  void run();
  void ask(Command command);
  void publish(const GuardReport& report, bool obeyed);

  std::unique_ptr<SpindleGuard> guard_;  ///< Used by the thread only.
  double stale_limit_;
  std::mutex mutex_;  ///< Guards the members below.
  std::condition_variable wake_;
  Command command_;
  bool answered_ = true;  ///< newest_ was made after the last command.
  bool ends_ = false;
  GuardReport newest_;
  double published_at_;
  std::string failure_unseen_;    ///< From a report that no poll() returned.
  std::string interlock_unseen_;  ///< From a report that no poll() returned.
  std::vector<GuardRecord> records_;
  std::thread thread_;
};

/// Returns the age in seconds at which a report counts as stale: the longest silence allowed to any
/// device, plus one connection and one exchange time-out per device.
double stale_limit_of(const std::vector<RegisterMap>& maps);

/// Creates a guard of real devices, one per map, over ModbusBus and on its own thread; it connects
/// in the background.
/// @param clock  a steady clock; must outlive the guard. @throw InputError as SpindleGuard does.
std::unique_ptr<BackgroundGuard> guard_devices(const std::vector<RegisterMap>& maps,
                                               const GuardOptions& options, Clock& clock);

}  // namespace lensforge
