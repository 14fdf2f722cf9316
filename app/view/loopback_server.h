// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/lens/optical_surface.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// Request of a browser.
struct LoopbackRequest {
  bool post = false;        ///< GET otherwise.
  std::string_view path;    ///< Without a query; escapes as they came.
  std::string_view query;   ///< Behind "?".
  std::string_view cookie;  ///< The whole header line.
  std::string_view body;    ///< Of a POST, where LoopbackOptions::max_body allows one.
};

/// Answer to a request. The bytes are shared, not copied for every client.
struct LoopbackAnswer {
  std::string type = {};                          ///< Content-Type.
  std::shared_ptr<const std::string> bytes = {};  ///< Null: there is no such page.
  unsigned status = 200;
  std::string cookie = {};     ///< Set-Cookie; empty: none.
  std::string file_name = {};  ///< The browser saves the bytes under this name; empty: shows them.
};

struct LoopbackOptions {
  int port = 0;             ///< 0 takes a free one.
  std::string option = {};  ///< That states the port, for messages.
  /// Largest body of a POST, bytes. 0: bodies are dropped, and a request is answered by its header.
  std::size_t max_body = 0;
};

/// Serves pages to browsers on this machine by HTTP. Other sites' pages can neither read nor frame
/// its pages, nor POST to it. It answers one request per connection. Each client has 2 s for a
/// header of at most 8 kB and 60 s for a body; of 32 connections the oldest idle one is closed for
/// a new one.
class LoopbackServer {
 public:
  /// Called by the server's thread.
  using Answer = std::function<LoopbackAnswer(const LoopbackRequest&)>;

  /// @throw InputError naming option and port if it cannot be had.
  LoopbackServer(const LoopbackOptions& options, Answer answer);
  /// Ends at once and closes all connections, whatever their clients do.
  ~LoopbackServer();
  LoopbackServer(const LoopbackServer&) = delete;
  LoopbackServer& operator=(const LoopbackServer&) = delete;

  [[nodiscard]] int port() const;
  /// "http://127.0.0.1:8080/"
  [[nodiscard]] std::string address() const;

 private:
  class Listener;
  std::unique_ptr<Listener> listener_;
};

/// The port that an option names. @throw InputError unless it is a whole number from 0 to 65535.
int loopback_port(const std::string& option, const std::string& text);

/// State of a running design, as served.
struct LiveState {
  std::int64_t number = 0;  ///< Number of the state; pictures change with it.
  std::string json;         ///< For the page's script.
  std::string picture;      ///< Bytes of a PNG each.
  std::string error;
  std::string second = {};  ///< The picture on the second screen; empty if there is none.
};

/// Serves the page of a running design to browsers on this machine: loopback only, and only to its
/// own pages.
class LiveServer {
 public:
  /// @param port    0: any free port.
  /// @param name    name of the design. @param target bytes of a PNG.
  /// @param stop    called once, by a thread of the server, when the page's stop button is pressed.
  /// @throw InputError naming --live and the port if the port is not available.
  LiveServer(int port, const std::string& name, std::string target, std::function<void()> stop);
  ~LiveServer();
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  /// "http://127.0.0.1:8080/"
  [[nodiscard]] std::string address() const;
  /// Serves `state` from now on.
  void publish(LiveState state);

 private:
  class Content;
  std::unique_ptr<Content> content_;
};

/// Goal of a design.
struct DesignGoalView {
  Image target;  ///< Working picture, linear light.
  OpticalSetup setup;
  SurfaceModel model = SurfaceModel::kSmooth;
  std::optional<Image> second = {};  ///< Working picture of setup.second.
};

/// Computes the state of a running design from its latest checkpoint: the picture at full size, its
/// error, and every step so far.
/// @param number  of the state. @throw InputError if the checkpoint cannot be read.
LiveState state_of_design(const std::filesystem::path& checkpoint, const DesignGoalView& goal,
                          std::int64_t number, const Executor& executor);

}  // namespace lensforge
