// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "core/compute/executor.h"

namespace lensforge::app {

/// Writes `text` to stdout as it is and flushes it.
/// @throw RunError if stdout does not take it (closed pipe, full disk).
void print_to_stdout(std::string_view text);

/// Prints "lensforge: message" as one line on stderr and, with `json`, {"error", "exit_code"} on
/// stdout. Returns `exit_code`; never throws.
int report_error(const std::string& message, int exit_code, bool json) noexcept;

/// Columns of the terminal on stderr; 80 if unknown.
std::size_t terminal_width();

/// Output of a command: messages go to stderr, the result to stdout.
class Console {
 public:
  Console(bool json, bool quiet) : json_(json), quiet_(quiet) {}

  /// Prints a note on stderr; nothing with --quiet. Notes are held back until begin(): if the
  /// command is refused, the error is the only line.
  void note(const std::string& message) const;

  /// The input is accepted: prints the held notes; later ones are printed at once.
  void begin() const;

  /// Prints the held notes, then the result: `object` with --json, else `text`.
  void result(const nlohmann::json& object, const std::string& text) const;

 private:
  bool json_;
  bool quiet_;
  mutable bool begun_ = false;
  mutable std::vector<std::string> held_;
};

/// Estimates the time left of the running stage from its pace so far. Seconds are those of any
/// clock that never runs backwards.
class StagePace {
 public:
  /// Takes a report. Another stage, another total or less work done begins a new pace. The pace
  /// counts from the last report before work begins to advance.
  void take(const Progress& progress, double seconds);

  /// Seconds left, above 0. Nothing if the total is unknown or reached, before the stage has
  /// advanced for 3 s and by 1 % of its total, and once the stage takes longer than its pace
  /// predicted.
  [[nodiscard]] std::optional<double> left(double seconds) const;

 private:
  /// Work done, and when it was first reported.
  struct Mark {
    double done = 0.0;
    double seconds = 0.0;
  };

  std::string stage_;
  double total_ = 0.0;
  Mark first_;
  Mark last_;
};

/// Shows progress on stderr: a bar on a terminal, a line every few seconds otherwise, nothing if
/// `quiet`. The latest report is shown again while no new one arrives. The destructor erases the
/// bar.
class ProgressDisplay {
 public:
  explicit ProgressDisplay(bool quiet);
  ~ProgressDisplay();
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  /// The sink for a RunControl; may be called from any thread while this object lives.
  [[nodiscard]] std::function<void(const Progress&)> sink();

  /// Erases the bar.
  void wipe();

 private:
  using Clock = std::chrono::steady_clock;

  void show(const Progress& progress);
  void draw();
  [[nodiscard]] std::string line(double seconds) const;
  void redraw_until(const std::stop_token& stop);

  const bool quiet_;
  const bool terminal_;
  const Clock::time_point start_ = Clock::now();
  std::mutex mutex_;
  std::condition_variable_any ended_;
  Progress last_;
  StagePace pace_;
  Clock::time_point shown_;
  bool bar_drawn_ = false;
  std::jthread redrawer_;
};

/// "stage  57 %  detail  0:34, 0:25 left", with a bar of `bar_width` characters if that is above 0.
/// @param seconds  since the start. @param left  seconds left of the stage; nothing if unknown.
std::string progress_line(const Progress& progress, double seconds, std::optional<double> left,
                          int bar_width);

}  // namespace lensforge::app
