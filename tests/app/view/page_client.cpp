// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/view/page_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>
#include <vector>

namespace lensforge::testing {
namespace {

using Clock = std::chrono::steady_clock;

/// True if the socket is ready for `events` before `end`.
bool ready(int socket, short events, Clock::time_point end) {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now());
  pollfd entry{socket, events, 0};
  return ::poll(&entry, 1, static_cast<int>(std::max<std::int64_t>(left.count(), 0))) > 0;
}

/// A line that a header may have or must not have.
std::string hostile_line(int port, fuzz::Random& random) {
  const std::string own = "127.0.0.1:" + std::to_string(port);
  const std::vector<std::string> lines{"Host: " + own,
                                       "Host: elsewhere.example",
                                       "Host:",
                                       "Host : " + own,
                                       "Content-Length: -1",
                                       "Content-Length: 400000000",
                                       "Content-Length: 99999999999999999999999",
                                       "Content-Length: 5, 6",
                                       "Content-Length: 0x10",
                                       "Transfer-Encoding: chunked",
                                       "Transfer-Encoding: gzip, chunked",
                                       "Connection: keep-alive",
                                       "Expect: 100-continue",
                                       "Upgrade: websocket",
                                       "Range: bytes=0-0,0-1,0-2,-1",
                                       "Origin: http://elsewhere.example",
                                       " folded",
                                       "no colon",
                                       ": no name",
                                       "X: " + std::string(random.below(20'000), 'x'),
                                       "X: " + random.bytes(random.below(100))};
  return random.pick(lines) + (random.one_in(5) ? "\n" : "\r\n");
}

std::string hostile_target(fuzz::Random& random) {
  static const std::vector<std::string> kTargets{"/",
                                                 "/stop",
                                                 "/state.json",
                                                 "/../../etc/passwd",
                                                 "/%2e%2e/%00",
                                                 "http://elsewhere.example/",
                                                 "",
                                                 "*",
                                                 "//",
                                                 "/target.png?",
                                                 "/?\x80\xFF",
                                                 "/ /",
                                                 "/#a",
                                                 "\\",
                                                 "?"};
  return random.one_in(8) ? "/" + std::string(random.below(20'000), 'a') : random.pick(kTargets);
}

void spoil(std::string& bytes, fuzz::Random& random) {
  for (std::size_t i = random.below(4); i > 0 && !bytes.empty(); --i) {
    const std::size_t at = random.below(bytes.size());
    switch (random.below(3)) {
      case 0:
        bytes[at] = random.byte();
        break;
      case 1:
        bytes.erase(at, 1 + random.below(8));
        break;
      default:
        bytes.resize(at);
    }
  }
}

}  // namespace

PageClient::PageClient(int port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  // The socket API takes all kinds of addresses by this type.
  const auto* const any = reinterpret_cast<const sockaddr*>(&address);  // NOLINT
  if (::connect(socket_, any, sizeof address) == 0) return;
  const int error = errno;
  ::close(socket_);
  throw std::system_error(error, std::generic_category(), "connect");
}

PageClient::PageClient(PageClient&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)), closed_(other.closed_) {}

PageClient& PageClient::operator=(PageClient&& other) noexcept {
  std::swap(socket_, other.socket_);
  std::swap(closed_, other.closed_);
  return *this;
}

PageClient::~PageClient() {
  if (socket_ >= 0) ::close(socket_);
}

std::size_t PageClient::send(std::string_view bytes, std::chrono::milliseconds limit) const {
  const auto end = Clock::now() + limit;
  std::size_t sent = 0;
  while (sent < bytes.size() && ready(socket_, POLLOUT, end)) {
    const ssize_t count =
        ::send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count < 0) break;
    sent += static_cast<std::size_t>(count);
  }
  return sent;
}

std::string PageClient::receive(std::chrono::milliseconds limit) {
  const auto end = Clock::now() + limit;
  std::string text;
  std::array<char, 65536> buffer{};
  while (!closed_ && ready(socket_, POLLIN, end)) {
    const ssize_t count = ::recv(socket_, buffer.data(), buffer.size(), MSG_DONTWAIT);
    closed_ = count <= 0;
    if (count > 0) text.append(buffer.data(), static_cast<std::size_t>(count));
  }
  return text;
}

std::string page_request(int port, const std::string& first_line, const std::string& more) {
  return first_line + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n" + more +
         "\r\n";
}

PageAnswer ask(int port, const std::string& request, std::chrono::milliseconds limit) {
  PageClient client(port);
  client.send(request, limit);
  const std::string text = client.receive(limit);
  const std::string begin = "HTTP/1.1 ";
  const std::size_t end = text.find("\r\n\r\n");
  if (!client.closed() || !text.starts_with(begin) || end == std::string::npos) return {};
  return {std::stoi(text.substr(begin.size())), text.substr(0, end + 2), text.substr(end + 4)};
}

std::string hostile_request(int port, fuzz::Random& random) {
  if (random.one_in(6)) return random.bytes(random.below(20'000));
  static const std::vector<std::string> kMethods{"GET", "POST", "HEAD", "OPTIONS",
                                                 "get", "",     "PRI"};
  static const std::vector<std::string> kVersions{" HTTP/1.1", " HTTP/1.0", " HTTP/0.9",
                                                  "",          " HTTP/2.0", " HTTP/9999999999"};
  std::string bytes;
  for (std::size_t i = 1 + random.below(3); i > 0; --i) {
    bytes += random.pick(kMethods) + " " + hostile_target(random) + random.pick(kVersions) + "\r\n";
    for (std::size_t line = random.below(6); line > 0; --line) bytes += hostile_line(port, random);
    if (!random.one_in(4)) bytes += "\r\n";
    if (random.one_in(4)) bytes += random.bytes(random.below(10'000));
  }
  spoil(bytes, random);
  return bytes;
}

}  // namespace lensforge::testing
