// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/link/port.h"

#include <fcntl.h>
#include <libserialport.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <thread>

#include "core/error.h"
#include "core/io/files.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr int kSlowestBaud = 1200;
constexpr int kFastestBaud = 12'000'000;
constexpr int kLastTcpPort = 65535;

[[noreturn]] void refuse(std::string_view text, const std::string& rule) {
  throw InputError("--port '" + std::string(text) + "': " + rule);
}

std::optional<int> whole_number(std::string_view text) {
  int number = 0;
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || stopped != end) return std::nullopt;
  return number;
}

PortSpec tcp_spec(std::string_view whole, std::string_view rest) {
  const std::size_t colon = rest.rfind(':');
  if (colon == std::string_view::npos || colon == 0) refuse(whole, "must read tcp:HOST:PORT");
  const auto number = whole_number(rest.substr(colon + 1));
  if (!number || *number < 1 || *number > kLastTcpPort) {
    refuse(whole, "the TCP port must be an integer, 1 to 65535");
  }
  std::string_view host = rest.substr(0, colon);
  const bool bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
  if (bracketed) host = host.substr(1, host.size() - 2);
  if (!bracketed && host.find(':') != std::string_view::npos) {
    refuse(whole, "an IPv6 address needs brackets, tcp:[::1]:PORT");
  }
  return {PortSpec::Kind::kTcp, std::string(host), 0, static_cast<std::uint16_t>(*number)};
}

/// Device names have colons too (/dev/serial/by-path/…-usb-0:1.2:1.0-port0): the text after the
/// last one is a speed only if it consists of at least four digits.
PortSpec serial_spec(std::string_view text) {
  PortSpec spec{PortSpec::Kind::kSerial, std::string(text)};
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos || text.size() - colon < 5) return spec;
  const auto baud = whole_number(text.substr(colon + 1));
  if (!baud) return spec;
  if (*baud < kSlowestBaud || *baud > kFastestBaud) {
    refuse(text, "the speed must be 1200 to 12000000 baud");
  }
  spec.place = std::string(text.substr(0, colon));
  spec.baud = *baud;
  return spec;
}

}  // namespace

PortSpec parse_port_spec(std::string_view text) {
  if (text.starts_with("sim:")) {
    return {PortSpec::Kind::kSimulated, std::string(text.substr(4))};
  }
  if (text.starts_with("tcp:")) return tcp_spec(text, text.substr(4));
  if (text.starts_with('/')) return serial_spec(text);
  refuse(text, "must be a device such as /dev/ttyUSB0[:115200], tcp:HOST:PORT or sim:");
}

std::string port_name(const PortSpec& spec) {
  switch (spec.kind) {
    case PortSpec::Kind::kSerial:
      return spec.place + ":" + std::to_string(spec.baud);
    case PortSpec::Kind::kTcp: {
      const bool v6 = spec.place.find(':') != std::string::npos;
      const std::string host = v6 ? "[" + spec.place + "]" : spec.place;
      return "tcp:" + host + ":" + std::to_string(spec.tcp_port);
    }
    case PortSpec::Kind::kSimulated:
      break;
  }
  return "sim:" + spec.place;
}

namespace {

/// Readable and writable by all: the lock must also keep off another user.
constexpr mode_t kForAnybody = 0666;

/// A device must not become the controlling terminal, nor wait for a carrier.
constexpr int kOpenFlags = O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC;

[[noreturn]] void refuse(const PortSpec& spec, const std::string& why) {
  throw InputError("--port " + port_name(spec) + ": " + why);
}

/// In sticky folders such as /run/lock Linux refuses O_CREAT on another user's existing file, even
/// for root; hence the first attempt is without it.
Descriptor open_to_lock(const fs::path& file, bool may_create) {
  const int there = ::open(file.c_str(), kOpenFlags);
  if (there >= 0 || errno != ENOENT || !may_create) return Descriptor(there);
  const int made = ::open(file.c_str(), kOpenFlags | O_CREAT, kForAnybody);
  if (made >= 0) ::fchmod(made, kForAnybody);  // The umask took bits away.
  return Descriptor(made);
}

/// Before it is opened, which some things answer by doing something.
void require_device(const PortSpec& spec) {
  std::error_code error;
  const fs::file_type type = fs::status(spec.place, error).type();
  if (type == fs::file_type::not_found || type == fs::file_type::character) return;
  refuse(spec, error && type == fs::file_type::none ? error.message() : "no serial port");
}

}  // namespace

