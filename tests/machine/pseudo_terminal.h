// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <stdexcept>
#include <string>

#include "core/io/files.h"

namespace lensforge::testing {

/// A serial port without hardware: what the test writes to `master` arrives at `device` and back.
class PseudoTerminal {
 public:
  PseudoTerminal() : master_(::posix_openpt(O_RDWR | O_NOCTTY)) {
    if (!master_.open() || ::grantpt(master()) != 0 || ::unlockpt(master()) != 0) {
      throw std::runtime_error("no pseudo-terminal");
    }
    char name[256] = {};
    if (::ptsname_r(master(), name, sizeof name) != 0) throw std::runtime_error("no name");
    device_ = name;
  }

  [[nodiscard]] int master() const { return master_.number(); }
  [[nodiscard]] const std::string& device() const { return device_; }
  /// Simulates a pulled cable.
  void unplug() { master_ = Descriptor(); }

 private:
  Descriptor master_;
  std::string device_;
};

}  // namespace lensforge::testing
