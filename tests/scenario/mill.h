// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "machine/pty_controller.h"

namespace lensforge::scenario {

/// A zig-zag of some seconds a row, with line numbers from 8 on for what cuts.
std::string zig_zag(int rows);

/// A mill behind a pseudo-terminal, some times as fast as a real one.
class Mill {
 public:
  /// @param begins  called from another thread when a piece of motion begins.
  explicit Mill(double speed = 20.0, std::function<void(const ExecutedPiece&)> begins = {})
      : controller_(simulated_grbl(), speed, watch(std::move(begins))) {}
  [[nodiscard]] const std::string& path() const { return controller_.path(); }
  [[nodiscard]] std::vector<ExecutedPiece> pieces() {
    const std::lock_guard lock(mutex_);
    return pieces_;
  }
  /// Waits until so many pieces were cut.
  bool cut(std::size_t count) {
    for (int i = 0; i < 3000; ++i) {
      std::size_t cuts = 0;
      for (const ExecutedPiece& piece : pieces()) cuts += piece.rapid ? 0 : 1;
      if (cuts >= count) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }

 private:
  MachineWatch watch(std::function<void(const ExecutedPiece&)> begins) {
    MachineWatch watch;
    watch.begins = std::move(begins);
    watch.piece = [this](const ExecutedPiece& piece) {
      const std::lock_guard lock(mutex_);
      pieces_.push_back(piece);
    };
    return watch;
  }

  std::mutex mutex_;
  std::vector<ExecutedPiece> pieces_;
  PtyController controller_;
};

}  // namespace lensforge::scenario