fs::path lock_file(const PortSpec& spec) {
  if (spec.kind == PortSpec::Kind::kSerial) return spec.place;
  std::string name = "lensforge-" + port_name(spec) + ".lock";
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '.') c = '-';
  }
  const fs::path usual = "/run/lock";
  return (fs::is_directory(usual) ? usual : fs::temp_directory_path()) / name;
}

PortLock::PortLock(const PortSpec& spec) {
  if (spec.kind == PortSpec::Kind::kSimulated) return;
  if (spec.kind == PortSpec::Kind::kSerial) require_device(spec);
  file_ = open_to_lock(lock_file(spec), spec.kind == PortSpec::Kind::kTcp);
  if (!file_.open() && errno == EBUSY) refuse(spec, "another program has it open");
  if (!file_.open()) refuse(spec, "cannot be opened: " + system_reason(errno));
  if (::flock(file_.number(), LOCK_EX | LOCK_NB) == 0) return;
  if (errno == EWOULDBLOCK) refuse(spec, "another sender is using it");
  refuse(spec, "cannot be locked: " + system_reason(errno));
}

short wait_for(int descriptor, short events, double seconds) {
  using std::chrono::steady_clock;
  const auto end = steady_clock::now() + std::chrono::duration<double>(std::max(seconds, 0.0));
  for (;;) {
    pollfd watched{descriptor, events, 0};
    const std::chrono::duration<double, std::milli> left = end - steady_clock::now();
    const int milliseconds = static_cast<int>(std::ceil(std::clamp(left.count(), 0.0, 1e6)));
    const int ready = ::poll(&watched, 1, milliseconds);
    if (ready > 0) return watched.revents;
    if (ready == 0 || errno != EINTR) return 0;
  }
}

namespace {

constexpr int kDataBits = 8;

/// At most so many come out of a link at once.
constexpr std::size_t kReadBytes = 4096;

/// The library's last error in words, which it hands out in memory of its own.
std::string last_error() {
  char* message = sp_last_error_message();
  std::string text = message != nullptr ? message : "unknown error";
  sp_free_error_message(message);
  return text;
}

void require(sp_return result, const PortSpec& spec, const std::string& what) {
  if (result == SP_OK) return;
  const std::string why = result == SP_ERR_FAIL ? last_error() : "not possible on this port";
  throw InputError("--port " + port_name(spec) + ": " + what + ": " + why);
}

/// Every byte as it is, both ways.
void make_raw(int descriptor) {
  termios settings{};
  if (::tcgetattr(descriptor, &settings) != 0) return;
  ::cfmakeraw(&settings);
  ::tcsetattr(descriptor, TCSANOW, &settings);
}

/// Without HUPCL the system keeps DTR raised when the port is closed; the next opening makes no
/// edge and resets no board.
void keep_dtr_when_closed(int descriptor) {
  termios settings{};
  if (::tcgetattr(descriptor, &settings) != 0) return;
  settings.c_cflag &= ~static_cast<tcflag_t>(HUPCL);
  ::tcsetattr(descriptor, TCSANOW, &settings);
}

}  // namespace

void SerialLink::ClosePort::operator()(sp_port* port) const {
  sp_close(port);
  sp_free_port(port);
}

