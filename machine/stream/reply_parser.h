// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "machine/stream/status_report.h"

namespace lensforge {

/// One line from a Grbl-family controller.
struct Reply {
  enum class Kind {
    kOk,       ///< "ok": a line was taken.
    kError,    ///< "error:N": a line was refused.
    kAlarm,    ///< "ALARM:N"
    kStatus,   ///< "<…>"
    kMessage,  ///< "[MSG:…]"
    kData,     ///< "[NAME:…]": answers to $G, $#, $I …
    kSetting,  ///< "$N=value", also of a start-up line, "$N0=…"
    kStartup,  ///< ">…:ok": a start-up line was run.
    kBanner,   ///< "Grbl 1.1f ['$' for help]": the controller has started afresh.
    kEmpty,    ///< Nothing but the line's end.
    kUnknown,  ///< Anything else: never guessed at.
  };
  Kind kind = Kind::kUnknown;
  std::string text;                    ///< The line without its end.
  int code = 0;                        ///< Of kError and kAlarm.
  std::string name;                    ///< Of kData ("GC", "OPT") and kSetting ("30", "N0").
  std::string value;                   ///< What follows the name; of kMessage the message.
  std::optional<StatusReport> status;  ///< Of kStatus.
};

/// Strict: whatever differs from what Grbl 1.1 and grblHAL write is kUnknown.
/// @param line  without its end.
Reply parse_reply(std::string_view line);

/// Cuts a stream of bytes into lines (LF, or CR LF) and parses them.
class ReplyReader {
 public:
  /// Longer lines, which no controller sends, come out as kUnknown, cut here.
  static constexpr std::size_t kLongestLine = 1024;

  /// Hands every line that `bytes` complete to `take`, in order. Keeps the remaining bytes.
  void feed(std::string_view bytes, const std::function<void(const Reply&)>& take);
  /// Drops the line that has begun.
  void clear() { line_.clear(); }

 private:
  std::string line_;
  bool too_long_ = false;
};

}  // namespace lensforge
