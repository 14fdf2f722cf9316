// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

/// Drives the built command from outside, as a shell would.
namespace lensforge::scenario {

namespace fs = std::filesystem;
using Arguments = std::vector<std::string>;

/// A process's end and output.
struct Outcome {
  int exit_code = -1;  ///< −1 if a signal ended it.
  int signal = 0;
  std::string out;
  std::string err;
  double seconds = 0.0;

  [[nodiscard]] nlohmann::json json() const { return nlohmann::json::parse(out); }
};

/// A running `lensforge ARGUMENTS`; killed when this object goes.
class Process {
 public:
  /// `file_size_limit` in bytes, 0 for none (RLIMIT_FSIZE).
  explicit Process(const Arguments& arguments, unsigned long file_size_limit = 0);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void send(int signal) const;
  /// True if it already has a handler for this signal (Linux's /proc).
  [[nodiscard]] bool catches(int signal) const;
  /// Kills it and the processes that it has made, as the system does when memory runs out.
  void kill_all() const;
  /// Waits for the end; a process that takes longer than `limit` is killed and fails the test.
  Outcome wait(std::chrono::seconds limit = std::chrono::seconds(120));
  /// True if it is still running after `time`.
  bool runs_for(std::chrono::milliseconds time);
  /// Its output on stderr so far.
  [[nodiscard]] std::string said() const;

 private:
  bool reap(int options);

  fs::path folder_;
  pid_t pid_ = -1;
  int status_ = 0;
  bool ended_ = false;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Runs `lensforge ARGUMENTS` to its end.
Outcome run(const Arguments& arguments, unsigned long file_size_limit = 0);

/// A test with a folder of its own, removed afterwards.
class Scenario : public ::testing::Test {
 protected:
  Scenario();
  ~Scenario() override;

  [[nodiscard]] fs::path at(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] std::string path(const std::string& name) const { return at(name).string(); }

 private:
  fs::path folder_;
};

/// A picture of the fixtures folder.
std::string picture(const std::string& name);

/// `design` of a small picture into `out`, a second or so of work.
Arguments small_design(const std::string& target, const std::string& out);
/// Puts what small_design() makes of stripes.png into `folder`; designed once per program.
void place_small_lens(const fs::path& folder);

std::string content(const fs::path& file);
void write(const fs::path& file, const std::string& content);

/// What a command of the shell, which should succeed, prints.
nlohmann::json json_printed_by(const std::string& command);

/// Fails unless the run ended with `exit_code`, printed nothing on stdout and one line on stderr
/// that holds each of `parts`.
void expect_refusal(const Outcome& outcome, int exit_code, const std::vector<std::string>& parts);

/// Names of the files in a folder, hidden ones included; empty if there is no folder.
std::vector<std::string> listing(const fs::path& folder);

}  // namespace lensforge::scenario