SerialLink::SerialLink(const PortSpec& spec) : name_(spec.place), lock_(spec) {
  if (::isatty(lock_.descriptor()) == 0) {
    throw InputError("--port " + port_name(spec) + ": no serial port");
  }
  // libserialport knows real ports only, and a pseudo-terminal has no speed to set.
  const std::string device = fs::canonical(spec.place).string();
  if (device.starts_with("/dev/pts/")) {
    make_raw(lock_.descriptor());
  } else {
    configure(spec, device);
  }
  keep_dtr_when_closed(lock_.descriptor());
}

void SerialLink::configure(const PortSpec& spec, const std::string& device) {
  sp_port* port = nullptr;
  require(sp_get_port_by_name(device.c_str(), &port), spec, "no serial port");
  port_.reset(port);
  require(sp_open(port, SP_MODE_READ_WRITE), spec, "cannot be opened");
  require(sp_set_baudrate(port, spec.baud), spec, "speed not taken");
  require(sp_set_bits(port, kDataBits), spec, "eight data bits not taken");
  require(sp_set_parity(port, SP_PARITY_NONE), spec, "no parity not taken");
  require(sp_set_stopbits(port, 1), spec, "one stop bit not taken");
  require(sp_set_flowcontrol(port, SP_FLOWCONTROL_NONE), spec, "no flow control not taken");
}

void SerialLink::lose(const std::string& why) const {
  throw LinkLost("serial port " + name_ + " is gone: " + why);
}

std::string SerialLink::read(double wait) {
  const short events = wait_for(lock_.descriptor(), POLLIN, wait);
  if (events == 0) return {};
  std::array<char, kReadBytes> bytes{};
  const ssize_t count = ::read(lock_.descriptor(), bytes.data(), bytes.size());
  if (count > 0) return {bytes.data(), static_cast<std::size_t>(count)};
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return {};
  // A port that is ready but has nothing to give was unplugged or hung up.
  lose(count == 0 ? "hung up" : system_reason(errno));
}

std::size_t SerialLink::write(std::string_view bytes) {
  const ssize_t count = ::write(lock_.descriptor(), bytes.data(), bytes.size());
  if (count >= 0) return static_cast<std::size_t>(count);
  if (errno == EAGAIN || errno == EINTR) return 0;
  lose(system_reason(errno));
}

