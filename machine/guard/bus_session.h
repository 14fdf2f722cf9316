// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "machine/guard/register_bus.h"
#include "machine/guard/register_map.h"
#include "machine/link/link.h"

namespace lensforge {

/// Keeps one device's bus connected: opens it when it is needed, closes it when it broke, pauses
/// longer and longer before the next try, and leaves an RTU line alone until a late answer has
/// gone by. Retries nothing by itself.
class BusSession {
 public:
  BusSession(std::unique_ptr<RegisterBus> bus, const BusTransport& transport, Clock& clock);

  /// Whether an exchange may start now; false during a pause.
  [[nodiscard]] bool ready() const;
  /// @pre ready(). @throw BusError
  std::uint16_t read(const RegisterAddress& at);
  /// @pre ready(). @throw BusError
  void write(const RegisterAddress& at, std::uint16_t value);

 private:
  std::uint16_t exchange(const std::function<std::uint16_t()>& exchange);
  void recover(BusFault fault, double started);
  void hang_up(double from);

  std::unique_ptr<RegisterBus> bus_;
  BusTransport transport_;
  Clock& clock_;
  double not_before_;
  double pause_;
  int silences_ = 0;
  bool discard_first_ = true;
};

}  // namespace lensforge
