// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace lensforge::testing {

/// Behaviour of a DriveServer.
enum class Manner {
  kHonest,
  kMute,       ///< Obeys and does not answer.
  kLate,       ///< Answers kLateness after the request.
  kLies,       ///< At-speed is on, the shaft stands still.
  kWrongEcho,  ///< Writes are not obeyed and echoed with another value.
  kBroken,     ///< Answers fail their checksum (RTU), or belong to another function (TCP).
};

constexpr double kLateness = 0.25;  // s

/// A drive with a spindle behind a Modbus server of libmodbus, on a thread of its own. Its
/// registers (see drive_map()) and its model are the test's own, nothing of the guard's.
class DriveServer {
 public:
  /// On 127.0.0.1. @param port  0: a free one.
  static std::unique_ptr<DriveServer> on_tcp(int port = 0);
  /// On a terminal.
  static std::unique_ptr<DriveServer> on_terminal(const std::string& device);
  ~DriveServer();
  DriveServer(const DriveServer&) = delete;
  DriveServer& operator=(const DriveServer&) = delete;

  [[nodiscard]] int port() const { return port_; }
  void set_manner(Manner manner) { manner_ = manner; }
  void set_fault(std::uint16_t code) { fault_ = code; }
  void set_door(bool closed) { door_closed_ = closed; }
  /// Rate of change of the shaft's speed, rpm/s.
  void set_ramp(double ramp) { ramp_ = ramp; }
  /// True if the last command was to turn.
  [[nodiscard]] bool told_to_turn() const { return told_to_turn_; }
  /// Speed of the shaft, rpm; negative: counter-clockwise.
  [[nodiscard]] double rpm() const { return rpm_; }
  [[nodiscard]] int requests() const { return requests_; }

 private:
  DriveServer() = default;
  void serve_tcp(int listener);
  void serve_terminal(const std::string& device);
  void answer(void* context, const std::vector<std::uint8_t>& request, std::size_t header);
  void misanswer(void* context, const std::vector<std::uint8_t>& request, std::size_t header);
  void advance();
  void show_registers();

  int port_ = 0;
  std::atomic<bool> ends_ = false;
  std::atomic<Manner> manner_ = Manner::kHonest;
  std::atomic<std::uint16_t> fault_ = 0;
  std::atomic<bool> door_closed_ = true;
  std::atomic<double> ramp_ = 150000.0;
  std::atomic<bool> told_to_turn_ = false;
  std::atomic<double> rpm_ = 0.0;
  std::atomic<int> requests_ = 0;
  void* mapping_ = nullptr;  ///< modbus_mapping_t, of the thread alone.
  double moved_at_ = 0.0;
  std::thread thread_;
};

/// Two pseudo-terminals joined like the two ends of a cable.
class TerminalPair {
 public:
  TerminalPair();
  ~TerminalPair();
  TerminalPair(const TerminalPair&) = delete;
  TerminalPair& operator=(const TerminalPair&) = delete;

  [[nodiscard]] const std::string& first() const { return names_[0]; }
  [[nodiscard]] const std::string& second() const { return names_[1]; }

 private:
  void carry();

  std::array<int, 2> masters_{};
  std::array<int, 2> slaves_{};
  std::array<std::string, 2> names_;
  std::atomic<bool> ends_ = false;
  std::thread thread_;
};

/// The DriveServer's register map, for a bus of the given [transport] lines.
std::string drive_map(const std::string& transport);

}  // namespace lensforge::testing
