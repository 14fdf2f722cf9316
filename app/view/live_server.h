// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/lens/optical_surface.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// State of a running design, as served.
struct LiveState {
  std::int64_t number = 0;  ///< Number of the state; pictures change with it.
  std::string json;         ///< For the page's script.
  std::string picture;      ///< Bytes of a PNG each.
  std::string error;
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
};

/// Computes the state of a running design from its latest checkpoint: the picture at full size, its
/// error, and every step so far.
/// @param number  of the state. @throw InputError if the checkpoint cannot be read.
LiveState state_of_design(const std::filesystem::path& checkpoint, const DesignGoalView& goal,
                          std::int64_t number, const Executor& executor);

}  // namespace lensforge
