// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "machine/guard/register_map.h"

struct _modbus;  // NOLINT(bugprone-reserved-identifier): libmodbus's own name

namespace lensforge {

/// A device on a serial line (RTU) or a network (TCP), through libmodbus with its automatic
/// recovery switched off. An exchange takes at most the connect time-out (TCP, when not open), the
/// request gap, the response time-out and 16 byte time-outs; a host that is a name adds the
/// resolver's time.
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

}  // namespace lensforge
