// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace lensforge {

/// Bad input or bad usage: the message names the file or option, the value and the rule it broke.
/// The command prints that one line and exits with 2.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file or folder that is to be read does not exist.
class MissingFile : public InputError {
 public:
  MissingFile(const std::string& message, std::string path)
      : InputError(message), path_(std::move(path)) {}

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// Something outside the program failed while it ran (disk full, file vanished). Exit code 1.
class RunError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The caller requested a stop (RunControl) and the work was abandoned.
class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("interrupted") {}
};

/// Prints the broken condition with its values to stderr and aborts: a bug in lensforge itself.
[[noreturn]] void check_failed(const char* condition, const char* file, int line,
                               const std::string& values);

}  // namespace lensforge

/// Aborts with the condition and `values` (anything convertible to std::string) if it is false.
#define LF_CHECK(condition, values) \
  ((condition) ? (void)0 : ::lensforge::check_failed(#condition, __FILE__, __LINE__, (values)))
