// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

#include "app/view/design_watch.h"
#include "app/view/live_server.h"
#include "core/compute/executor.h"

namespace lensforge::app {

/// The port that --live names. @throw InputError unless it is a whole number from 0 to 65535.
int live_port(const std::string& text);

/// Shows a running design to browsers on this machine. A thread of its own looks at what the design
/// has saved after every round.
class LiveDesign {
 public:
  /// @param port  0 takes a free one. @throw InputError if it cannot be had.
  LiveDesign(int port, const std::string& name, std::filesystem::path checkpoint,
             DesignGoalView goal);
  ~LiveDesign();
  LiveDesign(const LiveDesign&) = delete;
  LiveDesign& operator=(const LiveDesign&) = delete;

  [[nodiscard]] std::string address() const { return server_.address(); }
  /// Something may have been saved. Returns at once.
  void look();

 private:
  void watch(const std::stop_token& stop);

  std::filesystem::path checkpoint_;
  DesignGoalView goal_;
  LiveServer server_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  bool asked_ = false;
  std::jthread watcher_;  ///< Last, so that it ends first.
};

}  // namespace lensforge::app
