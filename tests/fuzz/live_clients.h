// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <sys/types.h>

#include <cstdint>

namespace lensforge::fuzz {

/// Hostile clients of a live page, in a process of their own, from before the page is there until
/// this object goes. Between them they send proper requests.
class LiveClients {
 public:
  explicit LiveClients(std::uint64_t seed);
  ~LiveClients();
  LiveClients(const LiveClients&) = delete;
  LiveClients& operator=(const LiveClients&) = delete;

  /// Kept free for the page, which may listen there.
  [[nodiscard]] int port() const { return port_; }
  /// True if valid requests to an existing page have got no answer so far.
  [[nodiscard]] bool unanswered() const;

 private:
  int socket_ = -1;
  int port_ = 0;
  int complaints_ = -1;
  pid_t pid_ = -1;
};

}  // namespace lensforge::fuzz
