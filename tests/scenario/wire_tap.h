// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <thread>

#include "core/io/files.h"
#include "machine/pseudo_terminal.h"

namespace lensforge::scenario {

/// A cable to a controller at `device` that keeps what the sender says.
class WireTap {
 public:
  explicit WireTap(const std::string& device);
  ~WireTap();
  WireTap(const WireTap&) = delete;
  WireTap& operator=(const WireTap&) = delete;

  /// The sender's end.
  [[nodiscard]] const std::string& path() const { return near_.device(); }
  [[nodiscard]] std::string sent();
  /// Waits for up to ten seconds until `text` was sent, after `before` if that is given.
  bool sends(const std::string& text, const std::string& before = {});

 private:
  void pass_on();

  testing::PseudoTerminal near_;
  Descriptor held_;  ///< Keeps the sender's end open while no sender has it.
  Descriptor far_;
  std::mutex mutex_;
  std::string sent_;
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

}  // namespace lensforge::scenario