namespace {

// A silent peer is asked after 3 s, then every 2 s, and given up after three questions.
constexpr int kIdleSeconds = 3;
constexpr int kProbeSeconds = 2;
constexpr int kProbes = 3;
/// Bytes that stay unacknowledged for longer mean a dead link, ms.
constexpr int kUserTimeout = 10'000;
/// Longest time without a look at the stop token, s.
constexpr double kStopCheck = 0.1;

struct FreeAddresses {
  void operator()(addrinfo* list) const { ::freeaddrinfo(list); }
};
using Addresses = std::unique_ptr<addrinfo, FreeAddresses>;

/// The resolver's result for a host; `flags` of getaddrinfo().
struct Lookup {
  int error = 0;
  Addresses list;
};

Lookup ask_resolver(const PortSpec& spec, int flags) {
  addrinfo wanted{};
  wanted.ai_family = AF_UNSPEC;
  wanted.ai_socktype = SOCK_STREAM;
  wanted.ai_flags = flags;
  addrinfo* list = nullptr;
  const std::string port = std::to_string(spec.tcp_port);
  const int error = ::getaddrinfo(spec.place.c_str(), port.c_str(), &wanted, &list);
  return {error, Addresses(error == 0 ? list : nullptr)};
}

/// The resolver may take half a minute and cannot be interrupted; it runs on a thread that is
/// abandoned on a stop request.
Lookup look_up_name(const PortSpec& spec, const std::stop_token& stop) {
  struct Shared {
    std::mutex mutex;
    std::condition_variable changed;
    std::optional<Lookup> answer;
  };
  const auto shared = std::make_shared<Shared>();
  std::thread([shared, spec] {
    Lookup answer = ask_resolver(spec, 0);
    const std::lock_guard lock(shared->mutex);
    shared->answer = std::move(answer);
    shared->changed.notify_all();
  }).detach();
  std::unique_lock lock(shared->mutex);
  while (!shared->answer) {
    if (stop.stop_requested()) throw Interrupted();
    shared->changed.wait_for(lock, std::chrono::duration<double>(kStopCheck));
  }
  return std::move(*shared->answer);
}

Addresses look_up(const PortSpec& spec, const std::stop_token& stop) {
  Lookup found = ask_resolver(spec, AI_NUMERICHOST);
  if (found.error != 0) found = look_up_name(spec, stop);
  if (found.error != 0) {
    throw InputError("--port " + port_name(spec) +
                     ": unknown host: " + ::gai_strerror(found.error));
  }
  return std::move(found.list);
}

void set(int socket, int level, int option, int value) {
  ::setsockopt(socket, level, option, &value, sizeof value);
}

void set_options(int socket) {
  set(socket, IPPROTO_TCP, TCP_NODELAY, 1);
  set(socket, SOL_SOCKET, SO_KEEPALIVE, 1);
  set(socket, IPPROTO_TCP, TCP_KEEPIDLE, kIdleSeconds);
  set(socket, IPPROTO_TCP, TCP_KEEPINTVL, kProbeSeconds);
  set(socket, IPPROTO_TCP, TCP_KEEPCNT, kProbes);
  set(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, kUserTimeout);
}

/// Connects to one address. @return 0 or an errno value.
int connect_to(int socket, const addrinfo& address, const std::stop_token& stop, double timeout) {
  if (::connect(socket, address.ai_addr, address.ai_addrlen) == 0) return 0;
  if (errno != EINPROGRESS) return errno;
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(timeout);
  while (wait_for(socket, POLLOUT, std::min(kStopCheck, timeout)) == 0) {
    if (stop.stop_requested()) throw Interrupted();
    if (std::chrono::steady_clock::now() >= end) return ETIMEDOUT;
  }
  int error = 0;
  socklen_t size = sizeof error;
  ::getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size);
  return error;
}

Descriptor connect_to_any(const PortSpec& spec, const std::stop_token& stop, double timeout) {
  const Addresses addresses = look_up(spec, stop);
  int error = 0;
  for (const addrinfo* at = addresses.get(); at != nullptr; at = at->ai_next) {
    Descriptor socket(
        ::socket(at->ai_family, at->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, at->ai_protocol));
    error = socket.open() ? connect_to(socket.number(), *at, stop, timeout) : errno;
    if (error != 0) continue;
    set_options(socket.number());
    return socket;
  }
  throw InputError("--port " + port_name(spec) + ": cannot be reached: " + system_reason(error));
}

}  // namespace

TcpLink::TcpLink(const PortSpec& spec, const std::stop_token& stop, double timeout)
    : name_(port_name(spec)), lock_(spec), socket_(connect_to_any(spec, stop, timeout)) {}

void TcpLink::lose(const std::string& why) const { throw LinkLost(name_ + " is gone: " + why); }

std::string TcpLink::read(double wait) {
  if (wait_for(socket_.number(), POLLIN, wait) == 0) return {};
  std::array<char, kReadBytes> bytes{};
  const ssize_t count = ::recv(socket_.number(), bytes.data(), bytes.size(), 0);
  if (count > 0) return {bytes.data(), static_cast<std::size_t>(count)};
  if (count == 0) lose("closed by the other side");
  if (errno == EAGAIN || errno == EINTR) return {};
  lose(system_reason(errno));
}

std::size_t TcpLink::write(std::string_view bytes) {
  const ssize_t count = ::send(socket_.number(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (count >= 0) return static_cast<std::size_t>(count);
  if (errno == EAGAIN || errno == EINTR) return 0;
  lose(system_reason(errno));
}

}  // namespace lensforge
