// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/link/tcp_link.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <memory>
#include <system_error>

#include "core/error.h"
#include "machine/link/poll_wait.h"

namespace lensforge {
namespace {

constexpr std::size_t kReadBytes = 4096;

// A silent peer is asked after 3 s, then every 2 s, and given up after three questions.
constexpr int kIdleSeconds = 3;
constexpr int kProbeSeconds = 2;
constexpr int kProbes = 3;
/// Bytes that stay unacknowledged for longer mean a dead link, ms.
constexpr int kUserTimeout = 10'000;

std::string reason(int error) { return std::generic_category().message(error); }

struct FreeAddresses {
  void operator()(addrinfo* list) const { ::freeaddrinfo(list); }
};
using Addresses = std::unique_ptr<addrinfo, FreeAddresses>;

Addresses look_up(const PortSpec& spec) {
  addrinfo wanted{};
  wanted.ai_family = AF_UNSPEC;
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  const std::string port = std::to_string(spec.tcp_port);
  const int error = ::getaddrinfo(spec.place.c_str(), port.c_str(), &wanted, &list);
  if (error != 0) {
    throw InputError("--port " + port_name(spec) + ": no such host: " + ::gai_strerror(error));
  }
  return Addresses(list);
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
int connect_to(int socket, const addrinfo& address, double timeout) {
  if (::connect(socket, address.ai_addr, address.ai_addrlen) == 0) return 0;
  if (errno != EINPROGRESS) return errno;
  if (wait_for(socket, POLLOUT, timeout) == 0) return ETIMEDOUT;
  int error = 0;
  socklen_t size = sizeof error;
  ::getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size);
  return error;
}

Descriptor connect_to_any(const PortSpec& spec, double timeout) {
  const Addresses addresses = look_up(spec);
  int error = 0;
  for (const addrinfo* at = addresses.get(); at != nullptr; at = at->ai_next) {
    Descriptor socket(
        ::socket(at->ai_family, at->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, at->ai_protocol));
    error = socket.open() ? connect_to(socket.number(), *at, timeout) : errno;
    if (error != 0) continue;
    set_options(socket.number());
    return socket;
  }
  throw InputError("--port " + port_name(spec) + ": cannot be reached: " + reason(error));
}

}  // namespace

TcpLink::TcpLink(const PortSpec& spec, double timeout)
    : name_(port_name(spec)), lock_(spec), socket_(connect_to_any(spec, timeout)) {}

void TcpLink::lose(const std::string& why) const { throw LinkLost(name_ + " is gone: " + why); }

std::string TcpLink::read(double wait) {
  if (wait_for(socket_.number(), POLLIN, wait) == 0) return {};
  std::array<char, kReadBytes> bytes{};
  const ssize_t count = ::recv(socket_.number(), bytes.data(), bytes.size(), 0);
  if (count > 0) return {bytes.data(), static_cast<std::size_t>(count)};
  if (count == 0) lose("closed by the other side");
  if (errno == EAGAIN || errno == EINTR) return {};
  lose(reason(errno));
}

std::size_t TcpLink::write(std::string_view bytes) {
  const ssize_t count = ::send(socket_.number(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (count >= 0) return static_cast<std::size_t>(count);
  if (errno == EAGAIN || errno == EINTR) return 0;
  lose(reason(errno));
}

}  // namespace lensforge
