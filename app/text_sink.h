// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "machine/link/descriptor.h"

namespace lensforge::app {

/// "2026-07-30T14:05:09.250Z": now, UTC.
std::string time_stamp();

/// A file, pipe or device that lines are appended to beside a running job, which it never stops: a
/// reader that does not keep up loses whole lines, and a failure ends the writing and is said once.
class TextSink {
 public:
  /// Is open() at once. @param path  "-" for standard output. @throw InputError if it cannot be.
  explicit TextSink(const std::filesystem::path& path);
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
