// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "machine/stream/sender.h"

namespace lensforge::app {

/// What a view of a running job has to know beside the events.
struct JobView {
  std::int64_t bytes = 0;       ///< Of the file.
  std::int64_t lines = 0;       ///< Of the file.
  std::int64_t first_byte = 0;  ///< Where this run began.
  double estimate = 0.0;        ///< s, of the whole program.
  int planner_blocks = 0;       ///< 0 if not known.
  int rx_bytes = 0;             ///< Likewise.
};

/// "X1.00 Y2.00 Z-0.500"
std::string position_text(const Eigen::Vector3d& at);

/// "1:02:03"
std::string duration_text(double seconds);

/// Share of the file that was taken, 0 … 1.
double share_of(const SendEvent& event, const JobView& job);

/// How long a job still takes: what the estimate leaves, at the pace so far. Times of hold do not
/// count.
class TimeLeft {
 public:
  explicit TimeLeft(const JobView& job) : job_(job) {}

  void take(const SendEvent& event);
  [[nodiscard]] double seconds() const { return left_; }

 private:
  JobView job_;
  double left_ = 0.0;
  double held_ = 0.0;
  double last_ = 0.0;
};

/// A running job in three lines: how far; what the machine does; buffers and what is wrong.
std::vector<std::string> view_lines(const SendEvent& event, const JobView& job, double left,
                                    const std::string& warning);

/// Shows a running job on stderr: three lines that redraw themselves on a terminal, one line every
/// few seconds otherwise, nothing if `quiet`. The lines stay on the terminal in the end.
class OperatorView {
 public:
  OperatorView(bool quiet, const JobView& job);
  ~OperatorView();
  OperatorView(const OperatorView&) = delete;
  OperatorView& operator=(const OperatorView&) = delete;

  void take(const SendEvent& event, double left);

 private:
  using Clock = std::chrono::steady_clock;

  void note(const std::string& text);
  void show(const std::vector<std::string>& lines);
  void wipe();

  const bool quiet_;
  const bool terminal_;
  const JobView job_;
  Clock::time_point shown_ = Clock::now();
  std::size_t drawn_ = 0;  ///< Lines that stand on the terminal.
  std::string warning_;    ///< The last one.
};

}  // namespace lensforge::app
