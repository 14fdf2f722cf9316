// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "fuzz/random.h"

/// Clients of a server on this machine, down to the bytes that they send.
namespace lensforge::testing {

/// Within this a proper request is answered and a server ends.
inline constexpr std::chrono::seconds kPromptly{1};

/// A connection. None of its functions waits longer than it is told.
class PageClient {
 public:
  /// @throw std::system_error if nobody listens at the port.
  explicit PageClient(int port);
  ~PageClient();
  PageClient(PageClient&& other) noexcept;
  PageClient& operator=(PageClient&& other) noexcept;
  PageClient(const PageClient&) = delete;
  PageClient& operator=(const PageClient&) = delete;

  /// @return how many bytes were taken before the server closed the connection or the time was up.
  std::size_t send(std::string_view bytes, std::chrono::milliseconds limit = kPromptly) const;
  /// Receives until the server closes the connection or the time is up.
  std::string receive(std::chrono::milliseconds limit = kPromptly);
  /// True if receive() has seen the server close the connection.
  [[nodiscard]] bool closed() const { return closed_; }

 private:
  int socket_ = -1;
  bool closed_ = false;
};

/// A request that the server answers. @param more  header lines, each with its end.
std::string page_request(int port, const std::string& first_line = "GET /",
                         const std::string& more = "");

/// Answer of a server.
struct PageAnswer {
  int status = 0;  ///< 0: nothing came, or the answer did not end in time.
  std::string head;
  std::string body;
};

/// Sends a request on a connection of its own.
PageAnswer ask(int port, const std::string& request, std::chrono::milliseconds limit = kPromptly);

/// Bytes that are no proper request, or that a client of bad intent sends. None of them has the
/// header that `POST /stop` needs.
std::string hostile_request(int port, fuzz::Random& random);

}  // namespace lensforge::testing
