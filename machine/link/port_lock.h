// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "core/io/descriptor.h"
#include "machine/link/port_spec.h"

namespace lensforge {

/// The right to be the only sender on a port while it lives, root included: an advisory lock
/// (flock) on the device itself, or on a file that stands for a TCP address. The system drops it
/// with the process, however that ends.
class PortLock {
 public:
  /// @throw InputError if another sender has the port or the device cannot be opened.
  explicit PortLock(const PortSpec& spec);

  /// The locked file, open for reading and writing without waiting; −1 for the simulation.
  [[nodiscard]] int descriptor() const { return file_.number(); }

 private:
  Descriptor file_;
};

/// The file that is locked for `spec`: the device, or /run/lock/lensforge-… (the folder for
/// temporary files where there is no /run/lock).
std::filesystem::path lock_file(const PortSpec& spec);

}  // namespace lensforge
