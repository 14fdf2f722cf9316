// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "machine/guard/register_map.h"
#include "machine/link/link.h"

struct _modbus;  // NOLINT(bugprone-reserved-identifier): libmodbus's own name

namespace lensforge {

/// A device on a serial line (RTU) or a network (TCP), through libmodbus with its automatic
/// recovery switched off. An exchange takes at most the connect time-out (TCP, when not open), the
/// request gap, the response time-out and 16 byte time-outs; a host name adds the resolver's time.
class ModbusBus final : public RegisterBus {
 public:
  explicit ModbusBus(const BusTransport& transport);
  ~ModbusBus() override;
  ModbusBus(const ModbusBus&) = delete;
  ModbusBus& operator=(const ModbusBus&) = delete;

  void open() override;
  void close() override;
  [[nodiscard]] bool is_open() const override { return context_ != nullptr; }
  void discard() override;
  std::uint16_t read(const RegisterAddress& at) override;
  void write(const RegisterAddress& at, std::uint16_t value) override;

 private:
  struct Freed {
    void operator()(_modbus* context) const;
  };
  [[noreturn]] void fail(int error) const;
  void begin_request();
  std::vector<std::uint8_t> answer_to(const std::vector<std::uint8_t>& request);

  BusTransport transport_;
  std::unique_ptr<_modbus, Freed> context_;
  double last_exchange_;  ///< s on the steady clock.
};

/// Keeps one device's bus connected: opens it on demand, closes it after a failure, waits longer
/// after each failed attempt, and leaves an RTU line idle until a late answer has passed. Repeats
/// no exchange.
class BusSession {
 public:
  BusSession(std::unique_ptr<RegisterBus> bus, const BusTransport& transport, Clock& clock);

  /// True if an exchange may start now; false during a pause.
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
