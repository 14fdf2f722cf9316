// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/link/tcp_link.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>

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
/// Longest time without a look at the stop token, s.
constexpr double kStopCheck = 0.1;

std::string reason(int error) { return std::generic_category().message(error); }

struct FreeAddresses {
  void operator()(addrinfo* list) const { ::freeaddrinfo(list); }
};
using Addresses = std::unique_ptr<addrinfo, FreeAddresses>;

/// What the resolver says of a host; `flags` of getaddrinfo().
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

/// The resolver may take half a minute and cannot be interrupted, so it works on a thread that is
/// left alone if nobody waits for it any more.
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
  throw InputError("--port " + port_name(spec) + ": cannot be reached: " + reason(error));
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
  lose(reason(errno));
}

std::size_t TcpLink::write(std::string_view bytes) {
  const ssize_t count = ::send(socket_.number(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (count >= 0) return static_cast<std::size_t>(count);
  if (errno == EAGAIN || errno == EINTR) return 0;
  lose(reason(errno));
}

}  // namespace lensforge
