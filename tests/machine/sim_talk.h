// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <deque>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "machine/faulty_machine.h"

namespace lensforge {

constexpr int kFaultKinds = 14;

/// "unplug", "unplug-reset", "reset", … as tables name it.
inline std::string fault_name(FaultKind kind) {
  constexpr std::array<const char*, kFaultKinds> kNames{
      "unplug",        "unplug-reset",  "reset",         "alarm",       "error",
      "lost-reply",    "garbled-reply", "duplicated-ok", "stall",       "rx-overrun",
      "partial-write", "door",          "hold",          "dropped-byte"};
  return kNames[static_cast<std::size_t>(kind)];
}

/// No limit and no delay: for measuring the sender itself, with SimulatedOptions::instant.
inline WireOptions instant_wire() {
  WireOptions wire;
  wire.bytes_per_second = 0.0;
  wire.latency = 0.0;
  wire.gathering = 0.0;
  wire.host_buffer = 1 << 16;
  return wire;
}

/// Talks to a simulated controller as a terminal would.
class Talk {
 public:
  explicit Talk(const SimulatedOptions& options, const WireOptions& wire = {})
      : machine(options, wire, watch()), link(machine.open()) {
    listen(0.2);
  }
  Talk(const Talk&) = delete;
  Talk& operator=(const Talk&) = delete;

  void send(std::string_view bytes) {
    while (!bytes.empty()) {
      const std::size_t count = link->write(bytes);
      bytes.remove_prefix(count);
      if (count == 0) machine.wait(0.01);
    }
  }
  /// Everything heard within so many seconds.
  std::string listen(double seconds) {
    std::string heard;
    for (const double end = machine.now() + seconds; machine.now() < end;) {
      heard += link->read(end - machine.now());
    }
    return heard;
  }
  /// Sends a line and listens for its ok or error; everything heard until then.
  std::string command(const std::string& line, double patience = 600.0) {
    send(line + "\n");
    std::string heard;
    for (const double end = machine.now() + patience; machine.now() < end;) {
      heard += link->read(end - machine.now());
      const bool done = heard.find("ok\r\n") != std::string::npos ||
                        (heard.find("error:") != std::string::npos && heard.back() == '\n');
      if (done) break;
    }
    return heard;
  }
  std::string status() {
    listen(0.005);
    send("?");
    std::string heard;
    for (int i = 0; i < 100 && heard.find(">\r\n") == std::string::npos; ++i) {
      heard += link->read(0.01);
    }
    return heard.substr(0, heard.find("\r\n"));
  }
  /// Waits until the machine rests.
  void settle() {
    listen(0.05);
    for (int i = 0; i < 100'000 && machine.controller().moving(); ++i) listen(0.05);
    listen(0.05);
  }
  /// Homes the machine.
  void home() { command("$H"); }

  /// Sends a whole program so that never more than `in_flight` bytes are unanswered.
  /// @return lines answered by an error.
  int stream(const std::string& program, std::size_t in_flight) {
    std::istringstream lines(program);
    std::deque<std::size_t> unanswered;
    std::size_t flying = 0;
    int errors = 0;
    std::string heard;
    const auto hear = [&] {
      heard += link->read(10.0);
      for (std::size_t end = heard.find('\n'); end != std::string::npos; end = heard.find('\n')) {
        const bool error = heard.rfind("error:", 0) == 0;
        if (error) ++errors;
        if (error || heard.rfind("ok", 0) == 0) {
          flying -= unanswered.front();
          unanswered.pop_front();
        }
        heard.erase(0, end + 1);
      }
    };
    for (std::string line; std::getline(lines, line);) {
      line += '\n';
      while (flying + line.size() > in_flight) hear();
      send(line);
      flying += line.size();
      unanswered.push_back(line.size());
    }
    while (!unanswered.empty()) hear();
    return errors;
  }

  std::vector<ExecutedPiece> pieces;
  std::vector<ExecutedPiece> begun;
  std::vector<std::string> events;
  FaultyMachine machine;
  std::unique_ptr<Link> link;

 private:
  MachineWatch watch() {
    MachineWatch made;
    made.piece = [this](const ExecutedPiece& piece) { pieces.push_back(piece); };
    made.begins = [this](const ExecutedPiece& piece) { begun.push_back(piece); };
    made.event = [this](const MachineEvent& event) { events.push_back(event.what); };
    return made;
  }
};

/// A board without homing and limits that is ready at once.
inline SimulatedOptions ready_grbl() {
  SimulatedOptions options = simulated_grbl();
  options.settings[20] = 0;
  options.settings[22] = 0;
  options.stands_at.setZero();
  return options;
}
inline SimulatedOptions ready_grblhal() {
  SimulatedOptions options = simulated_grblhal();
  options.settings[20] = 0;
  options.settings[22] = 0;
  options.stands_at.setZero();
  return options;
}

}  // namespace lensforge
