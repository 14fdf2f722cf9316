// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "machine/link/link.h"
#include "machine/link/port_lock.h"
#include "machine/link/port_spec.h"

struct sp_port;

namespace lensforge {

/// A serial port, 8N1 without flow control, or a pseudo-terminal, for one sender alone.
///
/// Opening raises DTR, which resets the 8-bit boards that have it wired so; the port is left such
/// that neither closing nor opening it again does.
class SerialLink : public Link {
 public:
  /// @throw InputError if the device cannot be opened, is in use or does not take the speed.
  explicit SerialLink(const PortSpec& spec);

  std::string read(double wait) override;
  std::size_t write(std::string_view bytes) override;

 private:
  struct ClosePort {
    void operator()(sp_port* port) const;
  };

  void configure(const PortSpec& spec, const std::string& device);
  [[noreturn]] void lose(const std::string& why) const;

  std::string name_;
  PortLock lock_;
  std::unique_ptr<sp_port, ClosePort> port_;  ///< None for a pseudo-terminal.
};

}  // namespace lensforge
