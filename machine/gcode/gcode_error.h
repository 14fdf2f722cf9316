// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>

#include "core/error.h"

namespace lensforge {

/// A line of a program that is refused: "line 12: reason".
class GcodeError : public InputError {
 public:
  /// @param line  counted from 1.
  GcodeError(std::int64_t line, const std::string& reason)
      : InputError("line " + std::to_string(line) + ": " + reason), line_(line) {}

  [[nodiscard]] std::int64_t line() const { return line_; }

 private:
  std::int64_t line_;
};

}  // namespace lensforge
