// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "machine/link/link.h"
#include "machine/stream/reply_parser.h"

namespace lensforge {

/// Lines out, replies in. What the link does not take at once waits here; realtime bytes pass it
/// by.
class Wire {
 public:
  /// @param link  must outlive the wire.
  explicit Wire(Link& link) : link_(link) {}

  /// Puts a line, which gets its end here, behind those that wait.
  void line(std::string_view text);
  /// Sends a realtime byte, ahead of all that waits. @throw LinkLost
  void urgent(char byte);
  /// Writes as much as the link takes. @throw LinkLost
  void flush();
  /// Whether something waits to be written.
  [[nodiscard]] bool waiting() const { return written_ < lines_.size() || !urgent_.empty(); }
  /// Drops all lines and parts of lines that were not written; realtime bytes stay.
  void discard();
  /// Waits at most `wait` seconds for bytes and hands on the replies that they complete.
  /// @throw LinkLost, and whatever `take` throws
  void receive(double wait, const std::function<void(const Reply&)>& take);

 private:
  Link& link_;
  ReplyReader reader_;
  std::string urgent_;
  std::string lines_;
  std::size_t written_ = 0;  ///< Bytes of lines_ that are gone.
};

}  // namespace lensforge
