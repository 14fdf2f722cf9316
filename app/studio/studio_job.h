// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <condition_variable>
#include <filesystem>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include "app/frame/command_line.h"
#include "app/view/loopback_server.h"
#include "core/io/files.h"

namespace lensforge::app {

/// A turn for work that keeps all processors busy: one job of a studio at a time.
class ComputeTurn {
 public:
  /// @param common  words that every such command gets: --threads, --device.
  explicit ComputeTurn(Arguments common) : common_(std::move(common)) {}

  [[nodiscard]] const Arguments& common() const { return common_; }
  /// Waits until nobody else has the turn. @return false if `stop` was requested before.
  bool take(const std::stop_token& stop);
  void give_back();

 private:
  std::mutex mutex_;
  std::condition_variable_any free_;
  bool taken_ = false;
  Arguments common_;
};

/// A command that a project runs.
struct StudioTask {
  std::string step;   ///< "plan", "design", "cam", "view", "export", "check", "send"
  Arguments words;    ///< Of the command line, as typed in the project's folder.
  std::string files;  ///< Path in the project's folder, without extension, for .out and .log.
  std::filesystem::path checkpoint = {};  ///< Of a design: shown while it runs.
};

/// A task in a child process of its own, which works in the project's folder. Its state survives
/// the studio in `FILES.json`.
class StudioJob {
 public:
  /// Starts it. @param turn  that it takes while it runs; null: it waits for nobody.
  StudioJob(const std::filesystem::path& folder, StudioTask task, ComputeTurn* turn);
  /// Interrupts it as by Ctrl-C and waits for its end.
  ~StudioJob();
  StudioJob(const StudioJob&) = delete;
  StudioJob& operator=(const StudioJob&) = delete;

  [[nodiscard]] const StudioTask& task() const { return task_; }
  [[nodiscard]] bool running() const;
  /// Interrupts it; what it has done is kept.
  void stop();
  /// Sends a key to its standard input.
  void press(char key) const;
  /// "step", "status", "command", "share", "words", "message", "live".
  [[nodiscard]] nlohmann::json state() const;
  /// Bytes of a PNG of the design so far; empty before the first. @param picture  which one.
  [[nodiscard]] std::string live_picture(std::string LiveState::*picture) const;

 private:
  void run(const std::stop_token& stop);
  void watch(const std::stop_token& stop);
  void set(const std::string& status, const std::string& message);

  std::filesystem::path folder_;
  StudioTask task_;
  ComputeTurn* turn_;
  Descriptor keys_;   ///< To write to.
  Descriptor input_;  ///< Of the child.
  mutable std::mutex mutex_;
  std::condition_variable_any ended_;
  std::string status_ = "waiting";
  std::string message_;
  LiveState live_;
  std::jthread watcher_;
  std::jthread runner_;
};

/// The state of an earlier studio's last job: what StudioJob::state() gave, or null. One that was
/// running is interrupted. @param files  StudioTask::files.
nlohmann::json earlier_job(const std::filesystem::path& folder, const std::string& files);

/// "lensforge design picture.png --out lens-1", for a shell.
std::string command_text(const Arguments& words);

}  // namespace lensforge::app
