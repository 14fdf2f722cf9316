// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge {

/// Time as a sender lives it: the machine's own steady clock, or a simulated controller's virtual
/// time, in which hours of cutting take seconds.
class Clock {
 public:
  virtual ~Clock() = default;
  /// Seconds since an arbitrary fixed moment; never runs backwards.
  [[nodiscard]] virtual double now() const = 0;
  /// Lets `seconds` pass.
  virtual void wait(double seconds) = 0;
};

}  // namespace lensforge
