// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

#include "core/compute/run_control.h"

namespace lensforge::app {

/// Shows progress on stderr: a bar that redraws itself on a terminal, a line every few seconds
/// otherwise, nothing if `quiet`; what was reported last also while no news comes. The bar is wiped
/// on destruction.
class ProgressDisplay {
 public:
  explicit ProgressDisplay(bool quiet);
  ~ProgressDisplay();
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  /// The sink for a RunControl; may be called from any thread while this object lives.
  [[nodiscard]] std::function<void(const Progress&)> sink();

  /// Takes the bar off the terminal.
  void wipe();

 private:
  using Clock = std::chrono::steady_clock;

  void show(const Progress& progress);
  void draw();
  void redraw_until(const std::stop_token& stop);

  const bool quiet_;
  const bool terminal_;
  const Clock::time_point start_ = Clock::now();
  std::mutex mutex_;
  std::condition_variable_any ended_;
  Progress last_;
  Clock::time_point shown_;
  bool bar_drawn_ = false;
  std::jthread redrawer_;
};

/// "stage  57 %  detail  0:34", with a bar of `bar_width` characters if that is above 0.
std::string progress_line(const Progress& progress, double seconds, int bar_width);

}  // namespace lensforge::app
