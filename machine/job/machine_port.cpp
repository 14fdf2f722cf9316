// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/job/machine_port.h"

#include <Eigen/Core>

#include "machine/gcode/gcode_dialect.h"
#include "machine/link/port.h"

namespace lensforge {
namespace {

/// Where the part lies in the simulated mill of 400 x 300 x 100 mm.
const Eigen::Vector3d kSimulatedOrigin(-350.0, -250.0, -60.0);

SimulatedOptions simulated_options(const std::string& name) {
  return parse_dialect(name.empty() ? "grbl" : name, "--port sim:").name == "grbl"
             ? simulated_grbl()
             : simulated_grblhal();
}

}  // namespace

MachinePort open_machine_port(const std::string& text, const std::stop_token& stop) {
  MachinePort port;
  port.spec = parse_port_spec(text);
  switch (port.spec.kind) {
    case PortSpec::Kind::kSimulated:
      port.machine = std::make_unique<SimulatedMachine>(simulated_options(port.spec.place));
      for (int i = 0; i < 6; ++i) port.machine->controller().set_origin(i, kSimulatedOrigin);
      port.link = port.machine->open();
      return port;
    case PortSpec::Kind::kSerial:
      port.link = std::make_unique<SerialLink>(port.spec);
      break;
    case PortSpec::Kind::kTcp:
      port.link = std::make_unique<TcpLink>(port.spec, stop);
      break;
  }
  port.steady = std::make_unique<SteadyClock>();
  return port;
}

}  // namespace lensforge
