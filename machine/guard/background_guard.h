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

/// Runs a SpindleGuard on a thread of its own, so that no call of a sender ever waits for the bus:
/// poll() hands over the newest report. What lasted only between two polls is not lost: a failure
/// or an open interlock stands in one report at least. A report that is older than the limit is
/// kFailed, whatever it says.
class BackgroundGuard final : public Guard {
 public:
  /// @param stale_limit  s without a new report after which poll() gives kFailed; see
  /// stale_limit_of().
  BackgroundGuard(std::unique_ptr<SpindleGuard> guard, double stale_limit);
  /// Delivers a command that was not taken yet, for at most the stale limit.
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

  std::unique_ptr<SpindleGuard> guard_;  ///< Of the thread alone.
  double stale_limit_;
  std::mutex mutex_;  ///< Guards what follows.
  std::condition_variable wake_;
  Command command_;
  bool answered_ = true;  ///< newest_ was made after the last command.
  bool ends_ = false;
  GuardReport newest_;
  double published_at_;
  std::string failure_unseen_;    ///< Of a report that no poll() saw.
  std::string interlock_unseen_;  ///< Likewise.
  std::vector<GuardRecord> records_;
  std::thread thread_;
};

/// A stale limit that fits the devices, s: the longest silence that one of them is allowed, and for
/// each device a connection and an exchange that run into their time-outs.
double stale_limit_of(const std::vector<RegisterMap>& maps);

/// A guard of real devices, one a map, over ModbusBus and on a thread of its own; connects by and
/// by.
/// @param clock  the steady one; must outlive the guard. @throw InputError as SpindleGuard does.
std::unique_ptr<BackgroundGuard> guard_devices(const std::vector<RegisterMap>& maps,
                                               const GuardOptions& options, Clock& clock);

}  // namespace lensforge
