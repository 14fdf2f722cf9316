// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <stop_token>
#include <string>

#include "machine/link/link.h"
#include "machine/link/port.h"
#include "machine/sim/simulated_machine.h"

namespace lensforge {

/// A controller and the time that it lives in.
struct MachinePort {
  PortSpec spec;
  std::unique_ptr<SimulatedMachine> machine;
  std::unique_ptr<SteadyClock> steady;  ///< Of a real one.
  std::unique_ptr<Link> link;

  [[nodiscard]] Clock& clock() const {
    return machine ? static_cast<Clock&>(*machine) : static_cast<Clock&>(*steady);
  }
};

/// Opens a serial port, a TCP connection or a simulated mill.
/// @throw InputError for a port that there is not, LinkLost, Interrupted.
MachinePort open_machine_port(const std::string& text, const std::stop_token& stop);

}  // namespace lensforge
