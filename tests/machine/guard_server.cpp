// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/guard_server.h"

#include <arpa/inet.h>
#include <modbus.h>
#include <poll.h>
#include <pty.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

namespace lensforge::testing {
namespace {

constexpr int kFirstRegister = 0x2000;
constexpr int kCommand = 0;
constexpr int kFrequency = 1;
constexpr int kFault = 8;
constexpr int kOutput = 11;
constexpr int kWaitMs = 5;  // a server looks this often whether it is to end

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct FreeContext {
  void operator()(modbus_t* context) const { modbus_free(context); }
};
using Context = std::unique_ptr<modbus_t, FreeContext>;

modbus_mapping_t* mapping_of(void* mapping) { return static_cast<modbus_mapping_t*>(mapping); }

bool readable(int descriptor) {
  pollfd entry{descriptor, POLLIN, 0};
  return ::poll(&entry, 1, kWaitMs) == 1;
}

std::vector<std::uint8_t> receive(modbus_t* context) {
  std::vector<std::uint8_t> request(MODBUS_MAX_ADU_LENGTH);
  const int length = modbus_receive(context, request.data());
  request.resize(length > 0 ? static_cast<std::size_t>(length) : 0);
  return request;
}

int port_of(int listener) {
  sockaddr_in address{};
  socklen_t size = sizeof(address);
  ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

}  // namespace

std::unique_ptr<DriveServer> DriveServer::on_tcp(int port) {
  const Context context(modbus_new_tcp("127.0.0.1", port));
  const int listener = modbus_tcp_listen(context.get(), 8);
  if (listener == -1) throw std::runtime_error("no listener on 127.0.0.1");
  std::unique_ptr<DriveServer> server(new DriveServer);
  server->port_ = port_of(listener);
  server->thread_ = std::thread([raw = server.get(), listener] { raw->serve_tcp(listener); });
  return server;
}

std::unique_ptr<DriveServer> DriveServer::on_terminal(const std::string& device) {
  std::unique_ptr<DriveServer> server(new DriveServer);
  server->thread_ = std::thread([raw = server.get(), device] { raw->serve_terminal(device); });
  return server;
}

DriveServer::~DriveServer() {
  ends_ = true;
  thread_.join();
  if (mapping_ != nullptr) modbus_mapping_free(mapping_of(mapping_));
}

void DriveServer::serve_tcp(int listener) {
  const Context context(modbus_new_tcp("127.0.0.1", 0));
  std::vector<pollfd> all{{listener, POLLIN, 0}};
  while (!ends_) {
    if (::poll(all.data(), all.size(), kWaitMs) <= 0) continue;
    for (std::size_t i = 1; i < all.size(); ++i) {
      if (all[i].revents == 0) continue;
      modbus_set_socket(context.get(), all[i].fd);
      const std::vector<std::uint8_t> request = receive(context.get());
      if (!request.empty()) {
        answer(context.get(), request, 7);
        continue;
      }
      ::close(all[i].fd);
      all[i].fd = -1;
    }
    if (all[0].revents != 0) all.push_back({::accept(listener, nullptr, nullptr), POLLIN, 0});
    std::erase_if(all, [](const pollfd& entry) { return entry.fd == -1; });
  }
  for (const pollfd& entry : all) ::close(entry.fd);
}

void DriveServer::serve_terminal(const std::string& device) {
  const Context context(modbus_new_rtu(device.c_str(), 19200, 'N', 8, 1));
  modbus_set_slave(context.get(), 1);
  if (modbus_connect(context.get()) != 0) return;
  while (!ends_) {
    if (!readable(modbus_get_socket(context.get()))) continue;
    const std::vector<std::uint8_t> request = receive(context.get());
    if (!request.empty()) answer(context.get(), request, 1);
  }
  modbus_close(context.get());
}

void DriveServer::answer(void* context, const std::vector<std::uint8_t>& request,
                         std::size_t header) {
  if (mapping_ == nullptr) {
    mapping_ = modbus_mapping_new_start_address(0, 0, 0, 8, kFirstRegister, 16, 0, 0);
    moved_at_ = now();
  }
  ++requests_;
  advance();
  show_registers();
  const Manner manner = manner_;
  const bool writes = request[header] == MODBUS_FC_WRITE_SINGLE_REGISTER;
  if (manner == Manner::kLate) {
    std::this_thread::sleep_for(std::chrono::duration<double>(kLateness));
  }
  if (manner == Manner::kBroken || (manner == Manner::kWrongEcho && writes)) {
    return misanswer(context, request, header);
  }
  auto* server = static_cast<modbus_t*>(context);
  if (manner != Manner::kMute) {
    modbus_reply(server, request.data(), static_cast<int>(request.size()), mapping_of(mapping_));
  } else if (writes) {
    const int at = request[header + 1] * 256 + request[header + 2] - kFirstRegister;
    if (at >= 0 && at < 16) {
      mapping_of(mapping_)->tab_registers[at] =
          static_cast<std::uint16_t>(request[header + 3] * 256 + request[header + 4]);
    }
  }
}

void DriveServer::misanswer(void* context, const std::vector<std::uint8_t>& request,
                            std::size_t header) {
  auto* server = static_cast<modbus_t*>(context);
  const auto end = static_cast<std::ptrdiff_t>(header + 5);
  std::vector<std::uint8_t> reply(request.begin(), request.begin() + end);
  if (manner_ == Manner::kWrongEcho) {
    ++reply.back();
    reply.erase(reply.begin(), reply.begin() + static_cast<std::ptrdiff_t>(header) - 1);
    modbus_send_raw_request(server, reply.data(), static_cast<int>(reply.size()));
    return;
  }
  if (header == 1) {  // a whole answer to a read of one register, with a checksum of zeros
    reply = {request[0], request[1], 2, 0x12, 0x34, 0, 0};
  } else {
    reply = {request[0], request[1], 0, 0, 0, 5, request[6], 0x44, 2, 0, 0};
  }
  const ssize_t sent = ::write(modbus_get_socket(server), reply.data(), reply.size());
  if (sent < 0) throw std::runtime_error("the test's server cannot write");
}

void DriveServer::advance() {
  const double time = now();
  const std::uint16_t* registers = mapping_of(mapping_)->tab_registers;
  const double asked = registers[kFrequency] * 6.0;
  told_to_turn_ = registers[kCommand] == 0x12 || registers[kCommand] == 0x22;
  double target = 0.0;
  if (registers[kCommand] == 0x12) target = asked;
  if (registers[kCommand] == 0x22) target = -asked;
  if (manner_ == Manner::kLies || fault_ != 0) target = 0.0;
  const double most = ramp_ * (time - moved_at_);
  rpm_ = rpm_ + std::clamp(target - rpm_, -most, most);
  moved_at_ = time;
}

void DriveServer::show_registers() {
  modbus_mapping_t* mapping = mapping_of(mapping_);
  const double rpm = rpm_;
  mapping->tab_registers[kFault] = fault_;
  mapping->tab_registers[kOutput] = static_cast<std::uint16_t>(std::lround(std::abs(rpm) / 6.0));
  const double asked = mapping->tab_registers[kFrequency] * 6.0;
  const bool reached = std::abs(std::abs(rpm) - asked) < 60.0;
  mapping->tab_input_bits[0] = door_closed_ ? 1 : 0;
  mapping->tab_input_bits[1] = reached || manner_ == Manner::kLies ? 1 : 0;
  mapping->tab_input_bits[2] = rpm < 0.0 ? 1 : 0;
}

TerminalPair::TerminalPair() {
  for (std::size_t i = 0; i < 2; ++i) {
    std::array<char, 128> name{};
    termios raw{};
    ::cfmakeraw(&raw);
    if (::openpty(&masters_[i], &slaves_[i], name.data(), &raw, nullptr) != 0) {
      throw std::runtime_error("no pseudo-terminal");
    }
    names_[i] = name.data();
  }
  thread_ = std::thread([this] { carry(); });
}

TerminalPair::~TerminalPair() {
  ends_ = true;
  thread_.join();
  for (std::size_t i = 0; i < 2; ++i) {
    ::close(masters_[i]);
    ::close(slaves_[i]);
  }
}

// The slaves stay open here, so that a terminal that nobody has open is quiet, and not an error.
void TerminalPair::carry() {
  while (!ends_) {
    std::array<pollfd, 2> ends{pollfd{masters_[0], POLLIN, 0}, pollfd{masters_[1], POLLIN, 0}};
    if (::poll(ends.data(), ends.size(), kWaitMs) <= 0) continue;
    for (std::size_t i = 0; i < 2; ++i) {
      if ((ends[i].revents & POLLIN) == 0) continue;
      std::array<char, 512> bytes{};
      const ssize_t count = ::read(masters_[i], bytes.data(), bytes.size());
      if (count > 0 &&
          ::write(masters_[1 - i], bytes.data(), static_cast<std::size_t>(count)) != count) {
        return;
      }
    }
  }
}

std::string drive_map(const std::string& transport) {
  return R"(format = "lensforge.register-map"
version = 1
protocol = "modbus"
name = "drive"

[transport]
)" + transport +
         R"(
response_timeout = 0.1
byte_timeout = 0.05
request_gap = 0.0
reconnect_pause = 0.05
reconnect_pause_max = 0.2
silence_limit = 0.4

[spindle]
rpm_min = 1000
rpm_max = 24000
rpm_per_hz = 60
tolerance = 0.05
verify_reads = 3
lost_reads = 2
stopped_rpm = 60
spin_up_limit = 0.5
spin_down_limit = 2.0

[spindle.commands]
retries = 3
set_speed = { function = 6, address = 0x2001, quantity = "hz", scale = 0.1 }
run_forward = [{ function = 6, address = 0x2000, value = 0x12 }]
run_reverse = [{ function = 6, address = 0x2000, value = 0x22 }]
stop = [{ function = 6, address = 0x2000, value = 0x01 }]

[spindle.status]
speed = { function = 3, address = 0x200B, quantity = "hz", scale = 0.1, interval = 0.02, retries = 3 }
fault = { function = 3, address = 0x2008, clear = 0, interval = 0.03, retries = 3, texts = { 9 = "too hot" } }
at_speed = { function = 2, address = 1, expected = 1, interval = 0.02, retries = 3 }
direction = { function = 2, address = 2, forward = 0, reverse = 1, interval = 0.03, retries = 3 }

[[interlocks]]
name = "door"
function = 2
address = 0
expected = 1
interval = 0.02
retries = 3
)";
}

}  // namespace lensforge::testing
