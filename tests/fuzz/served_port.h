// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace lensforge::fuzz {

/// A simulated Grbl behind a pseudo-terminal, in a process of its own: it needs a thread, which the
/// campaign, a program that forks, must not have.
class ServedPort {
 public:
  ServedPort();
  ~ServedPort();
  ServedPort(const ServedPort&) = delete;
  ServedPort& operator=(const ServedPort&) = delete;

  [[nodiscard]] const std::string& path() const { return path_; }

  /// Record of the machine's actions.
  struct Record {
    int pieces = 0;  ///< Pieces of motion without homing.
    std::vector<std::string> events;
  };
  /// Ends the process. To be called once.
  Record finish();

 private:
  pid_t pid_ = -1;
  int to_ = -1;
  int from_ = -1;
  std::string path_;
};

}  // namespace lensforge::fuzz
