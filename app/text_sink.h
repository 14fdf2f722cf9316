// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/io/descriptor.h"

namespace lensforge::app {

/// "2026-07-30T14:05:09.250Z": now, UTC.
std::string time_stamp();

/// Whether a text begins as time_stamp() does.
bool begins_with_time(std::string_view text);

/// What a TextSink is filled with, and how it is told from other people's files.
struct SinkKind {
  const char* name;                             ///< "log"
  bool (*begins)(std::string_view first_line);  ///< Whether one of this kind begins with that line.
};

/// A file, pipe or device that lines are appended to beside a running job, which it never stops: a
/// reader that does not keep up loses whole lines, and a failure ends the writing and is said once.
class TextSink {
 public:
  /// Is open() at once. Nothing is written to a file that holds anything else than what an earlier
  /// sink of this kind wrote, nor to a disk or to a serial port.
  /// @param path  "-" for standard output. @throw InputError if it cannot be.
  TextSink(const std::filesystem::path& path, const SinkKind& kind);
  TextSink() = default;

  [[nodiscard]] bool open() const { return file_.open(); }
  /// Writes a line with its end. @return why it could not and nothing is written from now on, or
  /// empty.
  std::string write(const std::string& line);
  /// Lines that were lost to a slow reader since the last call.
  long take_lost();

 private:
  std::filesystem::path path_;
  Descriptor file_;
  long lost_ = 0;
};

}  // namespace lensforge::app
