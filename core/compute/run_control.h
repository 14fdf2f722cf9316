// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <utility>

namespace lensforge {

/// Progress of a long job, in its own units of work.
struct Progress {
  std::string stage;   ///< Current stage, e.g. "design level 3/4".
  double done = 0.0;   ///< Units of work finished.
  double total = 0.0;  ///< Units of work in all; 0 if unknown.
  std::string detail;  ///< One short free text, e.g. "MAE 0.0123".
};

/// Progress sink and stop token, the last argument of every long-running function. A
/// default-constructed one neither reports nor stops.
class RunControl {
 public:
  RunControl() = default;
  RunControl(std::stop_token stop, std::function<void(const Progress&)> sink)
      : stop_(std::move(stop)), sink_(std::move(sink)) {}

  /// True once the caller wants the work to end. Call it at least once a second.
  [[nodiscard]] bool stop_requested() const { return stop_.stop_requested(); }

  /// The token itself, to pass on with another sink.
  [[nodiscard]] std::stop_token stop_token() const { return stop_; }

  void report(const Progress& progress) const {
    if (sink_) sink_(progress);
  }

 private:
  std::stop_token stop_;
  std::function<void(const Progress&)> sink_;
};

}  // namespace lensforge
