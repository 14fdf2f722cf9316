// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace lensforge {

/// What a browser asks for.
struct LoopbackRequest {
  bool post = false;      ///< GET otherwise.
  std::string_view path;  ///< Without a query.
};

/// What is sent. The bytes are shared, not copied for every client.
struct LoopbackAnswer {
  const char* type = "";                     ///< Content-Type.
  std::shared_ptr<const std::string> bytes;  ///< None: there is no such page.
};

/// Serves pages to browsers on this machine by HTTP. Others' pages can neither read nor frame what
/// it serves, nor POST to it. It answers one request on a connection, and decides by its header: no
/// body is kept. Each client has 2 s for a header of 8 kB at most; of 32 connections the oldest
/// idle one is closed for a new one.
class LoopbackServer {
 public:
  /// Called by the server's thread.
  using Answer = std::function<LoopbackAnswer(const LoopbackRequest&)>;

  /// @param port  0 takes a free one. @throw InputError naming --live and the port if it cannot be
  ///              had.
  LoopbackServer(int port, Answer answer);
  /// Ends at once and closes all connections, whatever their clients do.
  ~LoopbackServer();
  LoopbackServer(const LoopbackServer&) = delete;
  LoopbackServer& operator=(const LoopbackServer&) = delete;

  [[nodiscard]] int port() const;

 private:
  class Listener;
  std::unique_ptr<Listener> listener_;
};

}  // namespace lensforge
