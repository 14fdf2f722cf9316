// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>

namespace lensforge {

/// The link is gone: unplugged, closed by the other side, or an error of the operating system.
class LinkLost : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A two-way stream of bytes to a controller: a serial port, a TCP connection or a simulation.
class Link {
 public:
  virtual ~Link() = default;
  /// The bytes that have arrived; waits for the first of them at most `wait` seconds of the link's
  /// clock. Empty: none came. @throw LinkLost
  virtual std::string read(double wait) = 0;
  /// Hands over as many bytes as the link takes at once, at least one unless its buffer is full.
  /// @return how many. @throw LinkLost
  virtual std::size_t write(std::string_view bytes) = 0;
};

}  // namespace lensforge
